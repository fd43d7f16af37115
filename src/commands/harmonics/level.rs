//! Check that the components keep their amplitudes: a component that grows over the record is fitted with its mean.

use torqcomp_dsp::harmonics::Component;

use super::rotation::Rotation;
use super::speed::{FEWEST, MOST, is_sure};
use crate::print::rounded;
use crate::warning::{Warning, WarningCode};

/// Maximum and minimum number of windows.
const WINDOWS: usize = 16;
const FEWEST_WINDOWS: usize = 4;
/// Reported range of the amplitude of a component, relative to its mean and to its standard uncertainty in a window.
const CHANGE: f64 = 0.2;
const OVER_NOISE: f64 = 8.0;

/// A warning if the amplitude of a significant component changes over the record.
pub(super) fn warning(of: &Rotation) -> Option<Warning> {
    let count = of.count();
    let shortest = FEWEST * of.record.rate_hz / (of.lowest() * of.fundamental_hz);
    let shortest = shortest.ceil() as usize;
    let windows = (count / shortest).min(WINDOWS);
    if windows < FEWEST_WINDOWS {
        return None;
    }
    let length = (count / windows).min(MOST);
    let window = |place: usize| {
        let samples = of.window((place, windows), length)?;
        Some(of.fitted(&samples, of.fundamental_hz)?.components)
    };
    let found: Vec<Vec<Component>> = (0..windows).map(window).collect::<Option<_>>()?;
    let of_order = |k: usize| {
        let all: Vec<&Component> = found.iter().map(|window| &window[k]).collect();
        let sure = all.iter().filter(|c| is_sure(c)).count();
        let amplitudes = || all.iter().map(|c| c.phasor.norm());
        let mean = amplitudes().sum::<f64>() / windows as f64;
        let (low, high) = (
            amplitudes().fold(f64::INFINITY, f64::min),
            amplitudes().fold(0.0, f64::max),
        );
        let std = all.iter().map(|c| c.std_amplitude).fold(0.0, f64::max);
        let matters =
            2 * sure > windows && high - low > OVER_NOISE * std && high - low > CHANGE * mean;
        matters.then(|| [all[0].order, low / mean, high / mean])
    };
    let changing = (0..of.orders.len()).filter_map(of_order);
    let [order, low, high] = changing.max_by(|a, b| (a[2] - a[1]).total_cmp(&(b[2] - b[1])))?;
    Some(WarningCode::AmplitudeChanges.warning(format!(
        "the amplitude of order {} changes over the record, between {} and {} times its mean: the components are \
         averages; select a shorter part with --range",
        rounded(order, 4),
        rounded(low, 2),
        rounded(high, 2)
    )))
}
