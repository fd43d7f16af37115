//! Modes that are powers of the strongest one: distortion.

use super::{Identification, Pole};
use crate::print::rounded;
use crate::warning::WarningCode;

/// Orders of distortion, and largest relative difference of frequency and decay rate from that multiple of the mode's.
const ORDERS: [f64; 2] = [2.0, 3.0];
const NEAR_MULTIPLE: (f64, f64) = (5e-3, 0.4);
/// Maximum amplitude of distortion, relative to that of the mode.
const WEAK: f64 = 0.2;

/// Warns about modes that are powers of the strongest one: `xⁿ` has n times the frequency and n times the decay rate.
/// `shares` are the amplitudes of the modes relative to that of the strongest.
pub(super) fn warn(
    result: &mut Identification,
    poles: &[Pole],
    strongest: usize,
    shares: &[f64],
    advice: &str,
) {
    let of = poles[strongest];
    let (of_frequency, of_rate) = NEAR_MULTIPLE;
    let is_power = |pole: &Pole, order: &f64| {
        let frequency = pole.frequency_hz() / of.frequency_hz() / order - 1.0;
        let rate = pole.rate_per_s / of.rate_per_s / order - 1.0;
        frequency.abs() < of_frequency && rate.abs() < of_rate
    };
    let others = (0..poles.len()).filter(|k| *k != strongest && shares[*k] < WEAK);
    for pole in others.map(|k| poles[k]) {
        let Some(order) = ORDERS.iter().find(|order| is_power(&pole, order)) else {
            continue;
        };
        result.warn(WarningCode::Overtone.warning(format!(
            "the mode at {} Hz has {order} times the frequency and about {order} times the decay rate of that at \
             {} Hz: it is probably no mode, but distortion by an amplifier near its limit or a spring that is not \
             linear, which makes the other constants wrong as well; {advice}",
            rounded(pole.frequency_hz(), 5),
            rounded(of.frequency_hz(), 5)
        )));
    }
}
