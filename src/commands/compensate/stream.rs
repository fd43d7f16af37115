//! Streaming: pieces of the file pass through the stages on all cores, in bounded memory.

use std::collections::VecDeque;

use torqcomp_decimal::Text;
use torqcomp_dsp::band::Band;
use torqcomp_dsp::compensate::{BlockConvolver, InverseFilter, Windows};
use torqcomp_dsp::noise::RecordNoise;
use torqcomp_dsp::quality::streamed::StreamedFaults;
use torqcomp_dsp::quality::sums::SampleSums;
use torqcomp_dsp::resample::{Resampled, Resampler};
use torqcomp_dsp::spectrum::{Density, PowerSum, welch_to_the_ends};

use super::above::{AboveBand, power_above};
use super::report::CompensateReport;
use super::sink::{ResultPart, Sink};
use super::statistics::ResultSums;
use super::{Plan, Seen};
use crate::cli::Compensate;
use crate::commands::convert;
use crate::commands::rows::{ResultRows, Times};
use crate::failure::Failure;
use crate::pipeline::{self, Stages};
use crate::quality::excerpt;
use crate::recording::moment::Moment;
use crate::recording::{Block, StampGrid, StreamValidator, doubts};

/// Number of jobs in addition to one per thread.
const SPARE_JOBS: usize = 2;

/// Maximum block length of the noise estimate: longer blocks may not fit into a piece.
const LONGEST_NOISE_BLOCK: usize = 1 << 13;

/// A piece of the record in process.
#[derive(Default)]
struct Job {
    block: Block,
    /// Sample that cannot be converted, and why.
    unconverted: Option<(usize, String)>,
    /// Index in the record of the first sample of the window's middle.
    first: usize,
    window: Vec<f64>,
    torque: Vec<f64>,
    text: Text,
    power: Option<PowerSum>,
    /// Mean square of the record above the band.
    above: Option<f64>,
    /// Of the result, and of the record.
    sums: Option<[SampleSums; 2]>,
}

/// Processing of each sample, the same on every thread.
struct WindowSteps<'a> {
    half_length: usize,
    noise_block: usize,
    /// The band, if the record is examined for what lies above it.
    watched: Option<&'a Band>,
    grid: Option<&'a StampGrid>,
    rate_hz: f64,
    start: Moment,
    scale: f64,
    /// Whether the result is text.
    is_text: bool,
    args: &'a Compensate,
}

/// Results collected from the finished pieces, in order.
struct Gathered<'a> {
    sink: &'a mut Sink,
    power: PowerSum,
    above: AboveBand,
    sums: ResultSums,
    recorded: SampleSums,
    /// The first samples as recorded: for the quality of the record, and for its noise where it is too short for a
    /// block of the estimate.
    first: Vec<f64>,
    /// Faults of samples anywhere.
    faults: StreamedFaults,
}

/// Runs the stages over the whole record.
pub(super) fn run(
    args: &Compensate,
    plan: Plan,
    sink: &mut Sink,
    report: &mut CompensateReport,
) -> Result<Seen, Failure> {
    let Plan {
        stream,
        chain,
        filter,
        ..
    } = plan;
    let half_length = filter.half_length();
    let rate_hz = stream.rate_hz;
    let grid = stream.channel.axis.grid.clone();
    let grid = grid.as_ref();
    let convolver = BlockConvolver::new(&filter);
    let noise_block = convolver.block_length().min(LONGEST_NOISE_BLOCK);
    let above = AboveBand::of(&report.band, rate_hz);
    let steps = WindowSteps {
        half_length,
        noise_block,
        watched: above.is_open().then(|| filter.band()),
        grid,
        rate_hz,
        start: stream.start,
        scale: 1.0 / chain.applied.factor,
        is_text: sink.is_text(),
        args,
    };
    let mut gathered = Gathered::new(sink, above, &steps);
    let mut joiner = Joiner::new(grid, rate_hz, half_length);
    // Enough rows that a piece needs only the one after it.
    let (mut blocks, row_plan, mut validator) = stream.into_parts(2 * half_length);
    let threads = args.work.thread_count();
    let stages = Stages {
        read: Box::new(|job: &mut Job| blocks.next(&mut job.block)),
        prepare: Box::new(|job: &mut Job| {
            job.block.read_rows(row_plan.as_ref(), grid);
            job.unconverted = convert(&chain, &mut job.block.rows.values).err();
        }),
        join: Box::new(|job, ready| joiner.join(&mut validator, job, ready)),
        work: Box::new(|convolver, job| steps.work(convolver, job)),
        deliver: Box::new(|job| gathered.take(&steps, job)),
    };
    pipeline::run(threads + SPARE_JOBS, convolvers(convolver, threads), stages)?;

    report.samples = joiner.samples;
    report.resampled = joiner.resampled;
    gathered.tell(&steps, &filter, report);
    let mut summary = validator.finish(blocks.as_mut())?;
    summary
        .warnings
        .extend(report.resampled.iter().flat_map(doubts));
    Ok(Seen {
        summary,
        excerpt: gathered.first,
        faults: gathered.faults.finish(),
    })
}

/// A convolver for each thread.
fn convolvers(first: BlockConvolver, threads: usize) -> Vec<BlockConvolver> {
    let mut all: Vec<BlockConvolver> = (1..threads).map(|_| first.another()).collect();
    all.push(first);
    all
}

