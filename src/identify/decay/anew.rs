//! Second hits in noise, and pushes that are not free decays yet: segments that restart, found after a fit.
//!
//! Where the amplitude of a line jumps ([`super::jumps`]), the part after it is fitted alone. If that leaves a clearly smaller
//! residual there than the fit of the whole segment, or as small a one with fewer modes, the parts are separate decays. If
//! the part before is no free decay of these modes, only the part after it is used.

use torqcomp_model::fit::FitError;

use super::attempt::{Attempt, leaves_noise};
use super::jumps::jumps_s;
use super::modes::Stretch;
use super::search::{ModeSearch, search};
use crate::identify::hum::SteadyLine;
use crate::identify::{Pole, rms};

/// Number of periods after a restart over which residuals are compared.
const COMPARED: usize = 8;
/// Ratio of the residual of the later part, fitted alone, to that of the whole fit there, below which it is clearly smaller.
pub(super) const BETTER: f64 = 0.7;
/// Ratio of residuals up to which they are equal.
pub(super) const AS_GOOD: f64 = 1.25;
/// Residual of the part before, relative to that of the whole fit after the restart, up to which it is a decay of its own: at
/// its ends it has samples of the contact.
const SMALL: f64 = 0.05;
/// Periods after the start of a segment that are tried as well, and the minimum ratio of the residual in its first half to
/// that in its last quarter for this.
const EARLY: [f64; 3] = [1.5, 3.0, 6.0];
/// Further ones where many modes do not explain a decay.
const LATER: [f64; 2] = [12.0, 24.0];
const FALLS: f64 = 1.5;
/// Minimum ratio of the difference between the samples of the period before and the later fit, extrapolated backwards, to
/// this fit, above which the earlier part does not lead to the later one.
const APART: f64 = 1.0;
/// Relative frequency difference up to which parts ring at the same frequency.
const ALIKE: f64 = 0.1;
/// Number of modes from which a later part is no simpler than many.
const SEVERAL: usize = 3;
/// Maximum number of modes with which a later part is tried, so that a record full of lines does not take much longer.
const FEW: usize = 4;
/// Maximum number of restarts in all segments.
const MOST: usize = 6;
/// Minimum number of samples and periods of a part.
const LEAST: (usize, usize) = (40, 4);

/// A restart of a decay.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beginning {
    pub time_s: f64,
    /// Whether the part before it is a free decay as well.
    pub rings_before: bool,
}

/// Splits the segments of a fit at restarts, and fits them again.
///
/// # Errors
/// [`FitError`] if there are too few samples.
pub(super) fn cut<'a>(
    mut found: Attempt<'a>,
    stretches: &mut Vec<Stretch>,
    (wanted, lines): (&ModeSearch, &'a [SteadyLine]),
) -> Result<(Attempt<'a>, Vec<Beginning>), FitError> {
    let mut all = Vec::new();
    let mut place = 0;
    while place < stretches.len() && all.len() < MOST {
        let anew = Cutting {
            whole: &found,
            stretches,
            place,
            search: (wanted, lines),
        };
        match anew.best()? {
            Some((next, cut, beginning)) => {
                (found, *stretches) = (next, cut);
                all.push(beginning);
            }
            None => place += 1,
        }
    }
    Ok((found, all))
}

/// A segment of a fit that may restart.
struct Cutting<'a, 'b> {
    whole: &'b Attempt<'a>,
    stretches: &'b [Stretch],
    place: usize,
    search: (&'b ModeSearch, &'a [SteadyLine]),
}

/// A fit to other segments.
type NewFit<'a> = (Attempt<'a>, Vec<Stretch>, Beginning);

/// A possible restart: the later part alone is fitted clearly better, or as well with fewer modes.
struct Onset {
    time_s: f64,
    /// Number of samples before it, and index of the first after it.
    before: usize,
    behind: usize,
    /// Number of samples per period, and of those over which residuals are compared.
    period: usize,
    compared: usize,
    /// Residual of the later part fitted alone, and frequency of its strongest mode.
    left: f64,
    frequency_hz: f64,
    /// Residual of the whole fit there.
    of_whole: f64,
    /// Difference between the samples of the period before and that fit, extrapolated backwards, relative to the fit.
    apart: f64,
    /// Whether that residual is clearly smaller than that of the whole fit; otherwise there are fewer modes.
    is_better: bool,
}

