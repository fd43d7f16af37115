//! Closing the loop: what the model leaves unexplained, the effect behind it, and the error before and after.

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
mod views;

use torqcomp_model::effects::Rulers;

use crate::failure::Failure;

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
pub use views::{Against, Trace, autocorrelation, binned, density, response};

/// How the search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// What was missing is found, nothing above the noise remains.
    Explained,
    /// An effect helps, and something above the noise remains.
    PartlyExplained,
    /// Something is missing, and no effect of the list explains it.
    Unexplained,
    /// The plain stand explains the records.
    NothingMissing,
}

impl Verdict {
    /// Its name in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Explained => "explained",
            Self::PartlyExplained => "partly-explained",
            Self::Unexplained => "unexplained",
            Self::NothingMissing => "nothing-missing",
        }
    }
}

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

/// Error over the noise floor up to which nothing needs to be missing.
const AT_FLOOR: f64 = 1.1;
/// Error over a floor from out of band above which no colour of the noise accounts for it.
const FAR_ABOVE: f64 = 1.5;
/// Part of what is missing that an effect must explain to be named.
const NAMED: f64 = 0.5;
/// Error over a noise floor that was seen, from which on that part is known well enough to ask for it.
const CLEARLY_ABOVE: f64 = 1.05;
/// Part of what is missing at first that a second effect must explain to be named.
const SECOND: f64 = 0.02;
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
    let reference = found.mode();
    let threads = case.threads;
    let declared = case.declared;
    let mut records = Records {
        train: case.train,
        hold: case.hold,
        reference,
    };
    let mut values = vec![1.0, found.damping_ratio];
    if frame.gain_is_free {
        values.push(1.0);
    }
    let structure = Structure {
        frame,
        choices: Vec::new(),
    };
    let cannot = || Failure::failed("the plain stand cannot be run on the held-out records");
    let plain =
        fit::fit(structure, &values, &records.train, &reference, 10).map_err(Failure::failed)?;
    plain::set_starts(&plain, &mut records.train, &reference);
    plain::set_starts(&plain, &mut records.hold, &reference);
    let plain = Fitted {
        begins: records.train.iter().map(|r| r.begin).collect(),
        ..plain
    };
    let declared = declared.and_then(|d| judge(as_declared(&plain, d), &records));
    let before = judge(plain, &records).ok_or_else(cannot)?;
    let dependence_before = dependence(&before, &records);
    let pairs: Vec<(&Record, &[f64])> = records
        .hold
        .iter()
        .zip(&before.hold)
        .map(|(record, residual)| (record, residual.modelled.as_slice()))
        .collect();
    let floor = floor::noise_floor(&pairs);

    let mut after = before.clone();
    let mut rounds = Vec::new();
    let coarse = records.substeps();
    let mut settled = true;
    let mut suspected = None;
    let mut rest = dependence_before.clone();
    for _ in 0..MOST_EFFECTS {
        let base = Base::of(after.clone(), &records);
        let tried = search::try_all(&base, &records, threads, progress);
        let accepted = tried.first().filter(|t| t.status == Status::Accepted);
        let next = accepted.and_then(|t| t.judged.clone());
        rounds.push(tried);
        if next.is_some() || remains(&after, &rest, floor) {
            suspected = rivals::best(&base, next.as_ref(), floor, &records, threads);
        }
        if let Some(rival) = &suspected {
            stand_back(&mut rounds, rival);
            break;
        }
        let Some(next) = next else { break };
        if !after.fitted.structure.choices.is_empty()
            && share(&before, &after, &next, floor) < SECOND
        {
            refuse_second(&mut rounds);
            break;
        }
        (after, settled) = candidate::refine_step(next, &mut records, coarse);
        rest = dependence(&after, &records);
        // Where little is explained, or so little is left that no second effect could be named, none is looked for; nor
        // beside a law that no step of the integration settles.
        let explained = share(&before, &before, &after, floor);
        if !settled || !remains(&after, &rest, floor) || !(NAMED..1.0 - SECOND).contains(&explained)
        {
            break;
        }
    }
    let floor = without_disturbances(floor, &after, &records);
    let lines = prominent_lines(&after, &records);
    let mut diagnosis = Diagnosis {
        records,
        declared,
        lines,
        before,
        after,
        rounds,
        suspected,
        floor,
        dependence_before,
        dependence: rest,
        settled,
        verdict: Verdict::NothingMissing,
    };
    diagnosis.conclude();
    Ok(diagnosis)
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

