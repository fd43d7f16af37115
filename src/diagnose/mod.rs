//! Closing the loop: what the model leaves unexplained, the effect behind it, and the error before and after.

mod between;
mod blocks;
mod candidate;
mod columns;
mod dependence;
mod fit;
mod floor;
mod plain;
mod record;
mod refuse;
mod rivals;
mod search;
mod spectra;
mod starts;
mod steady;
mod structure;
mod verdict;
mod views;

use torqcomp_model::effects::Rulers;
use torqcomp_model::simulate::Between;

use crate::failure::Failure;
use verdict::{Missing, remains};

pub use candidate::{Base, Judged, Records, judge, set_substeps};
pub use dependence::{Dependence, Share, Sight};
pub use fit::{Fitted, Residual};
pub use floor::Floor;
pub use plain::Constants;
pub use record::{Begin, Record, dot};
pub use refuse::{apart, check};
pub use rivals::Rival;
pub use search::{Status, Tried};
pub use spectra::{Peak, lines};
pub use structure::{Choice, Frame, Structure};
pub use verdict::Verdict;
pub use views::{Against, Trace, autocorrelation, binned, density, response};

/// What is diagnosed.
pub struct Case {
    /// Records that are fitted.
    pub train: Vec<Record>,
    /// Records that are held out.
    pub hold: Vec<Record>,
    /// The constants that the stand file declares.
    pub declared: Option<Constants>,
    /// Whether the gain is part of the declaration, not of the fit.
    pub gain_is_declared: bool,
    /// The recorder as declared.
    pub recorder: Option<torqcomp_model::simulate::Fixed>,
    /// Threads to use.
    pub threads: usize,
}

/// What was found.
pub struct Diagnosis<'a> {
    /// The records; residuals are over the samples of each one's range.
    pub records: Records,
    /// The declared model.
    pub declared: Option<Judged<'a>>,
    /// The plain stand, fitted.
    pub before: Judged<'a>,
    /// The same with the accepted effects.
    pub after: Judged<'a>,
    /// The effects tried, the accepted one first; one list for each effect that was looked for.
    pub rounds: Vec<Vec<Tried<'a>>>,
    /// A law that is not among the effects and explains more than each of them, in the round that was the last.
    pub suspected: Option<Rival<'a>>,
    /// The noise.
    pub floor: Option<Floor>,
    /// What the residual before depends on.
    pub dependence_before: Dependence,
    /// What the residual after depends on.
    pub dependence: Dependence,
    /// Lines that stand out of the residual after.
    pub lines: Vec<Peak>,
    /// Whether the integration's own error stays below what is left.
    pub settled: bool,
    /// How it ended.
    pub verdict: Verdict,
}

/// Effects that are added at most.
const MOST_EFFECTS: usize = 2;

/// Rulers of the training records.
#[must_use]
pub fn rulers(train: &[Record]) -> Rulers {
    let (mut sum, mut count, mut peak) = (0.0, 0_usize, 0.0_f64);
    for record in train {
        let y = &record.measured[record.range.clone()];
        let mean = y.iter().sum::<f64>() / y.len() as f64;
        for y in y {
            sum += (y - mean).powi(2);
            peak = peak.max((y - mean).abs());
        }
        count += y.len();
    }
    let longest = train.iter().map(Record::count).max().unwrap_or(1);
    Rulers {
        rms: (sum / count.max(1) as f64).sqrt(),
        peak,
        natural_hz: 1.0,
        duration_s: longest as f64 / train.first().map_or(1.0, |r| r.input.rate_hz()),
    }
}

/// Fits the plain stand; sets the frame and the start of each record.
///
/// # Errors
/// If the plain stand cannot be fitted.
pub fn prepare(case: &mut Case) -> Result<(Frame, Constants), Failure> {
    let mut frame = Frame {
        rulers: rulers(&case.train),
        gain: case.declared.map_or(1.0, |d| d.gain),
        gain_is_free: !case.gain_is_declared,
        recorder: case.recorder.clone(),
    };
    let found = plain::fit_plain(&mut frame, case.declared, &case.train)?;
    Ok((frame, found))
}

