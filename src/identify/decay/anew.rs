//! Moments at which a decay begins anew, seen once a fit of the whole has failed: a second hit in noise, or the end of a push.
//!
//! Demodulated at the strongest line of the residual and averaged over a period, free ringing of one mode is
//! `z(t) = A e^{st}`. On both sides of a moment, `z` is fitted with one `s` and an amplitude each; a hit lets the amplitude
//! jump. The moment counts if the ringing behind it, fitted alone, leaves clearly less there than the fit of the whole. The
//! parts are then decays of their own, or, where the part before is no free ringing of these modes, only the later one is.

use num_complex::Complex64;
use torqcomp_model::fit::FitError;

use super::attempt::Attempt;
use super::modes::Stretch;
use super::search::{ModeSearch, search};
use crate::identify::hum::SteadyLine;
use crate::identify::{Pole, rms};

/// Points of the demodulated signal in a period.
const A_PERIOD: usize = 4;
/// Points on either side of a moment that are fitted, and those next to it that its average reaches.
const SIDE: (usize, usize) = (20, 3);
/// Fewer points, over which a curved envelope does not look like a jump.
const NEAR: usize = 8;
/// Jump of the amplitude over its larger value, and in standard deviations.
const JUMP: (f64, f64) = (0.1, 8.0);
/// Periods behind a moment in which the fits are compared.
const COMPARED: usize = 8;
/// What a fit of the later part alone leaves there, over what the fit of the whole does.
const BETTER: f64 = 0.7;
/// What a fit of both parts may leave of either, over what the later part alone does.
const AS_GOOD: f64 = 1.25;
/// Periods from the start of a stretch that are moments, too, where the residual of its first half is larger than that of its
/// last quarter by a factor.
const EARLY: [f64; 3] = [1.5, 3.0, 6.0];
const FALLS: f64 = 1.5;
/// Difference between a fit that is carried on backwards and the samples, over the fit, from which these do not lead to it.
const APART: f64 = 1.0;
/// Relative distance of the frequencies of parts that ring alike.
const ALIKE: f64 = 0.1;
/// Moments that are tried in a stretch.
const TRIED: usize = 3;
/// Moments of all stretches, at most.
const MOST: usize = 6;
/// Fewest samples and periods of a part.
const LEAST: (usize, usize) = (40, 4);

/// A moment at which ringing begins anew.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beginning {
    pub time_s: f64,
    /// Whether what is before it is ringing, too.
    pub rings_before: bool,
}

/// Cuts the stretches of a fit where ringing begins anew, and fits them again.
///
/// # Errors
/// [`FitError`] if there are too few samples.
pub(super) fn cut<'a>(
    mut found: Attempt<'a>,
    stretches: &mut Vec<Stretch>,
    (wanted, lines): (&'a ModeSearch, &'a [SteadyLine]),
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

/// A stretch of a fit that may begin anew.
struct Cutting<'a, 'b> {
    whole: &'b Attempt<'a>,
    stretches: &'b [Stretch],
    place: usize,
    search: (&'a ModeSearch, &'a [SteadyLine]),
}

/// A fit to other stretches.
type NewFit<'a> = (Attempt<'a>, Vec<Stretch>, Beginning);

/// A moment from which on the ringing alone is fitted clearly better, or as well by fewer modes.
struct Onset {
    time_s: f64,
    /// Samples before it, and the first behind it.
    before: usize,
    behind: usize,
    /// Samples of a period, and those in which fits are compared.
    period: usize,
    compared: usize,
    /// What the fit of the later part leaves there, and the frequency of its strongest mode.
    left: f64,
    frequency_hz: f64,
    /// Difference between the samples of the period before and that fit, carried on backwards, over the fit.
    apart: f64,
    /// Whether it leaves clearly less than the fit of the whole; otherwise it has fewer modes.
    is_better: bool,
}

impl Onset {
    /// Residual at the start of what is behind it.
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

