//! Incremental search for the modes of a decay.

use torqcomp_model::fit::FitError;

use super::modes::{ModesFit, Stretch, fit};
use super::search::{
    LEAST_GAIN, ModeSearch, RESOLVED, close, gain, is_close, is_left_of, largest, next_pole,
    physical, steady, take_off,
};
use super::{baseline, first_period};
use crate::identify::Pole;
use crate::identify::hum::SteadyLine;

/// Maximum number of lines removed.
const MOST_LINES: usize = 8;
/// Maximum number of periods removed from the start of a decay, once its modes are known.
const MOST_PERIODS: usize = 4;

/// Minimum amplitude of one of two modes close together, relative to that of the other.
pub(super) const COMPARABLE: f64 = 0.1;

/// Current state of the search.
pub(super) struct Attempt<'a> {
    pub fit: ModesFit,
    /// Removed lines.
    pub lines: Vec<SteadyLine>,
    /// Whether a moving baseline was removed.
    pub has_baseline: bool,
    /// Whether a line other than the mains is steady.
    pub has_tone: bool,
    wanted: ModeSearch,
    /// Lines removed earlier, and number removed since.
    taken_off: (&'a [SteadyLine], usize),
    takes_tones: bool,
    /// Steady lines among the modes.
    tones: Vec<usize>,
}

impl<'a> Attempt<'a> {
    /// Adds modes one by one while the criterion falls enough, each starting at the strongest line of the residual.
    /// Lines that do not decay are removed from the segments: mains lines where they are found, others from the last
    /// fit, so that the modes do not bias them. Artefacts of the recorder are removed as well: a moving baseline, and
    /// the start of a decay, where a filter still responds to the hit.
    ///
    /// # Errors
    /// [`FitError`] if there are too few samples.
    pub fn of(
        stretches: &mut [Stretch],
        wanted: &ModeSearch,
        taken_off: &'a [SteadyLine],
        takes_tones: bool,
    ) -> Result<Self, FitError> {
        let mut all = Self {
            fit: fit(stretches, &[])?,
            lines: Vec::new(),
            has_baseline: false,
            has_tone: false,
            wanted: *wanted,
            taken_off: (taken_off, 0),
            takes_tones,
            tones: Vec::new(),
        };
        let resolved = RESOLVED * all.fit.fit.sum_of_squares;
        while all.goes_on(resolved) {
            let Some(pole) = next_pole(stretches, &all.fit, wanted.band_hz) else {
                break;
            };
            let next = fit(stretches, &[&all.fit.poles[..], &[pole]].concat())?;
            if !all.is_recorders(stretches, &next)? && !all.is_taken(stretches, next)? {
                break;
            }
        }
        all.finish(stretches)?;
        Ok(all)
    }

    /// A finished search with one mode and dry friction.
    pub fn with_friction(fit: ModesFit, wanted: &ModeSearch) -> Self {
        Self {
            fit,
            lines: Vec::new(),
            has_baseline: false,
            has_tone: false,
            wanted: *wanted,
            taken_off: (&[], 0),
            takes_tones: false,
            tones: Vec::new(),
        }
    }

    /// Whether to search for more modes.
    fn goes_on(&self, resolved: f64) -> bool {
        let modes = self.fit.poles.len() - self.tones.len();
        match self.wanted.count {
            Some(count) => modes < count,
            None => modes < self.wanted.most && self.fit.fit.sum_of_squares >= resolved,
        }
    }

    /// Removes the last line of a fit if it is not a mode of the stand; returns whether it is not.
    fn is_recorders(
        &mut self,
        stretches: &mut [Stretch],
        next: &ModesFit,
    ) -> Result<bool, FitError> {
        let last = self.fit.poles.len();
        let of_mains = steady(next, last, stretches).filter(|line| line.is_of_mains);
        let known = self.taken_off.0.iter().chain(&self.lines);
        let is_line = of_mains.is_some() || is_left_of(known, next, last, stretches);
        if is_line && self.taken_off.1 < MOST_LINES {
            take_off(stretches, next, last);
            self.lines.extend(of_mains);
            self.taken_off.1 += 1;
            self.refit(stretches)?;
            return Ok(true);
        }
        let is_transient = |mode: &Pole| first_period::is_transient(next.poles[last], *mode);
        let is_filter = is_clear(&self.fit, next, stretches)
            && self.fit.poles.first().is_some_and(is_transient)
            && first_period::cut_off(stretches, &self.fit, first_period::LARGER);
        if is_filter {
            self.refit(stretches)?;
        }
        Ok(is_filter)
    }

