//! Modes from a known input and a measured output.

mod blocks;
mod check;
mod inverse;
mod lines;
mod modal;
mod order;
mod scatter;
mod whole;
mod words;

use torqcomp_dsp::frf::{self, Estimator, Frf, Window};

use super::plain::Answer;
use super::{Found, Outcome, Quality};
use crate::failure::Failure;
use crate::print::{rounded, short};
use blocks::Set;
use lines::Lines;
pub use modal::{Data, Effort, Modal};
use scatter::{OfMode, Spread};

/// How the stand was excited.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Excitation {
    /// By hits.
    Impact,
    /// By noise.
    Random,
    /// By one signal again and again.
    Periodic,
}

/// A record of both channels.
#[derive(Debug, Clone, Copy)]
pub struct Driven<'a> {
    /// Name, for messages.
    pub name: &'a str,
    /// Samples a second.
    pub rate_hz: f64,
    /// What acted.
    pub applied: &'a [f64],
    /// What was measured.
    pub measured: &'a [f64],
}

/// How responses are evaluated.
#[derive(Debug, Clone, Copy, Default)]
pub struct Options {
    /// How the stand was excited, if it is known.
    pub excitation: Option<Excitation>,
    /// Frequencies to fit.
    pub band_hz: Option<(f64, f64)>,
    /// Number of modes, if it is known.
    pub modes: Option<usize>,
    /// Samples of a period.
    pub period: Option<usize>,
    /// Samples of a segment.
    pub segment: Option<usize>,
    /// Derivative of displacement that was measured: 0, 1 or 2.
    pub order: i32,
    /// Whether a delay is fitted.
    pub with_delay: bool,
}

/// A response that was evaluated, with what is needed to draw it.
#[derive(Debug, Clone)]
pub struct Evaluated {
    /// The numbers.
    pub outcome: Outcome,
    /// Frequencies of the lines in the band, in Hz.
    pub frequency_hz: Vec<f64>,
    /// H1 over all blocks; its lines are those of the band.
    pub h1: Frf,
    /// H2 and Hv at the same lines.
    pub others: [Vec<num_complex::Complex64>; 2],
    /// The model.
    pub modal: Modal,
    /// Error on data held out for 0, 1, 2, … modes.
    pub held_out: Vec<f64>,
    /// Covariance of σ (1/s) and ω (rad/s) of each mode, if the data tell it.
    pub spread: Vec<Option<[[f64; 2]; 2]>>,
    /// The mode with its residue, if there is a single one.
    pub single: Option<Answer>,
}

/// Evaluates records of one stand.
///
/// # Errors
/// If there is nothing usable in them.
pub fn identify(records: &[Driven], options: &Options) -> Result<Evaluated, Failure> {
    let mut outcome = Outcome::default();
    let set = blocks::blocks(records, options, &mut outcome)?;
    let lines = lines::band(&set, options)?;
    let leads = check::leads(&set, &lines, options.order);
    let data = lines::data(&set.powers, &set, &lines, options);
    // The transforms of whole records take about as long as the search for the number of modes.
    let (found, whole) = std::thread::scope(|scope| {
        let whole = scope.spawn(|| whole::Whole::of(records, &set, &data));
        let found = order::order(&set, &lines, options, &data);
        (found, whole.join().expect("a transform does not panic"))
    });
    let (coarse, held_out) = found.map_err(|failure| {
        if leads {
            Failure::failed(check::LEADS)
        } else {
            failure
        }
    })?;
    let Settled {
        modal: fitted,
        spread,
        of_mode,
        relative,
    } = settle(whole, &set, &lines, &data, &coarse, &mut outcome)?;
    if leads && check::is_out_of_reach(&set, &fitted) {
        return Err(Failure::failed(check::LEADS));
    }
    words::name_modes(&mut outcome, &fitted, &spread);
    let quality = Quality {
        rms: words::output_rms(&set, &lines) * relative,
        unit: String::new(),
        relative,
    };
    check::doubts(&mut outcome, quality.relative, leads, &fitted);
    outcome.quality = Some(quality);
    say_method(&mut outcome, &set, &lines, options, &fitted);
    let held = held_out.get(fitted.poles.len()).copied();
    say_others(&mut outcome, &set, options, &fitted, held);
    let h1 = set.powers.response(Estimator::H1);
    words::raw_error(&mut outcome, &set, &lines);
    words::levels(&mut outcome, &set, &lines);
    words::draw(&mut outcome, &h1, &lines, set.step_hz, &fitted, &held_out);
    let part = |estimator| set.powers.response(estimator).response[lines.clone()].to_vec();
    Ok(Evaluated {
        outcome,
        frequency_hz: lines.clone().map(|k| k as f64 * set.step_hz).collect(),
        others: [part(Estimator::H2), part(Estimator::Hv)],
        h1: Frf {
            response: h1.response[lines.clone()].to_vec(),
            coherence: h1.coherence[lines.clone()].to_vec(),
            applied_power: h1.applied_power[lines.clone()].to_vec(),
            blocks: h1.blocks,
        },
        single: answer(&fitted, of_mode),
        modal: fitted,
        held_out,
        spread,
    })
}

