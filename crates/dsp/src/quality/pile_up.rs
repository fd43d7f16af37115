//! Clipping before noise is added: samples pile up at a level without being equal.

use super::clipping::{Clipping, ROUNDING, Rail, goes_beyond};
use super::runs::Lengths;
use super::{Run, range, runs};

/// Number of parts of the range; the noise on the level must lie within the outermost one.
const PARTS: [f64; 2] = [256.0, 64.0];
/// Ratio of the samples in the outermost part to those in the next one that makes a pile-up: 2.4 for the peak of a
/// sine.
const PILE: usize = 4;
/// Minimum fraction of all samples in a pile-up.
const LEAST: f64 = 1e-3;
/// Fraction of all samples at both ends above which a signal rests or switches there.
const RESTING: f64 = 0.6;
/// Minimum number of clipped peaks in the outermost part: one or two can be steps of the signal.
const FEWEST: usize = 3;
/// Minimum fraction of these runs that must be clipped.
const CUT: f64 = 1.0 / 3.0;
/// Part of the range beside the extreme with whose runs those at it are compared: those of small or slow parts of a
/// record, farther away, are longer.
const NEAR: f64 = 0.25;
/// Minimum number of samples of a clipped peak.
const SHORTEST: usize = 3;

/// Detects clipping of a signal at a level before a little noise was added to it.
///
/// The range is divided into 256 parts (64, if the noise is larger). Its outermost part contains a clipping level if
/// 1. it has more than 4 times the samples of the adjacent part, and 0.1 % of all: of a sine of amplitude `A`, a
///    fraction `arccos(1 − w/A)/π` lies within `w` of the peak, 2.4 times as many as in the next `w`;
/// 2. at least 3 runs of samples in it are longer than twice the 95th percentile of the runs in the other parts of the
///    outermost quarter of the range, and none of those is as long as the longest: a signal that rests at several
///    levels is not clipped at the last of them;
/// 3. one in three of these runs is both entered and left in full motion, by the criterion of
///    [`clipping`](fn@super::clipping::clipping) with a tolerance of 4 parts.
///
/// A signal with more than 60 % of its samples in both outermost parts rests or switches there and is not judged.
///
/// ```
/// use torqcomp_dsp::quality::pile_up::pile_up;
/// let noise = |i: i32| 1e-3 * (f64::from(i) * 12.9898).sin();
/// let sine = |i: i32| (0.05 * f64::from(i)).sin();
/// let whole: Vec<f64> = (0..5000).map(|i| sine(i) + noise(i)).collect();
/// assert_eq!(pile_up(&whole), None);
/// let cut: Vec<f64> = (0..5000).map(|i| sine(i).min(0.8) + noise(i)).collect();
/// let found = pile_up(&cut).unwrap();
/// assert!(found.low.is_none() && (found.high.unwrap().value - 0.8).abs() < 1e-3);
/// ```
#[must_use]
pub fn pile_up(samples: &[f64]) -> Option<Clipping> {
    let (low, high) = range(samples).filter(|(low, high)| low < high)?;
    PARTS.into_iter().find_map(|parts| {
        let width = (high - low) / parts;
        let found = Clipping {
            low: rail(samples, [high, low], width),
            high: rail(samples, [low, high], width),
        };
        (found.low.is_some() || found.high.is_some()).then_some(found)
    })
}

/// The rail at the second end of a range divided into parts of this width.
fn rail(samples: &[f64], [far, extreme]: [f64; 2], width: f64) -> Option<Rail> {
    let sign = (extreme - far).signum();
    let last = ((extreme - far).abs() / width).round() - 1.0;
    // Parts below the extreme one, with each sample in the middle of its part.
    let part = |x: &f64| ((extreme - x) * sign / width).floor();
    let level = |x: &f64| {
        let part = part(x);
        if part > last { -last } else { -part }
    };
    let levels: Vec<f64> = samples.iter().map(level).collect();
    let count = |level: f64| levels.iter().filter(|x| **x == level).count();
    let (pile, next, resting) = (count(0.0), count(-1.0), count(-last));
    let part_of = |count: usize| count as f64 / samples.len() as f64;
    if pile <= PILE * next || part_of(pile) < LEAST || part_of(pile + resting) > RESTING {
        return None;
    }
    let is_elsewhere = |run: &Run| run.value < 0.0 && run.value > -NEAR * last;
    let usual = Lengths::of(runs(&levels).filter(is_elsewhere)).quantile(0.95)?;
    let shortest = SHORTEST.max(2 * usual + 1);
    let at: Vec<Run> = runs(&levels)
        .filter(|run| run.value == 0.0 && run.length >= shortest)
        .collect();
    let longest = at.iter().map(|run| run.length).max()?;
    let is_rest = |run: Run| is_elsewhere(&run) && run.length >= longest;
    if at.len() < FEWEST || runs(&levels).any(is_rest) {
        return None;
    }
    let is_cut = |run: &&Run| goes_beyond(&levels, run, 1.0, ROUNDING) == [true; 2];
    let cut = at.iter().filter(is_cut).count();
    let within = || {
        let piled = samples.iter().zip(&levels);
        piled.filter(|(_, level)| **level == 0.0).map(|(x, _)| *x)
    };
    (cut as f64 >= CUT * at.len() as f64).then(|| Rail {
        value: within().sum::<f64>() / pile as f64,
        spread: width,
        samples: pile,
        runs: at.len(),
        longest,
        first: at[0].start,
    })
}

