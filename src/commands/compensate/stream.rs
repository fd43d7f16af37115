//! The streaming way: pieces of the file go through the stages on all cores, in bounded memory.

use std::collections::VecDeque;

use torqcomp_dsp::compensate::{BlockConvolver, Windows};
use torqcomp_dsp::noise::RecordNoise;
use torqcomp_dsp::resample::Resampler;
use torqcomp_dsp::spectrum::{PowerSum, welch};

use super::plot::Traces;
use super::sink::Sink;
use super::{Extent, Plan, Run};
use crate::cli::Compensate;
use crate::commands::convert;
use crate::commands::rows::{Rows, Times};
use crate::failure::Failure;
use crate::io::csv::{TimeAxis, TimeSource};
use crate::io::text::Text;
use crate::pipeline::{self, Stages};
use crate::quality::excerpt;
use crate::signal::Batch;

/// Jobs under way beside those that the threads hold.
const SPARE_JOBS: usize = 2;

/// Longest block of the noise estimate: longer ones may not fit into a piece.
const LONGEST_NOISE_BLOCK: usize = 1 << 13;

/// A piece of the record on its way.
#[derive(Default)]
struct Job {
    batch: Batch,
    /// Sample that did not convert, and why.
    unconverted: Option<(usize, String)>,
    /// Index of the first sample of the window's middle in the record.
    first: usize,
    window: Vec<f64>,
    torque: Vec<f64>,
    text: Text,
    power: Option<PowerSum>,
    extent: Option<Extent>,
}

/// What each sample goes through, the same on every thread.
struct Steps<'a> {
    half_length: usize,
    noise_block: usize,
    time: &'a TimeAxis,
    start_s: f64,
    scale: f64,
    /// Whether the result is text.
    is_text: bool,
    args: &'a Compensate,
}

/// Runs the stages over the whole record.
pub fn run(args: &Compensate, plan: Plan, sink: &mut Sink) -> Result<Run, Failure> {
    let Plan {
        signal,
        chain,
        filter,
        ..
    } = plan;
    let half_length = filter.half_length();
    let rate_hz = signal.time.rate_hz;
    let time = signal.time.clone();
    let first = BlockConvolver::new(&filter);
    let noise_block = first.block_length().min(LONGEST_NOISE_BLOCK);
    let mut joiner = Joiner::new(&time, half_length);
    let steps = Steps {
        half_length,
        noise_block,
        time: &time,
        start_s: signal.first_time_s(),
        scale: 1.0 / chain.applied.factor,
        is_text: sink.is_text(),
        args,
    };
    // Rows enough that a piece needs no more than the one after it.
    let (mut fetch, row_plan, mut sequence) = signal.into_stream(2 * half_length);
    let mut power = PowerSum::new(noise_block);
    let mut extent = Extent::NONE;
    let mut traces = args.plot.as_ref().map(|_| Traces::new(args.plot_range));
    let mut short = Vec::new();
    let threads = args.work.thread_count();
    let mut convolvers: Vec<BlockConvolver> = (1..threads).map(|_| first.another()).collect();
    convolvers.push(first);

    pipeline::run(
        threads + SPARE_JOBS,
        convolvers,
        Stages {
            read: |job: &mut Job| fetch.next(&mut job.batch),
            prepare: |job: &mut Job| {
                job.batch.read_rows(row_plan.as_ref(), &time);
                job.unconverted = convert(&chain, &mut job.batch.rows.values).err();
            },
            join: |job: Option<Job>, ready: &mut dyn FnMut(Job)| match job {
                Some(mut job) => {
                    sequence.accept(&mut job.batch)?;
                    if let Some((row, message)) = &job.unconverted {
                        return Err(sequence.failure_at_row(&job.batch, *row, message));
                    }
                    joiner.push(job, ready)
                }
                None => {
                    joiner.finish(ready);
                    Ok(())
                }
            },
            work: |convolver: &mut BlockConvolver, job: &mut Job| steps.work(convolver, job),
            deliver: |job: &mut Job| {
                let rows = steps.rows(&job.batch, job.first);
                sink.take(job.text.as_bytes(), &rows, &job.torque)?;
                if let Some(part) = &job.power {
                    power.add(part);
                }
                if let Some(traces) = &mut traces {
                    steps.trace(job, traces);
                }
                if let Some(part) = &job.extent {
                    extent.join(part);
                }
                // For what is wrong with the record, and where it is too short for a block of the
                // noise estimate.
                if short.len() < excerpt::OF_STREAM {
                    short.extend_from_slice(steps.recorded(&job.window));
                }
                Ok(())
            },
        },
    )?;

    let density = power.density(rate_hz).or_else(|| {
        let block = (short.len() / 2).next_power_of_two() / 2;
        welch(&short, rate_hz, block).ok()
    });
    let in_print = |mut noise: RecordNoise| {
        noise.floor_density *= steps.scale * steps.scale;
        noise.recorded_rms *= steps.scale;
        noise.compensated_rms *= steps.scale;
        noise.in_band_rms *= steps.scale;
        noise.above_band_rms *= steps.scale;
        noise
    };
    Ok(Run {
        summary: sequence.finish(&mut fetch)?,
        excerpt: short,
        samples: joiner.samples,
        start_s: steps.start_s,
        extent: extent.scaled(steps.scale),
        resampled: joiner.resampled,
        noise: density
            .and_then(|density| RecordNoise::of(&filter, &density))
            .map(in_print),
        traces,
        refined: None,
    })
}

