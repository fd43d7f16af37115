//! Which of the speeds that explain the lines of a record is meant: a line at 290 Hz is order 5 of 58 Hz as well as order
//! 6 of 48.3 Hz.

use super::speed::sure_orders;
use crate::print::{enumeration, rounded};
use crate::warning::{Warning, WarningCode};

/// Highest multiple of the speed that the lowest common multiple of the lines may be.
const MULTIPLES: u32 = 16;
/// Largest distance of a speed from the given one, relative to that of the next speed that explains the lines.
const NEAREST: f64 = 0.25;

/// A warning in place of that about a fundamental found near the given one, if another explains more lines or several
/// explain them. One that explains its lines by orders without a common divisor is right as it is.
pub(super) fn instead_of(
    samples: &[f64],
    rate_hz: f64,
    (given_hz, found_hz): (f64, f64),
    orders: &[f64],
) -> Option<Warning> {
    let shown = shown_at(samples, rate_hz, found_hz, orders);
    let divisor = common_divisor(&shown).filter(|divisor| *divisor > 1)?;
    let base_hz = f64::from(divisor) * found_hz;
    let others = (1..=MULTIPLES).map(|multiple| base_hz / f64::from(multiple));
    let explained = others.filter_map(|hz| {
        let shown = shown_at(samples, rate_hz, hz, orders);
        (common_divisor(&shown) == Some(1)).then_some((hz, shown))
    });
    let more = explained.filter(|(_, orders)| orders.len() > shown.len());
    let best = more.max_by(|a, b| {
        (a.1.len(), a.0)
            .partial_cmp(&(b.1.len(), b.0))
            .expect("finite")
    });
    let list = |values: &[f64]| {
        let texts: Vec<String> = values.iter().map(|value| rounded(*value, 5)).collect();
        enumeration(&texts, "and")
    };
    let message = match best {
        Some((hz, shown)) => format!(
            "the lines of the record are orders {} of {hz} Hz rather than of {} Hz: give --fundamental {hz}",
            list(&shown),
            rounded(given_hz, 7),
            hz = rounded(hz, 6)
        ),
        None => {
            let next = 1.0 / shown.first()?;
            if (found_hz / given_hz - 1.0).abs() <= NEAREST * next {
                return None;
            }
            let lines: Vec<f64> = shown.iter().map(|order| order * found_hz).collect();
            format!(
                "the lines of the record, at {} Hz, are no orders of {} Hz, and orders of several other speeds: measure the \
                 speed and give it with --fundamental",
                list(&lines),
                rounded(given_hz, 7)
            )
        }
    };
    Some(WarningCode::FundamentalOff.warning(message))
}

/// The significant orders at a fundamental.
fn shown_at(samples: &[f64], rate_hz: f64, hz: f64, orders: &[f64]) -> Vec<f64> {
    let seen = orders.iter().filter(|order| **order * hz < 0.5 * rate_hz);
    let seen: Vec<f64> = seen.copied().collect();
    sure_orders(samples, rate_hz, hz, &seen)
}

/// The greatest common divisor of orders; `None` if there is none of them, or not all are whole.
fn common_divisor(orders: &[f64]) -> Option<u32> {
    let whole = |order: &f64| (order.fract() == 0.0).then_some(*order as u32);
    let whole: Vec<u32> = orders.iter().map(whole).collect::<Option<_>>()?;
    let divisor = |mut a: u32, mut b: u32| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    whole.into_iter().reduce(divisor)
}