/// Part of what the plain stand leaves above the noise that one model explains more than another.
fn share(before: &Judged, from: &Judged, to: &Judged, floor: Option<Floor>) -> f64 {
    let noise = floor.map_or(0.0, |f| f.rms.powi(2));
    let missing = before.hold_rms().powi(2) - noise;
    (from.hold_rms().powi(2) - to.hold_rms().powi(2)) / missing.max(1e-300)
}

/// A second effect that explains next to nothing of what was missing at first is not named: what no model has
/// exactly looks a little like many effects.
fn refuse_second(rounds: &mut [Vec<Tried>]) {
    for one in rounds.last_mut().into_iter().flatten() {
        if one.status != Status::Rejected {
            one.status = Status::Rejected;
            one.why = format!(
                "it explains less than {:.0} % of what was missing at first: too little to be named beside the first effect",
                100.0 * SECOND
            );
        }
    }
}

/// The effects of the last round that a law beside the list explains better are not named.
fn stand_back(rounds: &mut [Vec<Tried>], rival: &Rival) {
    for one in rounds.last_mut().into_iter().flatten() {
        if one.status != Status::Rejected
            && let Some(judged) = &one.judged
        {
            one.status = Status::Rejected;
            one.why = rival.instead(judged);
        }
    }
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

/// Whether something above the noise is left. Where the noise itself was seen, in the differences of periods, its level
/// decides; a level from out of band may be too low for coloured noise, so that there the residual must also
/// follow from input or motion, or lie far above it.
fn remains(judged: &Judged, dependence: &Dependence, floor: Option<Floor>) -> bool {
    if dependence.has_spikes() {
        // Spikes raise a floor that is measured without a model as well.
        return true;
    }
    let structured = dependence.structure().is_some();
    let Some(floor) = floor else {
        return structured;
    };
    let ratio = judged.hold_rms() / floor.rms;
    match floor.from {
        "periods" => ratio > AT_FLOOR,
        _ => ratio > AT_FLOOR && (structured || ratio > FAR_ABOVE && !dependence.white),
    }
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

    fn conclude(&mut self) {
        // What changes over a record raises a floor that is taken from differences of its periods, too. It is not a
        // reason to look for a second effect: none of the list does that.
        let open = |judged: &Judged, dependence: &Dependence| {
            remains(judged, dependence, self.floor) || dependence.unsteady().is_some()
        };
        let left = !self.settled || self.suspected.is_some() || open(&self.after, &self.dependence);
        if self.effects().is_empty() {
            let missing = self.suspected.is_some() || open(&self.before, &self.dependence_before);
            self.verdict = if missing {
                Verdict::Unexplained
            } else {
                Verdict::NothingMissing
            };
            return;
        }
        let explained = share(&self.before, &self.before, &self.after, self.floor);
        let known = |floor: Floor| {
            floor.from == "periods" && self.before.hold_rms() > CLEARLY_ABOVE * floor.rms
        };
        if explained >= NAMED || !left && !self.floor.is_some_and(known) {
            self.verdict = if left {
                Verdict::PartlyExplained
            } else {
                Verdict::Explained
            };
            return;
        }
        self.verdict = Verdict::Unexplained;
        for one in self.rounds.iter_mut().flatten() {
            let why = match one.status {
                Status::Rejected => continue,
                Status::Indistinguishable => "no effect is accepted".to_owned(),
                Status::Accepted => format!(
                    "it helps, but explains only {:.0} % of what is missing: something else is behind it",
                    100.0 * explained.max(0.0)
                ),
            };
            one.status = Status::Rejected;
            one.why = why;
        }
        self.after = self.before.clone();
        self.dependence = self.dependence_before.clone();
    }
}