    /// The fit with a cut, if one is better: both parts, if they ring alike, or else the later part from the first moment on.
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
        let mut moments = Vec::new();
        for period_s in lines.into_iter().flatten() {
            let mut times_s = moments_s(stretch, period_s);
            if falls(residuals) {
                times_s.extend(EARLY.map(|periods| periods * period_s));
            }
            for time_s in times_s {
                moments.extend(self.moment(time_s, period_s)?);
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
            if let Some(cut) = self.later(moment)? {
                return Ok(Some(cut));
            }
        }
        Ok(None)
    }

    /// A moment, if the ringing behind it is fitted better alone.
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
            apart: 0.0,
            is_better: false,
        };
        if !moment.is_long(stretch.values.len() - moment.behind) {
            return Ok(None);
        }
        let of_whole = &self.whole.fit.residuals[self.place][moment.behind..];
        let (found, _) = self.search(vec![stretch.later(moment.behind)])?;
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
        let of_whole = moment.start(of_whole);
        moment.is_better = moment.left < BETTER * of_whole;
        let is_simpler =
            found.fit.poles.len() < self.whole.fit.poles.len() && moment.left < AS_GOOD * of_whole;
        Ok((moment.is_better || is_simpler).then_some(moment))
    }

    /// Both parts as decays of their own, if what is left of them is alike.
    fn both(&self, moment: &Onset) -> Result<Option<NewFit<'a>>, FitError> {
        if !moment.is_long(moment.before) {
            return Ok(None);
        }
        let stretch = self.stretch();
        let parts = [stretch.part(0..moment.before), stretch.later(moment.behind)];
        let (found, cut) = self.search(self.with(&parts))?;
        let [before, behind] = [0, 1].map(|k| &found.fit.residuals[self.place + k]);
        let is_simpler = found.fit.poles.len() < self.whole.fit.poles.len();
        let is_good = (moment.is_better || is_simpler)
            && moment.start(behind) < AS_GOOD * moment.left
            && rms(before) < AS_GOOD * moment.left;
        let beginning = Beginning {
            time_s: moment.time_s,
            rings_before: true,
        };
        Ok(is_good.then_some((found, cut, beginning)))
    }

    /// The later part, if the earlier one does not lead to it and does not ring at its frequency.
    fn later(&self, moment: &Onset) -> Result<Option<NewFit<'a>>, FitError> {
        let stretch = self.stretch();
        if moment.apart < APART {
            return Ok(None);
        }
        if moment.is_long(moment.before) {
            let (earlier, _) = self.search(vec![stretch.part(0..moment.before)])?;
            let near =
                |pole: &Pole| (pole.frequency_hz() / moment.frequency_hz - 1.0).abs() < ALIKE;
            if earlier.fit.poles.iter().any(near) {
                return Ok(None);
            }
        }
        let (found, cut) = self.search(self.with(&[stretch.later(moment.behind)]))?;
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

    /// The stretches with these in the place of the one.
    fn with(&self, parts: &[Stretch]) -> Vec<Stretch> {
        let mut all = self.stretches.to_vec();
        all.splice(self.place..=self.place, parts.iter().cloned());
        all
    }
}

/// Whether a residual falls with the ringing.
fn falls(residuals: &[f64]) -> bool {
    let count = residuals.len();
    rms(&residuals[..count / 2]) > FALLS * rms(&residuals[count - count / 4..])
}

/// Times from the start of a stretch at which the amplitude of a line jumps, the clearest first.
fn moments_s(stretch: &Stretch, period_s: f64) -> Vec<f64> {
    let points = demodulated(stretch, period_s);
    let reach = SIDE.0 + SIDE.1;
    let middles = reach..points.len().saturating_sub(reach);
    let jumps: Vec<f64> = middles.map(|i| jump(&points, i)).collect();
    let mut peaks: Vec<(usize, f64)> = Vec::new();
    let mut rises = false;
    for (i, jump) in jumps.into_iter().enumerate() {
        match peaks.last_mut() {
            Some(peak) if rises && jump > peak.1 => *peak = (i, jump),
            Some(_) if rises && jump > 0.0 => {}
            _ if jump > 0.0 => peaks.push((i, jump)),
            _ => {}
        }
        rises = jump > 0.0;
    }
    peaks.sort_by(|a, b| b.1.total_cmp(&a.1));
    peaks.truncate(TRIED);
    let time_s = |peak: &(usize, f64)| (peak.0 + reach) as f64 * period_s / A_PERIOD as f64;
    peaks.iter().map(time_s).collect()
}