/// A single mode with its residue.
fn answer(modal: &Modal, of_mode: Option<OfMode>) -> Option<Answer> {
    let [pole] = modal.poles[..] else {
        return None;
    };
    let (residue, unit) = modal.residue(0);
    let as_fitted = Answer {
        rate_per_s: pole.rate_per_s,
        omega_rad_per_s: pole.omega_rad_per_s,
        residue: residue / unit,
        covariance: of_mode,
    };
    Some(as_fitted.scaled(unit))
}

/// Modes with what is known of them.
struct Settled {
    modal: Modal,
    spread: Spread,
    /// Covariance of σ, ω and the residue of a single mode.
    of_mode: Option<OfMode>,
    /// What is left of the measured signal, over its size.
    relative: f64,
}

/// The final numbers: where a window makes resonances wider, from the whole records without one.
fn settle(
    whole: Option<whole::Whole>,
    set: &Set,
    lines: &Lines,
    data: &Data,
    coarse: &Modal,
    outcome: &mut Outcome,
) -> Result<Settled, Failure> {
    if let Some(settled) = whole.and_then(|whole| whole.refine(data, coarse)) {
        outcome.method.push(
            "constants from the whole records without a window, what their ends do to the spectrum being part \
             of the model"
                .to_owned(),
        );
        return Ok(settled);
    }
    let averaged = data.fit(&coarse.poles, Effort::Fine)?;
    check::leakage(outcome, set, &averaged);
    let (spread, of_mode) = scatter::of_poles(set, lines, data, &averaged)?;
    Ok(Settled {
        relative: left_of_blocks(set, lines, &averaged),
        modal: averaged,
        spread,
        of_mode,
    })
}

/// What the model leaves of the measured signal, over all blocks.
fn left_of_blocks(set: &Set, lines: &Lines, fitted: &Modal) -> f64 {
    let error = |b| frf::prediction_error(&fitted.response, b, lines.clone());
    set.blocks.iter().map(error).sum::<f64>() / set.blocks.len() as f64
}

fn say_method(outcome: &mut Outcome, set: &Set, lines: &Lines, options: &Options, fitted: &Modal) {
    outcome.method.push(format!(
        "{} mode(s) through {} lines from {} to {} Hz, H1 over {} blocks, residual terms for modes \
         outside the band{}",
        fitted.poles.len(),
        lines.len(),
        short(lines.start as f64 * set.step_hz),
        short((lines.end - 1) as f64 * set.step_hz),
        set.blocks.len(),
        if options.with_delay { ", a delay" } else { "" }
    ));
}

/// Error on data held out, gain at rest and delay.
fn say_others(
    outcome: &mut Outcome,
    set: &Set,
    options: &Options,
    fitted: &Modal,
    held: Option<f64>,
) {
    if let Some(held) = held.filter(|h| h.is_finite()) {
        let with = match set.window {
            Window::Hann => ", with what the segments' ends spread",
            _ => "",
        };
        outcome.method.push(format!(
            "on data held out the model leaves {} % of the measured signal{with}",
            rounded(100.0 * held, 3)
        ));
        let percent = Found::new("held_out_error", 100.0 * held, None, "%");
        outcome.found.push(percent);
    }
    if options.order == 0 {
        let gain = Found::new("static_gain", fitted.at_rest(), None, "");
        outcome.found.push(gain);
    }
    if options.with_delay {
        let delay = Found::new("delay", fitted.delay_s, fitted.delay_std_s, "s");
        outcome.found.push(delay);
    }
}