/// Runs a diagnosis on prepared records.
///
/// # Errors
/// If the plain stand cannot be judged.
pub fn run<'a>(
    case: Case,
    frame: &'a Frame,
    found: Constants,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Diagnosis<'a>, Failure> {
    let records = Records {
        train: case.train,
        hold: case.hold,
        reference: found.mode(),
    };
    let look = Look {
        frame,
        found,
        declared: case.declared,
        threads: case.threads,
        progress,
    };
    let mut diagnosis = look.at(records.clone())?;
    if let Some(between) = diagnosis.other_course(case.threads) {
        diagnosis = look.at(records.with_between(between))?;
    }
    diagnosis.conclude();
    Ok(diagnosis)
}

/// What records are looked at with.
struct Look<'a, 'b> {
    frame: &'a Frame,
    /// Constants of the plain stand.
    found: Constants,
    declared: Option<Constants>,
    threads: usize,
    progress: &'b (dyn Fn(usize, usize) + Sync),
}

impl<'a> Look<'a, '_> {
    /// The plain stand and the effects that are added to it, without a verdict yet.
    fn at(&self, mut records: Records) -> Result<Diagnosis<'a>, Failure> {
        let plain = self.plain(&mut records)?;
        let cannot = || Failure::failed("the plain stand cannot be run on the held-out records");
        let declared = self
            .declared
            .and_then(|d| judge(as_declared(&plain, d), &records));
        let before = judge(plain, &records).ok_or_else(cannot)?;
        let dependence_before = dependence(&before, &records);
        let missing = Missing {
            before: &before,
            floor: first_floor(&before, &records),
        };
        let Found {
            after,
            rounds,
            suspected,
            rest,
            settled,
        } = Found::of(
            missing,
            &dependence_before,
            &mut records,
            self.threads,
            self.progress,
        );
        Ok(Diagnosis {
            floor: without_disturbances(missing.floor, &after, &records),
            lines: prominent_lines(&after, &records),
            records,
            declared,
            before,
            after,
            rounds,
            suspected,
            dependence_before,
            dependence: rest,
            settled,
            verdict: Verdict::NothingMissing,
        })
    }

    /// The plain stand, fitted; sets how the records begin.
    fn plain(&self, records: &mut Records) -> Result<Fitted<'a>, Failure> {
        let mut values = vec![1.0, self.found.damping_ratio];
        if self.frame.gain_is_free {
            values.push(1.0);
        }
        let structure = Structure {
            frame: self.frame,
            choices: Vec::new(),
        };
        let reference = records.reference;
        let plain = fit::fit(structure, &values, &records.train, &reference, 10)
            .map_err(Failure::failed)?;
        plain::set_starts(&plain, &mut records.train, &reference);
        plain::set_starts(&plain, &mut records.hold, &reference);
        Ok(Fitted {
            begins: records.train.iter().map(|r| r.begin).collect(),
            ..plain
        })
    }
}

/// The noise of the held-out records.
fn first_floor(before: &Judged, records: &Records) -> Option<Floor> {
    let pairs: Vec<(&Record, &[f64])> = records
        .hold
        .iter()
        .zip(&before.hold)
        .map(|(record, residual)| (record, residual.modelled.as_slice()))
        .collect();
    floor::noise_floor(&pairs)
}

/// What the search for effects has found.
struct Found<'a> {
    after: Judged<'a>,
    rounds: Vec<Vec<Tried<'a>>>,
    suspected: Option<Rival<'a>>,
    /// What the residual depends on.
    rest: Dependence,
    settled: bool,
}