/// A stretch times a turn of that period backwards, averaged over the period about each of the points.
fn demodulated(stretch: &Stretch, period_s: f64) -> Vec<Complex64> {
    let step_s = period_s / A_PERIOD as f64;
    let mean = stretch.values.iter().sum::<f64>() / stretch.values.len() as f64;
    let count = (stretch.times_s.last().unwrap_or(&0.0) / step_s) as usize + 1;
    let mut sums = vec![(Complex64::ZERO, 0.0); count];
    for (time_s, value) in stretch.times_s.iter().zip(&stretch.values) {
        let turn = Complex64::from_polar(1.0, -std::f64::consts::TAU * time_s / period_s);
        let sum = &mut sums[(time_s / step_s) as usize];
        sum.0 += turn * (value - mean);
        sum.1 += 1.0;
    }
    let half = A_PERIOD / 2;
    let over = |i: usize| {
        let near = &sums[i.saturating_sub(half)..(i + half).min(count)];
        let total = near
            .iter()
            .fold((Complex64::ZERO, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        total.0 / f64::max(total.1, 1.0)
    };
    (0..count).map(over).collect()
}

/// By how many standard deviations the amplitude jumps at a point; 0 if by too few or too little.
fn jump(points: &[Complex64], middle: usize) -> f64 {
    let [far, near] = [SIDE.0, NEAR].map(|side| Jump::at(points, middle, side));
    let is_jump = near.part.min(far.part) > JUMP.0 && far.sure > JUMP.1;
    if is_jump { far.sure } else { 0.0 }
}

/// A change of the amplitude.
struct Jump {
    /// Over the larger amplitude.
    part: f64,
    /// In standard deviations.
    sure: f64,
}

impl Jump {
    /// At a point, by so many on either side.
    fn at(points: &[Complex64], middle: usize, side: usize) -> Self {
        let before = &points[middle - SIDE.1 - side..=middle - SIDE.1];
        let after = &points[middle + SIDE.1..=middle + SIDE.1 + side];
        let pairs = || before.windows(2).chain(after.windows(2));
        let products: Complex64 = pairs().map(|pair| pair[0].conj() * pair[1]).sum();
        let ratio = products / pairs().map(|pair| pair[0].norm_sqr()).sum::<f64>();
        // Exponents are counted from the middle.
        let fitted = |first: i32, values: &[Complex64]| {
            let shape = (first..).map(|k| ratio.powi(k)).take(values.len());
            let pairs: Vec<_> = shape.zip(values).collect();
            let weight: f64 = pairs.iter().map(|(s, _)| s.norm_sqr()).sum();
            let product: Complex64 = pairs.iter().map(|(s, z)| s.conj() * *z).sum();
            let amplitude = product / weight;
            let left = pairs.iter().map(|(s, z)| (*z - amplitude * s).norm_sqr());
            (amplitude, weight, left.sum::<f64>())
        };
        let from = fitted(-((side + SIDE.1) as i32), before);
        let to = fitted(SIDE.1 as i32, after);
        // An average over a period holds so many points, of which one is of its own.
        let own = A_PERIOD as f64;
        let freedom = ((before.len() + after.len()) as f64 - 3.0 * own).max(own);
        let variance = (from.2 + to.2) / freedom * own * (1.0 / from.1 + 1.0 / to.1);
        let size = (to.0 - from.0).norm();
        Self {
            part: size / from.0.norm().max(to.0.norm()),
            sure: size / variance.sqrt().max(f64::MIN_POSITIVE),
        }
    }
}
