//! Fitting a structure to the training records, and its errors on any records.

use torqcomp_model::effects::Mode;
use torqcomp_model::fit::{self, Differences, FitError, Options, Parameter};
use torqcomp_model::simulate::{Model, State};

use super::record::{Nuisance, Record, Taken, dot};
use super::structure::Structure;

/// A structure with fitted values.
#[derive(Clone)]
pub struct Fitted<'a> {
    /// The structure.
    pub structure: Structure<'a>,
    /// Its parameters.
    pub values: Vec<f64>,
    /// Their standard uncertainties where the data determine them.
    pub std: Vec<Option<f64>>,
    /// Whether one of them ended at a bound.
    pub at_bound: Vec<bool>,
    /// Amplitudes of its lines, from the training records.
    pub amplitudes: Vec<f64>,
    /// Sum of squares over the training records.
    pub train_sum: f64,
    /// Motion at the start of each training record.
    pub starts: Vec<State>,
}

/// What a model leaves of a record.
#[derive(Clone)]
pub struct Residual {
    /// Measured less modelled, over the record's range.
    pub samples: Vec<f64>,
    /// What belonged to the record.
    pub taken: Taken,
    /// The model's record, over the range, without what belonged to the record.
    pub modelled: Vec<f64>,
}

/// Relative reduction of the sum of squares that counts as none.
const TOLERANCE: f64 = 1e-6;
/// Rounds in which the start of the motion is set right.
const START_ROUNDS: usize = 2;

/// Fits a structure from start values.
///
/// # Errors
/// If the model cannot be evaluated at the start.
pub fn fit<'a>(
    structure: Structure<'a>,
    start: &[f64],
    records: &[Record],
    reference: &Mode,
    most: usize,
) -> Result<Fitted<'a>, FitError> {
    let mut records = records.to_vec();
    let mut values = start.to_vec();
    let integrates = has_torque(&structure, start);
    let mut found = None;
    for round in 0..START_ROUNDS {
        let done = minimize(&structure, &values, &records, reference, most)?;
        values.clone_from(&done.values);
        let moved = integrates
            && round + 1 < START_ROUNDS
            && correct_starts(&structure, &values, &mut records, reference);
        found = Some(done);
        if !moved {
            break;
        }
    }
    let found = found.ok_or(FitError::NothingFree)?;
    Ok(complete(structure, found, &records, reference))
}

/// Fits a structure without setting the start of the motion right.
///
/// # Errors
/// As [`fit`].
pub fn look<'a>(
    structure: Structure<'a>,
    start: &[f64],
    records: &[Record],
    reference: &Mode,
    most: usize,
) -> Result<Fitted<'a>, FitError> {
    let found = minimize(&structure, start, records, reference, most)?;
    Ok(complete(structure, found, records, reference))
}

fn complete<'a>(
    structure: Structure<'a>,
    found: fit::Fit,
    records: &[Record],
    reference: &Mode,
) -> Fitted<'a> {
    Fitted {
        amplitudes: line_amplitudes(&structure, &found.values, records, reference),
        structure,
        std: found.std,
        at_bound: found.at_bound,
        train_sum: found.sum_of_squares,
        starts: records.iter().map(|r| r.start).collect(),
        values: found.values,
    }
}

fn has_torque(structure: &Structure, values: &[f64]) -> bool {
    let (model, _) = structure.model(values);
    model.has_torques()
}

fn minimize(
    structure: &Structure,
    start: &[f64],
    records: &[Record],
    reference: &Mode,
    most: usize,
) -> Result<fit::Fit, FitError> {
    // Without lines, what belongs to a record does not depend on the parameters.
    let fixed: Vec<Nuisance> = records.iter().map(|r| r.nuisance(reference, &[])).collect();
    let problem = |values: &[f64], out: &mut Vec<f64>| {
        let (model, lines_hz) = structure.model(values);
        for (record, fixed) in records.iter().zip(&fixed) {
            let mut residual = difference(&model, record)?;
            if lines_hz.is_empty() {
                fixed.clear(&mut residual);
            } else {
                record.nuisance(reference, &lines_hz).clear(&mut residual);
            }
            out.append(&mut residual);
        }
        Ok(())
    };
    let parameters: Vec<Parameter> = structure
        .bounds()
        .iter()
        .zip(start)
        .map(|(b, s)| {
            Parameter::new("", s.clamp(b.lower, b.upper))
                .at_least(b.lower)
                .at_most(b.upper)
                .scaled(s.abs().max(1e-4))
        })
        .collect();
    let options = Options {
        differences: Differences::Forward,
        tolerance: TOLERANCE,
        most_evaluations: most * (parameters.len() + 1),
        ..Options::default()
    };
    fit::minimize(&problem, &parameters, &options)
}