#[cfg(test)]
mod tests {
    use super::super::testing::{noise, sine, sum};
    use super::*;

    const COUNT: usize = 20_000;

    fn noisy(values: &[f64], seed: u64, level: f64) -> Vec<f64> {
        let noise: Vec<f64> = noise(seed, values.len())
            .iter()
            .map(|x| level * x)
            .collect();
        sum(values, &noise)
    }

    /// Response of a stand (damping ratio, samples per period) to a torque, by its difference equation.
    fn answered(torque: &[f64], damping_ratio: f64, period: f64) -> Vec<f64> {
        let w = std::f64::consts::TAU / period;
        let (mut y, mut v) = (torque[0], 0.0);
        let step = |x: &f64| {
            v += w * w * (x - y) - 2.0 * damping_ratio * w * v;
            y += v;
            y
        };
        torque.iter().map(step).collect()
    }

    #[test]
    fn levels_with_noise_are_clipped() {
        for (seed, period) in (1..).zip([23.7, 100.0, 300.0, 1000.0]) {
            for level in [0.5, 0.8] {
                for spread in [1e-4, 3e-4, 1e-3] {
                    let whole = sum(&sine(1.0, period, COUNT), &sine(0.3, period / 4.1, COUNT));
                    let cut: Vec<f64> = whole.iter().map(|x| x.min(level)).collect();
                    let cut = noisy(&cut, seed, spread);
                    let what = format!("period {period}, level {level}, noise {spread}");
                    let found = pile_up(&cut).expect(&what);
                    let high = found.high.expect(&what);
                    assert!(
                        (high.value - level).abs() < 4.0 * spread.max(1e-3),
                        "{what}: {high:?}"
                    );
                    assert_eq!(found.low, None, "{what}");
                    let turned: Vec<f64> = cut.iter().map(|x| -x).collect();
                    let low = pile_up(&turned).and_then(|found| found.low).expect(&what);
                    assert!((low.value + high.value).abs() < 1e-9, "{what}: {low:?}");
                }
            }
        }
    }

    #[test]
    fn what_a_torque_does_is_not_clipping() {
        let ramp = |at: f64| at.clamp(0.0, 1.0);
        for (seed, spread) in (1..).zip([0.0, 1e-4, 1e-3, 1e-2, 0.1]) {
            let clean = |what: String, values: &[f64]| {
                let found = pile_up(&noisy(values, seed, spread));
                assert_eq!(found, None, "{what} with noise of {spread}");
            };
            for period in [7.0, 41.3, 100.0, 1000.0, 9000.0] {
                clean(format!("sine {period}"), &sine(1.0, period, COUNT));
                let two = sum(&sine(1.0, period, COUNT), &sine(0.5, period / 4.0, COUNT));
                clean(format!("two sines {period}"), &two);
                let period = period.max(40.0);
                let square: Vec<f64> = sine(1.0, period, COUNT)
                    .iter()
                    .map(|x| x.signum())
                    .collect();
                clean(format!("square {period}"), &square);
                for damping_ratio in [0.02, 0.2, 0.7, 1.0] {
                    let shown = answered(&square, damping_ratio, (period / 5.0).max(12.0));
                    clean(
                        format!("square {period}, damping ratio {damping_ratio}"),
                        &shown,
                    );
                    let driven = answered(&noise(seed + 9, COUNT), damping_ratio, period);
                    let largest = driven.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
                    let driven: Vec<f64> = driven.iter().map(|x| x / largest).collect();
                    clean(format!("noise through {period}, {damping_ratio}"), &driven);
                }
            }
            let time = || (0..COUNT).map(|i| i as f64);
            let stairs: Vec<f64> = time()
                .map(|t| 4.0 - (4.0 - (t / 2500.0).floor()).abs())
                .collect();
            clean("stairs".to_owned(), &stairs);
            let loads = time().map(|t| (t / 2500.0).floor() + ramp(t % 2500.0 / 300.0));
            clean("loads".to_owned(), &loads.collect::<Vec<f64>>());
            let holds =
                time().map(|t| ramp(t % 5000.0 / 500.0) - ramp((t % 5000.0 - 3000.0) / 500.0));
            clean("holds".to_owned(), &holds.collect::<Vec<f64>>());
        }
    }
}
