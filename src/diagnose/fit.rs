//! Fitting a structure to the training records, and its errors on any records.

use torqcomp_model::effects::Mode;
use torqcomp_model::fit::{self, Differences, FitError, Options, Parameter};
use torqcomp_model::simulate::Model;

use super::record::{Begin, Nuisance, Record, Taken, dot};
use super::structure::{Structure, Waves};

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
    /// Whether the fit came to its end.
    pub converged: bool,
    /// Amplitudes of its lines, from the training records.
    pub amplitudes: Vec<f64>,
    /// Sum of squares over the training records.
    pub train_sum: f64,
    /// How each training record begins.
    pub begins: Vec<Begin>,
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
    /// How the record begins.
    pub begin: Begin,
}

/// Relative reduction of the sum of squares that counts as none.
const TOLERANCE: f64 = 1e-6;
/// Rounds in which the beginning of a held-out record is set right.
const BEGIN_ROUNDS: usize = 3;
/// Largest displacement by a constant load, over the rms of the record.
const LARGEST_SHIFT: f64 = 0.5;
/// Step of the displacement by a constant load, for differences.
const SHIFT_STEP: f64 = 1e-4;

/// Fits a structure from start values; the records' own beginnings are refined with it.
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
    let mut found = minimize(&structure, start, &mut records, reference, most)?;
    if structure.model(start).0.has_torques()
        && correct_starts(&structure, &found.values, &mut records, reference)
    {
        let values = structure.own(&found.values).to_vec();
        found = minimize(&structure, &values, &mut records, reference, most)?;
    }
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
    let mut records = records.to_vec();
    let found = minimize(&structure, start, &mut records, reference, most)?;
    Ok(complete(structure, found, &records, reference))
}

fn complete<'a>(
    structure: Structure<'a>,
    found: fit::Fit,
    records: &[Record],
    reference: &Mode,
) -> Fitted<'a> {
    let count = structure.bounds().len();
    let mut values = found.values;
    values.truncate(count);
    Fitted {
        amplitudes: line_amplitudes(&structure, &values, records, reference),
        structure,
        std: found.std[..count].to_vec(),
        at_bound: found.at_bound[..count].to_vec(),
        train_sum: found.sum_of_squares,
        converged: found.stop.converged(),
        begins: records.iter().map(|r| r.begin).collect(),
        values,
    }
}

fn minimize(
    structure: &Structure,
    start: &[f64],
    records: &mut [Record],
    reference: &Mode,
    most: usize,
) -> Result<fit::Fit, FitError> {
    let size = structure.frame.rulers.rms;
    let own = structure.bounds().len();
    let shifted = structure.model(start).0.has_zero();
    let parameters = parameters(structure, start, records, shifted);
    let found = {
        let records = &*records;
        // Without lines, what belongs to a record does not depend on the parameters.
        let fixed: Vec<Nuisance> = records
            .iter()
            .map(|r| r.nuisance(reference, &Waves::NONE, None))
            .collect();
        let problem = |values: &[f64], out: &mut Vec<f64>| {
            let (mut model, waves) = structure.model(&values[..own]);
            for (k, (record, fixed)) in records.iter().zip(&fixed).enumerate() {
                model.shift = values.get(own + k).map_or(record.begin.shift, |s| s * size);
                let mut residual = difference(&model, record)?;
                if waves.is_empty() {
                    fixed.clear(&mut residual);
                } else {
                    record
                        .nuisance(reference, &waves, None)
                        .clear(&mut residual);
                }
                out.append(&mut residual);
            }
            Ok(())
        };
        let options = Options {
            differences: Differences::Forward,
            tolerance: TOLERANCE,
            most_evaluations: most * (parameters.len() + 1),
            ..Options::default()
        };
        fit::minimize(&problem, &parameters, &options)?
    };
    for (k, record) in records.iter_mut().enumerate().filter(|_| shifted) {
        record.begin.shift = found.values[own + k] * size;
    }
    Ok(found)
}