/// Measured less modelled over the range of a record.
pub(super) fn difference(model: &Model, record: &Record) -> Result<Vec<f64>, FitError> {
    let modelled = model.simulate(&record.input, record.start);
    let range = record.range.clone();
    let pairs = record.measured[range.clone()].iter().zip(&modelled[range]);
    let residual: Vec<f64> = pairs.map(|(y, x)| y - x).collect();
    if residual.last().is_none_or(|r| !r.is_finite()) {
        return Err(FitError::Model("the motion leaves all bounds".to_owned()));
    }
    Ok(residual)
}

/// Takes over what the residual says of the motion at the start of each record; whether any moved by an
/// amount that matters.
fn correct_starts(
    structure: &Structure,
    values: &[f64],
    records: &mut [Record],
    reference: &Mode,
) -> bool {
    let (model, lines_hz) = structure.model(values);
    let mut any = false;
    for record in records {
        let Ok(mut residual) = difference(&model, record) else {
            continue;
        };
        let before = dot(&residual, &residual) / residual.len() as f64;
        let taken = record.nuisance(reference, &lines_hz).fit(&mut residual);
        if let Some([x, speed]) = taken.motion {
            let moved = State {
                x: record.start.x + x,
                speed: record.start.speed + speed * reference.omega_rad_s,
            };
            any |= x.hypot(speed) > 0.05 * before.sqrt();
            record.start = moved;
        }
    }
    any
}

fn line_amplitudes(
    structure: &Structure,
    values: &[f64],
    records: &[Record],
    reference: &Mode,
) -> Vec<f64> {
    let (model, lines_hz) = structure.model(values);
    let mut sums = vec![0.0; lines_hz.len()];
    for record in records {
        let Ok(mut residual) = difference(&model, record) else {
            continue;
        };
        let taken = record.nuisance(reference, &lines_hz).fit(&mut residual);
        for (sum, [c, s]) in sums.iter_mut().zip(&taken.lines) {
            *sum += c.hypot(*s) / records.len() as f64;
        }
    }
    sums
}

impl Fitted<'_> {
    /// What the fitted model leaves of a record that it was not fitted to: the record's own constant, start and
    /// phases are estimated, nothing else.
    #[must_use]
    pub fn residual(&self, record: &Record, reference: &Mode) -> Option<Residual> {
        let (model, lines_hz) = self.structure.model(&self.values);
        let mut record = record.clone();
        let rounds = if model.has_torques() { START_ROUNDS } else { 1 };
        for round in 0..rounds {
            let mut samples = difference(&model, &record).ok()?;
            let modelled: Vec<f64> = record.measured[record.range.clone()]
                .iter()
                .zip(&samples)
                .map(|(y, r)| y - r)
                .collect();
            let nuisance = record.nuisance(reference, &lines_hz);
            let taken = nuisance.fit(&mut samples);
            if let Some([x, speed]) = taken.motion
                && round + 1 < rounds
            {
                record.start.x += x;
                record.start.speed += speed * reference.omega_rad_s;
                continue;
            }
            self.restore_amplitudes(&record, &lines_hz, &taken, &mut samples);
            return Some(Residual {
                samples,
                taken,
                modelled,
            });
        }
        None
    }

    /// The phase of a line belongs to the record, its amplitude does not: puts back what the record's own amplitude
    /// has taken too much or too little.
    fn restore_amplitudes(
        &self,
        record: &Record,
        lines_hz: &[f64],
        taken: &Taken,
        samples: &mut [f64],
    ) {
        let rate_hz = record.input.rate_hz();
        let lines = lines_hz.iter().zip(&taken.lines).zip(&self.amplitudes);
        for ((frequency_hz, [c, s]), amplitude) in lines {
            let own = c.hypot(*s);
            if own == 0.0 {
                continue;
            }
            let excess = 1.0 - amplitude / own;
            let turn = std::f64::consts::TAU * frequency_hz / rate_hz;
            for (sample, i) in samples.iter_mut().zip(record.range.clone()) {
                let (sine, cosine) = (turn * i as f64).sin_cos();
                *sample += excess * (c * cosine + s * sine);
            }
        }
    }
}