impl Onset {
    /// Rms residual at the start of the later part.
    fn start(&self, residuals: &[f64]) -> f64 {
        rms(&residuals[..self.compared.min(residuals.len())])
    }

    fn is_long(&self, count: usize) -> bool {
        count >= LEAST.0.max(LEAST.1 * self.period)
    }
}

impl<'a> Cutting<'a, '_> {
    fn stretch(&self) -> &Stretch {
        &self.stretches[self.place]
    }

    /// The fit with a split, if one is better: of both parts if they ring alike, otherwise of the longest later part.
    fn best(&self) -> Result<Option<NewFit<'a>>, FitError> {
        let stretch = self.stretch();
        if !stretch.bands_hz.is_empty() {
            return Ok(None);
        }
        let residuals = &self.whole.fit.residuals[self.place];
        let lines = [residuals, &stretch.values].map(|samples| {
            let line = stretch.strongest(samples, 0.0..f64::INFINITY);
            line.map(|line| 1.0 / line.frequency_hz)
        });
        let mut periods_s: Vec<f64> = lines.into_iter().flatten().collect();
        periods_s.dedup_by(|own, of_residual| (*own / *of_residual - 1.0).abs() < ALIKE);
        let mut moments = Vec::new();
        for period_s in periods_s {
            let mut times_s = jumps_s(stretch, period_s);
            if falls(residuals) {
                times_s.extend(EARLY.map(|periods| periods * period_s));
                if self.whole.fit.poles.len() > FEW {
                    times_s.extend(LATER.map(|periods| periods * period_s));
                }
            }
            for time_s in times_s {
                moments.extend(self.moment(time_s, period_s)?);
            }
        }
        if self.whole.fit.poles.len() > FEW {
            moments.sort_by_key(|moment| moment.behind);
            for moment in moments.iter().filter(|moment| moment.is_better) {
                if let Some(cut) = self.later(moment, true)? {
                    return Ok(Some(cut));
                }
            }
        }
        for moment in &moments {
            if let Some(cut) = self.both(moment)? {
                return Ok(Some(cut));
            }
        }
        let least = moments.iter().map(|moment| moment.left);
        let least = AS_GOOD * least.fold(f64::INFINITY, f64::min);
        moments.retain(|moment| moment.is_better && moment.left < least);
        moments.sort_by_key(|moment| moment.behind);
        for moment in &moments {
            if let Some(cut) = self.later(moment, false)? {
                return Ok(Some(cut));
            }
        }
        Ok(None)
    }

    /// A possible restart at a time, if the later part is fitted better alone.
    fn moment(&self, time_s: f64, period_s: f64) -> Result<Option<Onset>, FitError> {
        let stretch = self.stretch();
        let place = |time_s: f64| stretch.times_s.partition_point(|t| *t < time_s);
        let period = place(stretch.times_s[0] + period_s);
        let mut moment = Onset {
            time_s: stretch.start_s + time_s,
            before: place(time_s - 0.5 * period_s),
            behind: place(time_s + 0.5 * period_s),
            period,
            compared: COMPARED * period,
            left: 0.0,
            frequency_hz: 0.0,
            of_whole: 0.0,
            apart: 0.0,
            is_better: false,
        };
        if !moment.is_long(stretch.values.len() - moment.behind) {
            return Ok(None);
        }
        let of_whole = &self.whole.fit.residuals[self.place][moment.behind..];
        let few = ModeSearch {
            most: self.search.0.most.min(FEW),
            ..*self.search.0
        };
        let found = search(&mut vec![stretch.later(moment.behind)], &few, self.search.1)?;
        let Some(main) = found.fit.by_strength(1).first().copied() else {
            return Ok(None);
        };
        moment.left = moment.start(&found.fit.residuals[0]);
        moment.frequency_hz = found.fit.poles[main].frequency_hz();
        let first_s = stretch.times_s[moment.behind];
        let before = moment.before.saturating_sub(period)..moment.before;
        let carried_on = before
            .clone()
            .map(|i| found.fit.value_at(0, stretch.times_s[i] - first_s));
        let carried_on: Vec<f64> = carried_on.collect();
        let pairs = stretch.values[before].iter().zip(&carried_on);
        let apart: Vec<f64> = pairs.map(|(value, fit)| value - fit).collect();
        moment.apart = rms(&apart) / rms(&carried_on);
        moment.of_whole = moment.start(of_whole);
        moment.is_better = moment.left < BETTER * moment.of_whole;
        let is_simpler = found.fit.poles.len() < self.whole.fit.poles.len()
            && moment.left < AS_GOOD * moment.of_whole;
        Ok((moment.is_better || is_simpler).then_some(moment))
    }

    /// The fit of both parts as separate decays, if their residuals are equally small.
    fn both(&self, moment: &Onset) -> Result<Option<NewFit<'a>>, FitError> {
        if !moment.is_long(moment.before) {
            return Ok(None);
        }
        let stretch = self.stretch();
        let parts = [stretch.part(0..moment.before), stretch.later(moment.behind)];
        let (found, cut) = self.search(self.with(&parts))?;
        let [before, behind] = [0, 1].map(|k| &found.fit.residuals[self.place + k]);
        let is_simpler = found.fit.poles.len() < self.whole.fit.poles.len();
        // Parts of a decay whose frequency changes take several modes.
        let small = match found.fit.poles.len() {
            1 => SMALL * moment.of_whole,
            _ => 0.0,
        };
        let is_good = (moment.is_better || is_simpler)
            && moment.start(behind) < AS_GOOD * moment.left
            && rms(before) < (AS_GOOD * moment.left).max(small);
        let beginning = Beginning {
            time_s: moment.time_s,
            rings_before: true,
        };
        Ok(is_good.then_some((found, cut, beginning)))
    }

    /// The fit of the later part, if the earlier one does not lead to it and does not ring at its frequency; or, as after
    /// several rebounds, if that is noise beside few modes while many do not explain both.
    fn later(&self, moment: &Onset, is_noise: bool) -> Result<Option<NewFit<'a>>, FitError> {
        let stretch = self.stretch();
        if !is_noise && moment.apart < APART {
            return Ok(None);
        }
        let (found, cut) = self.search(self.with(&[stretch.later(moment.behind)]))?;
        if is_noise
            && (found.fit.poles.len() >= SEVERAL || !leaves_noise(&found.fit, &cut, self.search.0)?)
        {
            return Ok(None);
        }
        if !is_noise && moment.is_long(moment.before) {
            let (earlier, _) = self.search(vec![stretch.part(0..moment.before)])?;
            let near =
                |pole: &Pole| (pole.frequency_hz() / moment.frequency_hz - 1.0).abs() < ALIKE;
            if earlier.fit.poles.iter().any(near) {
                return Ok(None);
            }
        }
        let beginning = Beginning {
            time_s: moment.time_s,
            rings_before: false,
        };
        Ok(Some((found, cut, beginning)))
    }

    fn search(&self, mut stretches: Vec<Stretch>) -> Result<(Attempt<'a>, Vec<Stretch>), FitError> {
        let found = search(&mut stretches, self.search.0, self.search.1)?;
        Ok((found, stretches))
    }

    /// The segments with these in place of this one.
    fn with(&self, parts: &[Stretch]) -> Vec<Stretch> {
        let mut all = self.stretches.to_vec();
        all.splice(self.place..=self.place, parts.iter().cloned());
        all
    }
}

/// Whether a residual decays.
fn falls(residuals: &[f64]) -> bool {
    let count = residuals.len();
    rms(&residuals[..count / 2]) > FALLS * rms(&residuals[count - count / 4..])
}