/// Puts the pieces together into windows, in order.
struct Joiner {
    windows: Windows,
    resampler: Option<Resampler>,
    seconds_per_unit: f64,
    waiting: VecDeque<Job>,
    samples: usize,
    resampled: Option<torqcomp_dsp::resample::Resampled>,
}

impl Joiner {
    fn new(time: &TimeAxis, half_length: usize) -> Self {
        let resampler = time
            .is_resampled()
            .then(|| Resampler::new(1.0 / time.rate_hz).expect("a rate found in the stamps"));
        let seconds_per_unit = match &time.source {
            TimeSource::Stamps {
                seconds_per_unit, ..
            } => *seconds_per_unit,
            TimeSource::Given | TimeSource::Header { .. } => 1.0,
        };
        Self {
            windows: Windows::new(half_length),
            resampler,
            seconds_per_unit,
            waiting: VecDeque::new(),
            samples: 0,
            resampled: None,
        }
    }

    fn push(&mut self, job: Job, ready: &mut dyn FnMut(Job)) -> Result<(), Failure> {
        let rows = &job.batch.rows;
        match &mut self.resampler {
            None => {
                self.windows.push(&rows.values);
                self.samples += rows.values.len();
            }
            Some(resampler) => {
                let mut grid = Vec::new();
                for (time, value) in rows.times.iter().zip(&rows.values) {
                    resampler.push(time * self.seconds_per_unit, *value, &mut grid)?;
                }
                self.windows.push(&grid);
                self.samples += grid.len();
            }
        }
        self.waiting.push_back(job);
        self.hand_on(ready);
        Ok(())
    }

    fn finish(&mut self, ready: &mut dyn FnMut(Job)) {
        if let Some(resampler) = self.resampler.take() {
            let mut grid = Vec::new();
            self.resampled = Some(resampler.finish(&mut grid));
            self.windows.push(&grid);
            self.samples += grid.len();
            self.waiting.push_back(Job::default());
        }
        self.windows.finish();
        self.hand_on(ready);
    }

    fn hand_on(&mut self, ready: &mut dyn FnMut(Job)) {
        while let Some(job) = self.waiting.front_mut() {
            job.first = self.windows.passed();
            if !self.windows.pop(&mut job.window) {
                break;
            }
            if let Some(job) = self.waiting.pop_front() {
                ready(job);
            }
        }
    }
}

impl Steps<'_> {
    /// Compensates a window and writes it as text.
    fn work(&self, convolver: &mut BlockConvolver, job: &mut Job) {
        let length = job.window.len() - 2 * self.half_length;
        job.torque.resize(length, 0.0);
        let power = job
            .power
            .get_or_insert_with(|| PowerSum::new(self.noise_block));
        power.clear();
        if self.noise_block == convolver.block_length() {
            // The forward transforms are there anyway.
            convolver.convolve(&job.window, &mut job.torque, Some(power));
        } else {
            convolver.convolve(&job.window, &mut job.torque, None);
            power.add_samples(&job.window[self.half_length..self.half_length + length]);
        }
        job.extent = Some(Extent::of(&job.torque));
        job.text.clear();
        if !self.is_text {
            return;
        }
        let rows = self.rows(&job.batch, job.first);
        let recorded = self.recorded(&job.window);
        let recorded = if self.args.with_recorded {
            recorded
        } else {
            &[]
        };
        rows.write(&mut job.text, &job.torque, recorded);
    }

    fn recorded<'a>(&self, window: &'a [f64]) -> &'a [f64] {
        &window[self.half_length..window.len() - self.half_length]
    }

    fn trace(&self, job: &Job, traces: &mut Traces) {
        let rows = self.rows(&job.batch, job.first);
        let recorded = self.recorded(&job.window);
        for (i, (torque, recorded)) in job.torque.iter().zip(recorded).enumerate() {
            traces.add(rows.time_s(i), recorded * self.scale, torque * self.scale);
        }
    }

    fn rows<'a>(&self, batch: &'a Batch, first: usize) -> Rows<'a> {
        let times = Times::of(batch, self.time, self.start_s, first);
        Rows {
            digits: self.args.digits,
            scale: self.scale,
            rate_hz: self.time.rate_hz,
            times,
        }
    }
}
