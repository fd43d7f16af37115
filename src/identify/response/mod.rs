//! Modal identification from a known input and a measured output.

mod blocks;
mod check;
mod determined;
mod force;
mod foreign;
mod inverse;
mod kind;
mod late;
mod line_noise;
mod lines;
mod modal;
mod next;
mod order;
mod present;
mod scatter;
mod shares;
mod shift;
mod whole;

use clap::ValueEnum;
use num_complex::Complex64;
use torqcomp_dsp::recorder::Recorder;
use torqcomp_model::Covariance;

use super::mode::all_or_none;
use super::{Identification, ModalPole};
use crate::failure::{ErrorCode, Failure};
use crate::warning::WarningCode;
use blocks::Set;
pub use modal::Lag;
use modal::{Data, Effort, Modal};
pub(crate) use present::RATIO;

/// How a stand was excited.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Excitation {
    /// Hammer hits, one or several per record
    Impact,
    /// Any other transient, one per record: a step, a drop, a shock table
    Transient,
    /// Noise
    Random,
    /// A periodic signal
    Periodic,
}

/// A record of both channels.
#[derive(Debug, Clone, Copy)]
pub struct Driven<'a> {
    /// Name, for messages.
    pub name: &'a str,
    /// Sampling rate.
    pub rate_hz: f64,
    /// Applied force or torque.
    pub applied: &'a [f64],
    /// Measured response.
    pub measured: &'a [f64],
}

/// Options for the evaluation of responses.
#[derive(Debug, Clone, Copy, Default)]
pub struct ResponseOptions {
    /// Type of excitation, if known.
    pub excitation: Option<Excitation>,
    /// Frequency range of the fit.
    pub band_hz: Option<(f64, f64)>,
    /// Number of modes, if known.
    pub modes: Option<usize>,
    /// Period in samples, if known.
    pub period: Option<usize>,
    /// Segment length in samples; chosen from the length of the records if not given.
    pub segment: Option<usize>,
    /// Order of the measured derivative of displacement: 0, 1 or 2.
    pub order: i32,
    /// The lag of the measured channel that is fitted, if any.
    pub lag: Option<Lag>,
    /// The recorder of the measured channel, if it is declared and has a low-pass or a delay.
    pub recorder: Option<Recorder>,
    /// Whether several modes are those of a stand on its spring, without free motion below them.
    pub grounded: bool,
}

impl ResponseOptions {
    /// The same with the lag of a model, if it has one.
    fn with_lag_of(&self, modal: Option<&Modal>) -> Self {
        let found = modal.filter(|modal| modal.delay_s != 0.0);
        Self {
            lag: found.map(|modal| modal.lag).or(self.lag),
            ..*self
        }
    }
}

/// Evaluates records of one stand.
///
/// # Errors
/// If the records show no response.
pub fn identify(records: &[Driven], options: &ResponseOptions) -> Result<Identification, Failure> {
    let Some(recorder) = options.recorder else {
        return behind(records, options);
    };
    let without = ResponseOptions {
        recorder: None,
        ..*options
    };
    late::behind_recorder(
        behind(records, options),
        behind(records, &without),
        recorder.delay_s(),
    )
}

/// Evaluates records behind a recorder, if one is given.
fn behind(records: &[Driven], options: &ResponseOptions) -> Result<Identification, Failure> {
    let cut = |records: &[Driven]| {
        let mut result = Identification::new("response");
        let set = blocks::blocks(records, options, &mut result)?;
        Ok((result, lines::in_band(set, options)?))
    };
    let (result, set) = cut(records)?;
    let lag = late::lag(&set);
    let as_recorded = evaluate(records, options, set, result);
    if lag == 0 {
        return as_recorded;
    }
    let aligned = late::aligned(records, lag);
    let with_rest = ResponseOptions {
        lag: Some(Lag::Delay),
        ..*options
    };
    let found = cut(&aligned).and_then(|(result, set)| evaluate(&aligned, &with_rest, set, result));
    late::better(as_recorded, found, lag as f64 / records[0].rate_hz)
}

/// Evaluates the blocks and lines of records.
fn evaluate(
    records: &[Driven],
    options: &ResponseOptions,
    set: Set,
    mut result: Identification,
) -> Result<Identification, Failure> {
    let leads = check::leads(&set, options.order);
    let data = lines::data(&set.powers, &set, options);
    // The transforms of whole records take about as long as the search for the number of modes.
    let (found, whole) = std::thread::scope(|scope| {
        let whole = scope.spawn(|| whole::Whole::of(records, &set, &data));
        let found = order::order(&set, options, &data, &result.warnings);
        (found, whole.join().expect("a transform does not panic"))
    });
    let (coarse, held_out) = found.map_err(|failure| match leads {
        true => ErrorCode::UnsuitableRecord.failed(check::LEADS),
        false => failure,
    })?;
    let asked = options.lag;
    let late = shift::of(&set, options, (&data, &coarse))?;
    let options = &options.with_lag_of(late.as_ref());
    let coarse = late.unwrap_or(coarse);
    let is_grounded = options.grounded && coarse.poles.len() > 1;
    let data = Data {
        lag: options.lag,
        below: !is_grounded,
        ..data
    };
    let kinds = (leads, is_grounded, options.band_hz.is_some());
    let coarse = determined::determined((&set, &data), coarse, kinds, &mut result)?;
    let fitted = final_fit(whole, &set, options, (&data, &coarse), &mut result)?;
    let is_poor = fitted.relative.is_nan() || fitted.relative >= check::POOR;
    if order::is_unexplained(&held_out) && is_poor {
        return Err(order::unexplained());
    }
    let options = &options.with_lag_of(Some(&fitted.modal));
    shift::warn(&mut result, &fitted.modal, asked);
    if leads && check::is_out_of_reach(&set, &fitted.modal) {
        return Err(ErrorCode::UnsuitableRecord.failed(check::LEADS));
    }
    determined::must_reach((&set, &data), &fitted, options.band_hz.is_some())?;
    foreign::warn(&mut result, &fitted.modal, is_grounded)?;
    foreign::tell_overtones(&mut result, &fitted.modal);
    present::add_modes(&mut result, &fitted);
    if is_grounded && result.modes.len() > 1 {
        result.shares = shares::of(&fitted, options.order);
        present::add_shares(&mut result);
    }
    check::doubts(&mut result, &fitted, leads);
    result.fit = Some(present::quality(&set, &fitted));
    result.held_out_errors = match fitted.modal.delay_s == 0.0 || asked == Some(fitted.modal.lag) {
        true => held_out,
        false => order::of_given(&set, options, &fitted.modal)?,
    };
    present::method(&mut result, &set, options, &fitted.modal);
    present::other_constants(&mut result, &set, options, &fitted);
    present::spectra(&mut result, &set, &fitted.modal);
    Ok(result)
}