impl<'a> Found<'a> {
    /// Adds one effect after another to the plain stand, as long as each explains enough to be named.
    fn of(
        missing: Missing<'a, '_>,
        rest: &Dependence,
        records: &mut Records,
        threads: usize,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Self {
        let mut found = Self {
            after: missing.before.clone(),
            rounds: Vec::new(),
            suspected: None,
            rest: rest.clone(),
            settled: true,
        };
        let coarse = records.substeps();
        for _ in 0..MOST_EFFECTS {
            let base = Base::of(found.after.clone(), records);
            let mut tried = search::try_all(&base, records, threads, progress);
            let accepted = tried.first().filter(|t| t.status == Status::Accepted);
            let next = accepted.and_then(|t| t.judged.clone());
            if next.is_some() || remains(&found.after, &found.rest, missing.floor) {
                found.suspected =
                    rivals::best(&base, next.as_ref(), missing.floor, records, threads);
            }
            let is_second = !found.after.fitted.structure.choices.is_empty();
            let is_little = |next: &Judged| is_second && missing.is_little(&found.after, next);
            if let Some(rival) = &found.suspected {
                verdict::stand_back(&mut tried, rival);
            } else if next.as_ref().is_some_and(is_little) {
                verdict::refuse_second(&mut tried);
            }
            let is_named = tried.iter().any(|t| t.status == Status::Accepted);
            found.rounds.push(tried);
            let Some(next) = next.filter(|_| is_named) else {
                break;
            };
            (found.after, found.settled) = candidate::refine_step(next, records, coarse);
            found.rest = dependence(&found.after, records);
            // Where little is explained, or so little is left that no second effect could be named, none is looked for; nor
            // beside a law that no step of the integration settles.
            if !found.settled
                || !remains(&found.after, &found.rest, missing.floor)
                || !missing.has_room(&found.after)
            {
                break;
            }
        }
        found
    }
}

/// The floor, where the model found takes something out that does not repeat with the input.
fn without_disturbances(floor: Option<Floor>, after: &Judged, records: &Records) -> Option<Floor> {
    let Some(seen) = floor.filter(|f| f.from == "periods") else {
        return floor;
    };
    let residuals: Vec<(&Record, &[f64])> = records
        .hold
        .iter()
        .zip(&after.hold)
        .map(|(record, residual)| (record, residual.samples.as_slice()))
        .collect();
    let again = floor::from_residuals(&residuals);
    Some(again.filter(|f| f.rms < seen.rms).unwrap_or(seen))
}

/// The declared constants in place of the fitted ones.
fn as_declared<'a>(plain: &Fitted<'a>, declared: Constants) -> Fitted<'a> {
    let frame = plain.structure.frame;
    let mut values = vec![
        declared.natural_hz / frame.rulers.natural_hz,
        declared.damping_ratio,
    ];
    if frame.gain_is_free {
        values.push(declared.gain / frame.gain);
    }
    Fitted {
        values,
        ..plain.clone()
    }
}

fn dependence(judged: &Judged, records: &Records) -> Dependence {
    let sights: Vec<Sight> = records
        .hold
        .iter()
        .zip(&judged.hold)
        .map(|(record, residual)| Sight {
            residual: &residual.samples,
            input: &record.input.samples()[record.range.clone()],
            modelled: &residual.modelled,
        })
        .collect();
    let fitted = &judged.fitted;
    let (mode, _) = fitted.structure.mode(&fitted.values);
    Dependence::of(&sights, &mode, records.hold[0].input.rate_hz())
}

fn prominent_lines(judged: &Judged, records: &Records) -> Vec<Peak> {
    let rate_hz = records.train[0].input.rate_hz();
    let residuals: Vec<(&[f64], f64)> = judged
        .hold
        .iter()
        .map(|r| (r.samples.as_slice(), rate_hz))
        .collect();
    let longest = records.hold.iter().map(Record::count).max().unwrap_or(1);
    let mut found = lines(
        &residuals,
        3.0 * rate_hz / longest as f64,
        0.49 * rate_hz,
        5,
    );
    found.retain(|p| p.prominence > 30.0);
    found
}

impl Diagnosis<'_> {
    /// A course of the input between its samples that explains what is missing better than what was found.
    fn other_course(&self, threads: usize) -> Option<Between> {
        if self.effects().is_empty() && !remains(&self.before, &self.dependence_before, self.floor)
        {
            return None;
        }
        let added = self.rounds.iter().filter_map(|tried| {
            let first = tried.first().filter(|t| t.status == Status::Accepted)?;
            first.judged.as_ref()
        });
        let mut models = vec![&self.before];
        // Where nothing is left, only one course in place of all effects could say more.
        if remains(&self.after, &self.dependence, self.floor) {
            models.extend(added);
        }
        between::better(&models, &self.after, self.floor, &self.records, threads)
    }

    /// The effects that were added.
    #[must_use]
    pub fn effects(&self) -> Vec<&'static str> {
        self.after
            .fitted
            .structure
            .choices
            .iter()
            .map(|c| c.effect.name)
            .collect()
    }
}
