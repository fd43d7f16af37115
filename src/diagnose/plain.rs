//! The plain stand, fitted as well as it can be: so that a wrong constant is never sold as an effect.

use torqcomp_model::effects::Mode;
use torqcomp_model::simulate::{Model, State};

use super::fit::{Fitted, fit};
use super::record::{Record, dot};
use super::structure::{Frame, Structure};
use crate::failure::Failure;

/// Natural frequencies tried where nothing is declared, as many to a decade.
const PER_DECADE: f64 = 24.0;
/// Damping ratios tried.
const DAMPING: [f64; 4] = [0.01, 0.05, 0.2, 0.7];
/// Factors of the declared frequency that are tried.
const NEAR: [f64; 9] = [0.5, 0.7, 0.8, 0.9, 1.0, 1.1, 1.25, 1.4, 2.0];
/// Starts that are fitted in full.
const FULL: usize = 3;
/// Rounds of a fit.
const MOST_ROUNDS: usize = 60;

/// A start of the fit: natural frequency in Hz, damping ratio, gain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Constants {
    /// Natural frequency.
    pub natural_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Recorded per applied quantity at rest.
    pub gain: f64,
}

impl Constants {
    /// The mode.
    #[must_use]
    pub fn mode(&self) -> Mode {
        Mode {
            omega_rad_s: std::f64::consts::TAU * self.natural_hz,
            damping_ratio: self.damping_ratio,
        }
    }
}

/// Fits the plain stand; the frame's gain and natural frequency are set to what is found.
///
/// # Errors
/// If no start leads to a fit.
pub fn fit_plain(
    frame: &mut Frame,
    declared: Option<Constants>,
    records: &[Record],
) -> Result<Constants, Failure> {
    let mut starts = scan(frame, declared, records);
    starts.truncate(FULL);
    let mut best: Option<(f64, Constants)> = None;
    for (_, start) in starts {
        let mut own = frame.clone();
        own.rulers.natural_hz = start.natural_hz;
        own.gain = start.gain;
        let structure = Structure {
            frame: &own,
            choices: Vec::new(),
        };
        let mut values = vec![1.0, start.damping_ratio];
        if own.gain_is_free {
            values.push(1.0);
        }
        let Ok(fitted) = fit(structure, &values, records, &start.mode(), MOST_ROUNDS) else {
            continue;
        };
        let (mode, gain) = fitted.structure.mode(&fitted.values);
        let found = Constants {
            natural_hz: mode.omega_rad_s / std::f64::consts::TAU,
            damping_ratio: mode.damping_ratio,
            gain,
        };
        if best.is_none_or(|(sum, _)| fitted.train_sum < sum) {
            best = Some((fitted.train_sum, found));
        }
    }
    let (_, found) = best.ok_or_else(|| {
        Failure::failed("the plain stand could not be fitted to the training records")
    })?;
    frame.rulers.natural_hz = found.natural_hz;
    frame.gain = found.gain;
    Ok(found)
}

/// Sum of squares for each start on a coarse grid, the least first.
fn scan(frame: &Frame, declared: Option<Constants>, records: &[Record]) -> Vec<(f64, Constants)> {
    let record = &records[0];
    let rate_hz = record.input.rate_hz();
    let frequencies: Vec<f64> = match declared {
        Some(constants) => NEAR.iter().map(|n| n * constants.natural_hz).collect(),
        None => {
            let lowest = 2.0 * rate_hz / record.count() as f64;
            let count = ((0.45 * rate_hz / lowest).log10() * PER_DECADE).ceil() as i32;
            (0..=count)
                .map(|k| lowest * 10_f64.powf(f64::from(k) / PER_DECADE))
                .collect()
        }
    };
    let mut damping = DAMPING.to_vec();
    damping.extend(declared.map(|d| d.damping_ratio.max(1e-4)));
    let mut found = Vec::new();
    for natural_hz in frequencies {
        for damping_ratio in &damping {
            let mut start = Constants {
                natural_hz,
                damping_ratio: *damping_ratio,
                gain: frame.gain,
            };
            if let Some(sum) = try_start(frame, &mut start, record) {
                found.push((sum, start));
            }
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found
}

/// Sum of squares of a start; its gain is set to the best one, if it is free.
fn try_start(frame: &Frame, start: &mut Constants, record: &Record) -> Option<f64> {
    let gain = if frame.gain_is_free { 1.0 } else { start.gain };
    let model = Model {
        mode: start.mode(),
        gain,
        recorder: frame.recorder.clone(),
        shift: 0.0,
        actions: Vec::new(),
    };
    let modelled = model.simulate(&record.input, State::default());
    let centred = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        values.iter().map(|v| v - mean).collect::<Vec<f64>>()
    };
    let x = centred(&modelled[record.range.clone()]);
    let y = centred(&record.measured[record.range.clone()]);
    let (xx, xy, yy) = (dot(&x, &x), dot(&x, &y), dot(&y, &y));
    if !(xx > 0.0 && xx.is_finite()) {
        return None;
    }
    if frame.gain_is_free {
        start.gain = xy / xx;
        return (start.gain != 0.0).then(|| yy - xy * xy / xx);
    }
    Some(yy - 2.0 * xy + xx)
}

/// Sets the motion at the start of each record to what the plain stand makes of it.
pub fn set_starts(plain: &Fitted, records: &mut [Record], reference: &Mode) {
    let (model, _) = plain.structure.model(&plain.values);
    for record in records {
        let Some(found) = plain.residual(record, reference) else {
            continue;
        };
        let [x, speed] = model.state_at_start(&record.input);
        let [dx, dspeed] = found.taken.motion.unwrap_or_default();
        record.begin.start = State {
            x: x + dx,
            speed: speed + dspeed * reference.omega_rad_s,
        };
    }
}