impl<'a> Gathered<'a> {
    fn new(sink: &'a mut Sink, above: AboveBand, steps: &WindowSteps) -> Self {
        Self {
            sink,
            power: PowerSum::new(steps.noise_block),
            above,
            sums: ResultSums::new(steps.half_length),
            recorded: SampleSums::default(),
            first: Vec::new(),
            faults: StreamedFaults::default(),
        }
    }

    fn take(&mut self, steps: &WindowSteps, job: &Job) -> Result<(), Failure> {
        let recorded = steps.recorded(&job.window);
        self.sink.take(&ResultPart {
            rows: steps.rows(&job.block, job.first),
            text: job.text.as_bytes(),
            torque: &job.torque,
            recorded,
        })?;
        if let Some(part) = &job.power {
            self.power.add(part);
        }
        if let Some(power) = job.above {
            let range = [job.first, job.first + job.torque.len()];
            self.above.take(power, range);
        }
        if let Some([result, recorded]) = &job.sums {
            self.sums.push(&job.torque, result);
            self.recorded.join(recorded);
        }
        self.faults.push(recorded);
        let missing = excerpt::OF_STREAM - self.first.len();
        self.first.extend(recorded.iter().take(missing));
        Ok(())
    }

    /// Adds the collected results to the report.
    fn tell(&self, steps: &WindowSteps, filter: &InverseFilter, report: &mut CompensateReport) {
        report.scale = steps.scale;
        report.start = steps.start;
        report.result = self.sums.statistics(steps.scale);
        if let Some(density) = self.density(steps.rate_hz) {
            let density = density.scaled(steps.scale * steps.scale);
            let rms = self.recorded.std().unwrap_or_default() * steps.scale.abs();
            report.noise.record = RecordNoise::of(filter, &density, rms);
        }
        report.warnings.extend(self.above.warning(report));
    }

    /// Power density of the record, if it is long enough.
    fn density(&self, rate_hz: f64) -> Option<Density> {
        if self.first.len() == excerpt::OF_STREAM {
            return self.power.density(rate_hz);
        }
        // The few blocks of the transforms leave gaps.
        let block = (self.first.len() / 2).next_power_of_two() / 2;
        welch_to_the_ends(
            &[&self.first],
            rate_hz,
            block.min(self.power.block_length()),
        )
        .ok()
    }
}

/// Joins the pieces to windows, in order.
struct Joiner {
    windows: Windows,
    resampler: Option<Resampler>,
    seconds_per_unit: f64,
    waiting: VecDeque<Job>,
    samples: usize,
    resampled: Option<Resampled>,
}

impl Joiner {
    fn new(grid: Option<&StampGrid>, rate_hz: f64, half_length: usize) -> Self {
        let grid = grid.filter(|grid| grid.resampled);
        let resampler =
            grid.map(|_| Resampler::new(1.0 / rate_hz).expect("a rate found in the stamps"));
        let seconds_per_unit = grid.map_or(1.0, |grid| grid.seconds_per_unit);
        Self {
            windows: Windows::new(half_length),
            resampler,
            seconds_per_unit,
            waiting: VecDeque::new(),
            samples: 0,
            resampled: None,
        }
    }

    /// Takes the next piece, `None` at the end, and passes on those with complete windows.
    fn join(
        &mut self,
        validator: &mut StreamValidator,
        job: Option<Job>,
        ready: &mut dyn FnMut(Job),
    ) -> Result<(), Failure> {
        let Some(mut job) = job else {
            self.finish(ready);
            return Ok(());
        };
        validator.accept(&mut job.block)?;
        if let Some((row, message)) = &job.unconverted {
            return Err(validator.failure_at_row(&job.block, *row, message));
        }
        self.push(job, ready)
    }

    fn push(&mut self, job: Job, ready: &mut dyn FnMut(Job)) -> Result<(), Failure> {
        let rows = &job.block.rows;
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

impl WindowSteps<'_> {
    /// Compensates a window and writes it as text.
    fn work(&self, convolver: &mut BlockConvolver, job: &mut Job) {
        let length = job.window.len() - 2 * self.half_length;
        job.torque.resize(length, 0.0);
        let power = job
            .power
            .get_or_insert_with(|| PowerSum::new(self.noise_block));
        power.clear();
        if self.noise_block == convolver.block_length() {
            // The forward transforms are available anyway.
            convolver.convolve(&job.window, &mut job.torque, Some(power));
        } else {
            convolver.convolve(&job.window, &mut job.torque, None);
            power.add_samples(&job.window[self.half_length..self.half_length + length]);
        }
        job.above = self.watched.and_then(|band| power_above(power, band));
        job.sums = Some([&job.torque[..], self.recorded(&job.window)].map(SampleSums::of));
        job.text.clear();
        if !self.is_text {
            return;
        }
        let rows = self.rows(&job.block, job.first);
        let recorded = match self.args.with_recorded {
            true => self.recorded(&job.window),
            false => &[],
        };
        rows.write(&mut job.text, &job.torque, recorded);
    }

    fn recorded<'a>(&self, window: &'a [f64]) -> &'a [f64] {
        &window[self.half_length..window.len() - self.half_length]
    }

    fn rows<'a>(&'a self, block: &'a Block, first: usize) -> ResultRows<'a> {
        let times = Times::of(block, self.grid, self.start, first);
        ResultRows {
            digits: self.args.digits,
            scale: self.scale,
            rate_hz: self.rate_hz,
            times,
        }
    }
}