    /// Accepts a fit with one more mode, or removes a baseline, if either is worthwhile; returns
    /// whether one was.
    fn is_taken(&mut self, stretches: &mut [Stretch], next: ModesFit) -> Result<bool, FitError> {
        let last = self.fit.poles.len();
        let is_clear = is_clear(&self.fit, &next, stretches);
        // Next to a mode it is a residual of its damping law.
        let is_tone =
            is_clear && steady(&next, last, stretches).is_some() && close(&next.poles).is_none();
        self.has_tone |= is_tone;
        if is_tone && self.takes_tones && self.tones.len() < MOST_LINES {
            self.tones.push(last);
            self.fit = next;
            return Ok(true);
        }
        let is_slow = |mode: &Pole| baseline::is_slow(next.poles[last], *mode);
        let is_slow = self.fit.poles.first().is_some_and(is_slow);
        let pays = is_clear && !is_slow && physical(&next, stretches, &self.tones);
        if !pays && self.has_more_baseline(stretches)? {
            return Ok(true);
        }
        if self.wanted.count.is_none() {
            let close_hz = close(&next.poles).filter(|_| pays);
            let is_pair = close_hz.is_some() && self.is_pair(&next, stretches)?;
            self.fit.close_hz = close_hz.filter(|_| !is_pair);
            if !pays || self.fit.close_hz.is_some() {
                return Ok(false);
            }
        }
        self.fit = next;
        if self.has_baseline {
            // It was fitted without this mode.
            baseline::take_off(stretches, &self.fit, true);
            self.refit(stretches)?;
        }
        Ok(true)
    }

    /// Whether a fit whose last mode is close to another describes two modes of the stand: resolved, of comparable
    /// size, and without a further line beside them, as a frequency that changes with the amplitude would leave.
    fn is_pair(&self, next: &ModesFit, stretches: &[Stretch]) -> Result<bool, FitError> {
        let Some((last, others)) = next.poles.split_last() else {
            return Ok(false);
        };
        let size = largest(next, others.len(), stretches);
        let is_mode = |(k, other): (usize, &Pole)| {
            let apart = (other.omega_rad_per_s - last.omega_rad_per_s).abs();
            let is_resolved = apart > other.rate_per_s + last.rate_per_s;
            is_resolved && size > COMPARABLE * largest(next, k, stretches)
        };
        let mut close_by = others.iter().enumerate().filter(|(_, o)| is_close(o, last));
        if !close_by.all(is_mode) {
            return Ok(false);
        }
        let Some(pole) = next_pole(stretches, next, self.wanted.band_hz) else {
            return Ok(true);
        };
        let third = fit(stretches, &[&next.poles[..], &[pole]].concat())?;
        let is_left = close(&third.poles).is_some() && is_clear(next, &third, stretches);
        Ok(!is_left)
    }

    /// Removes a baseline if it moves and none was removed before; returns whether it did.
    fn has_more_baseline(&mut self, stretches: &mut [Stretch]) -> Result<bool, FitError> {
        let moves = !self.has_baseline && baseline::take_off(stretches, &self.fit, false);
        if moves {
            self.has_baseline = true;
            self.refit(stretches)?;
        }
        Ok(moves)
    }

    /// Removes the remaining recorder artefacts, and the tones.
    fn finish(&mut self, stretches: &mut [Stretch]) -> Result<(), FitError> {
        self.has_more_baseline(stretches)?;
        for _ in 0..MOST_PERIODS {
            if !first_period::cut_off(stretches, &self.fit, first_period::TOO_LARGE) {
                break;
            }
            self.refit(stretches)?;
        }
        let mut modes = 0..self.fit.poles.len();
        self.has_tone |= modes.any(|k| steady(&self.fit, k, stretches).is_some());
        if self.tones.is_empty() {
            return Ok(());
        }
        for k in &self.tones {
            self.lines.push(SteadyLine {
                frequency_hz: self.fit.poles[*k].frequency_hz(),
                amplitude: largest(&self.fit, *k, stretches),
                is_of_mains: false,
            });
            take_off(stretches, &self.fit, *k);
        }
        let modes = (0..self.fit.poles.len()).filter(|k| !self.tones.contains(k));
        self.fit.poles = modes.map(|k| self.fit.poles[k]).collect();
        self.refit(stretches)
    }

    /// Refits the modes to the current segments.
    fn refit(&mut self, stretches: &[Stretch]) -> Result<(), FitError> {
        self.fit = ModesFit {
            close_hz: self.fit.close_hz,
            ..fit(stretches, &self.fit.poles)?
        };
        Ok(())
    }
}

/// Whether one more mode clearly reduces the error.
fn is_clear(before: &ModesFit, after: &ModesFit, stretches: &[Stretch]) -> bool {
    gain(before, after, stretches) > LEAST_GAIN
        && after.fit.sum_of_squares < 0.98 * before.fit.sum_of_squares
}

/// Whether the residual of a fit has neither a mode nor a line.
pub(super) fn leaves_noise(
    found: &ModesFit,
    stretches: &[Stretch],
    few: &ModeSearch,
) -> Result<bool, FitError> {
    let left = stretches.iter().zip(&found.residuals);
    let left = left.map(|(stretch, residuals)| Stretch {
        values: residuals.clone(),
        ..stretch.clone()
    });
    let mut left: Vec<Stretch> = left.collect();
    let more = Attempt::of(&mut left, few, &[], true)?;
    Ok(more.fit.poles.is_empty() && more.lines.is_empty() && !more.has_baseline)
}