/// The structure's parameters, and the displacement by a constant load of each record where it matters.
fn parameters(
    structure: &Structure,
    start: &[f64],
    records: &[Record],
    shifted: bool,
) -> Vec<Parameter> {
    let bounds = structure.bounds();
    let own = bounds.iter().zip(start).map(|(b, s)| {
        Parameter::new("", s.clamp(b.lower, b.upper))
            .at_least(b.lower)
            .at_most(b.upper)
            .scaled(s.abs().max(1e-4))
    });
    let size = structure.frame.rulers.rms;
    let shifts = records.iter().filter(|_| shifted).map(|r| {
        let start = (r.begin.shift / size).clamp(-LARGEST_SHIFT, LARGEST_SHIFT);
        Parameter::new("", start)
            .at_least(-LARGEST_SHIFT)
            .at_most(LARGEST_SHIFT)
            .scaled(0.1)
    });
    own.chain(shifts).collect()
}

/// Measured less modelled over the range of a record.
pub(super) fn difference(model: &Model, record: &Record) -> Result<Vec<f64>, FitError> {
    let modelled = model.simulate(&record.input, record.begin.start);
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
    let (mut model, waves) = structure.model(structure.own(values));
    let mut any = false;
    for record in records {
        model.shift = record.begin.shift;
        let Ok(mut residual) = difference(&model, record) else {
            continue;
        };
        let before = dot(&residual, &residual) / residual.len() as f64;
        let taken = record.nuisance(reference, &waves, None).fit(&mut residual);
        if let Some([x, speed]) = taken.motion {
            record.begin.start.x += x;
            record.begin.start.speed += speed * reference.omega_rad_s;
            any |= x.hypot(speed) > 0.05 * before.sqrt();
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
    let (mut model, waves) = structure.model(values);
    let mut sums = vec![0.0; waves.lines_hz.len()];
    if sums.is_empty() {
        return sums;
    }
    for record in records {
        model.shift = record.begin.shift;
        let Ok(mut residual) = difference(&model, record) else {
            continue;
        };
        let taken = record.nuisance(reference, &waves, None).fit(&mut residual);
        for (sum, [c, s]) in sums.iter_mut().zip(&taken.lines) {
            *sum += c.hypot(*s) / records.len() as f64;
        }
    }
    sums
}

impl Fitted<'_> {
    /// Whether its motion is integrated in time.
    #[must_use]
    pub fn integrates(&self) -> bool {
        self.structure.model(&self.values).0.has_torques()
    }

    /// What the fitted model leaves of a record that it was not fitted to: the record's own constants, start and
    /// phases are estimated, nothing else.
    #[must_use]
    pub fn residual(&self, record: &Record, reference: &Mode) -> Option<Residual> {
        let (mut model, waves) = self.structure.model(&self.values);
        let mut record = record.clone();
        let rounds = if model.has_torques() { BEGIN_ROUNDS } else { 1 };
        let step = SHIFT_STEP * self.structure.frame.rulers.rms;
        for round in 1..=rounds {
            model.shift = record.begin.shift;
            let mut samples = difference(&model, &record).ok()?;
            let column = if model.has_zero() {
                model.shift += step;
                let there = difference(&model, &record).ok()?;
                Some(
                    samples
                        .iter()
                        .zip(&there)
                        .map(|(a, b)| (a - b) / step)
                        .collect(),
                )
            } else {
                None
            };
            let measured = &record.measured[record.range.clone()];
            let modelled: Vec<f64> = measured.iter().zip(&samples).map(|(y, r)| y - r).collect();
            let taken = record.nuisance(reference, &waves, column).fit(&mut samples);
            if round == rounds {
                self.restore_amplitudes(&record, &waves, &taken, &mut samples);
                let begin = record.begin;
                return Some(Residual {
                    samples,
                    taken,
                    modelled,
                    begin,
                });
            }
            let limit = LARGEST_SHIFT * self.structure.frame.rulers.rms;
            let [x, speed] = taken.motion.unwrap_or_default();
            record.begin.start.x += x;
            record.begin.start.speed += speed * reference.omega_rad_s;
            record.begin.shift =
                (record.begin.shift + taken.shift.unwrap_or(0.0)).clamp(-limit, limit);
        }
        None
    }

    /// The phase of a line belongs to the record, its amplitude does not: puts back what the record's own amplitude
    /// has taken too much or too little.
    fn restore_amplitudes(
        &self,
        record: &Record,
        waves: &Waves,
        taken: &Taken,
        samples: &mut [f64],
    ) {
        let rate_hz = record.input.rate_hz();
        let lines = waves
            .lines_hz
            .iter()
            .zip(&taken.lines)
            .zip(&self.amplitudes);
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