/// The final model with its uncertainties.
struct FinalFit {
    modal: Modal,
    /// Covariance of σ and ω of each mode, the delay, and then the linear parameters, as far as they are
    /// known.
    covariance: Covariance,
    /// Index of the first linear parameter in the covariance.
    linear: usize,
    /// Whether the covariance has the residues of all modes.
    has_residues: bool,
    /// Residual relative to the measured signal.
    relative: f64,
    /// Largest relative error of the gain due to noise in the applied signal.
    gain_error: f64,
    /// Bayesian information criterion of a fit to whole records, for comparison with others; otherwise infinite.
    criterion: f64,
    /// Response in the residual of whole records at the lines of the averaged response; otherwise empty.
    residual: Vec<Complex64>,
    /// Standard uncertainty of the static response.
    static_gain_std: Option<f64>,
}

/// Standard uncertainty of the static response from the covariance of poles, delay and, from `linear` on, all
/// linear parameters.
fn static_gain_std(modal: &Modal, covariance: &Covariance, linear: usize) -> Option<f64> {
    let (of_poles, of_linear) = modal.slopes_at_rest();
    let mut slopes = vec![0.0; linear + of_linear.len()];
    slopes[..of_poles.len()].copy_from_slice(&of_poles);
    slopes[linear..].copy_from_slice(&of_linear);
    covariance.std_of(&slopes).filter(|std| *std > 0.0)
}

impl FinalFit {
    /// A mode, with its residue if it is the only one.
    fn mode(&self, k: usize) -> ModalPole {
        let pole = self.modal.poles[k];
        let select = |places: &[usize]| all_or_none(self.covariance.select(places), places.len());
        if self.modal.of_stand().len() > 1 || !self.has_residues {
            return ModalPole::new(pole, select(&[2 * k, 2 * k + 1]));
        }
        let (residue, unit) = self.modal.residue(k);
        let covariance = select(&[
            2 * k,
            2 * k + 1,
            self.linear + 2 * k,
            self.linear + 2 * k + 1,
        ]);
        ModalPole::with_residue(pole, residue / unit, covariance).scaled(unit)
    }
}

const ONE_HIT: &str = "a single hit does not show the error of its force (noise and aliasing), which dominates the \
    uncertainties: those of frequency and damping are upper limits, that of the static gain may be too small; take \
    several hits";

/// The final fit: to whole records without a window if the window causes leakage, otherwise to the averaged
/// response.
fn final_fit(
    mut whole: Option<whole::Whole>,
    set: &Set,
    options: &ResponseOptions,
    (data, coarse): (&Data, &Modal),
    result: &mut Identification,
) -> Result<FinalFit, Failure> {
    let refined = match &mut whole {
        Some(whole) => {
            order::of_whole(whole, set, options, (data, coarse))?.map(|fitted| (whole, fitted))
        }
        None => None,
    };
    if let Some((whole, fitted)) = refined {
        result.method.push(
            "constants fitted to the whole records without a window; the transients of their ends are part of the model"
                .to_owned(),
        );
        let late = shift::of_whole(whole, set, options, (data, &fitted))?;
        return shift::filtered_whole(whole, set, data, late.unwrap_or(fitted));
    }
    let (data, mut modal) = shift::filtered(set, data, coarse)?;
    let data = &data;
    check::leakage(result, set, &modal);
    let searched = modal.fit.as_ref().map_or(0, |fit| fit.values.len());
    if scatter::is_of_force(set, data, &modal) {
        result.warn(WarningCode::OneHit.warning(ONE_HIT));
    }
    let all = scatter::of_all(set, data, &modal)?;
    let of_poles = scatter::of_poles(set, data, &modal)?;
    if data.lag.is_some() {
        modal.delay_std_s = of_poles.std(2 * modal.poles.len());
    }
    foreign::mark(&mut modal, &of_poles, set);
    let is_alone = modal.of_stand().len() == 1 && modal.poles.len() > 1;
    let static_gain_std = |all: &Covariance| static_gain_std(&modal, all, searched);
    let static_gain_std = all.as_ref().and_then(static_gain_std);
    let all = all.filter(|_| !data.below || is_alone);
    Ok(FinalFit {
        static_gain_std,
        has_residues: all.is_some() || modal.poles.len() == 1,
        covariance: all.unwrap_or(of_poles),
        linear: searched,
        relative: set.error(&modal.response),
        gain_error: 0.0,
        criterion: f64::INFINITY,
        residual: Vec::new(),
        modal,
    })
}
