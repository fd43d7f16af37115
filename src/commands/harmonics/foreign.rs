//! Lines beside an order that are no orders, found by the speed that each order gives by itself.

use std::f64::consts::TAU;

use torqcomp_dsp::Error;
use torqcomp_dsp::harmonics::{Fundamental, fit};
use torqcomp_dsp::store::SampleStore;

use super::rotation::Rotation;
use super::speed::{FIRST, StraightLine, angles_by_order, mean_variance};
use super::{mains, named};
use crate::print::{enumeration, rounded, short};
use crate::warning::{Warning, WarningCode};

/// Number of parts of the record in which the phase of each order is compared.
const WINDOWS: usize = 8;
/// Minimum number of periods of the lowest order in a part.
const PERIODS: f64 = 3.0;
/// Significant difference of two speeds, in their standard uncertainties.
const SIGNIFICANT: f64 = 6.0;
/// Cycles over the record by which orders of one speed may differ, as with a load that changes slowly, and by which a line
/// that is no order differs from them.
const ALIKE: f64 = 0.05;
const APART: f64 = 0.2;
/// Deviation of the phase of a line from steady progress, in rad rms.
const STEADY_RAD: f64 = 0.3;

/// The line that an order turns out to be.
#[derive(Clone, Copy)]
struct OrderLine {
    order: f64,
    /// Cycles that it gains on the order over the record, with their standard uncertainty.
    turns: f64,
    std_turns: f64,
}

impl OrderLine {
    /// Whether it and another line are orders of one speed, up to a number of cycles over the record.
    fn agrees(&self, other: &Self, most: f64) -> bool {
        let ratio = self.order / other.order;
        let difference = (self.turns - ratio * other.turns).abs();
        let std = self.std_turns.hypot(ratio * other.std_turns);
        difference < (SIGNIFICANT * std).max(most)
    }
}

/// The orders whose phases progress steadily, relative to those of the fundamental.
fn lines(samples: &[f64], rate_hz: f64, hz: f64, orders: &[f64]) -> Option<Vec<OrderLine>> {
    let lowest = orders.iter().copied().reduce(f64::min)?.min(1.0);
    let periods = samples.len() as f64 * lowest * hz / rate_hz;
    if periods < PERIODS * WINDOWS as f64 {
        return None;
    }
    let fundamental = Fundamental::given(hz);
    let whole = fit(samples, rate_hz, 0.0, fundamental, orders).ok()?;
    let shown = angles_by_order(samples, rate_hz, fundamental, &whole, WINDOWS)?;
    let line = |(k, order): (usize, &f64)| {
        let own: Vec<[f64; 2]> = shown.iter().map(|at| at[k]).collect::<Option<_>>()?;
        let through = StraightLine::through(&own);
        // From radians of the shaft per part to cycles of the order over the record.
        let turns = order * WINDOWS as f64 / TAU;
        let std_rad = (through.variance.max(mean_variance(&own)) / through.squares).sqrt();
        (order * through.variance.sqrt() < STEADY_RAD).then_some(OrderLine {
            order: *order,
            turns: turns * through.slope,
            std_turns: turns * std_rad,
        })
    };
    Some(orders.iter().enumerate().filter_map(line).collect())
}

/// Lines beside orders of a fundamental with which most of the other orders disagree, or all those that agree with a
/// fundamental that is given.
pub(super) struct ForeignLines {
    lines: Vec<OrderLine>,
    duration_s: f64,
}

impl ForeignLines {
    /// In the first samples of a record.
    pub(super) fn of(shown: &Rotation, is_given: bool) -> Option<Self> {
        let samples = shown.first(FIRST)?;
        let speed = (shown.fundamental_hz, is_given);
        Self::beside(&samples, shown.record.rate_hz, speed, shown.orders)
    }

    /// At a fundamental, which may be given.
    fn beside(
        samples: &[f64],
        rate_hz: f64,
        (hz, is_given): (f64, bool),
        orders: &[f64],
    ) -> Option<Self> {
        let all = lines(samples, rate_hz, hz, orders)?;
        let group = |one: &OrderLine| all.iter().filter(|line| line.agrees(one, ALIKE)).count();
        let of_given = OrderLine {
            order: 1.0,
            turns: 0.0,
            std_turns: 0.0,
        };
        let largest = all.iter().map(group).max()?;
        let agrees = group(&of_given) == largest;
        let one = match agrees {
            true => of_given,
            false => *all.iter().find(|one| group(one) == largest)?,
        };
        // Of two lines that disagree, either may be the order, unless one is that of the given speed.
        if 2 * largest <= all.len() && !(is_given && agrees && 2 * largest == all.len()) {
            return None;
        }
        let is_foreign = |line: &OrderLine| !line.agrees(&one, APART);
        let foreign: Vec<OrderLine> = all.into_iter().filter(is_foreign).collect();
        (!foreign.is_empty()).then_some(Self {
            lines: foreign,
            duration_s: samples.len() as f64 / rate_hz,
        })
    }

    /// The orders beside which there are no other lines.
    pub(super) fn without(&self, orders: &[f64]) -> Vec<f64> {
        let is_beside = |order: &f64| self.lines.iter().any(|line| line.order == *order);
        let kept = orders.iter().filter(|order| !is_beside(order));
        kept.copied().collect()
    }

    /// Says which line disturbs which order.
    pub(super) fn warning(&self, hz: f64) -> Warning {
        let list = |of: &dyn Fn(&OrderLine) -> String| -> Vec<String> {
            self.lines.iter().map(of).collect()
        };
        let own_hz = |line: &OrderLine| line.order * hz + line.turns / self.duration_s;
        let (is, wrong) = match self.lines.len() {
            1 => ("a line", "is no order, and makes that component wrong"),
            _ => ("lines", "are no orders, and make those components wrong"),
        };
        WarningCode::LineBesideOrder.warning(format!(
            "{is} at {} Hz beside {} of {} Hz {wrong}: the other orders agree with one speed, at which it lies \
             between orders; add {} to --orders to separate them, or record for longer",
            enumeration(&list(&|line| rounded(own_hz(line), 5)), "and"),
            named(&list(&|line| short(line.order))),
            rounded(hz, 7),
            enumeration(&list(&|line| rounded(own_hz(line) / hz, 6)), "and"),
        ))
    }
}

/// The fundamental within a relative range around a given one, by the orders that agree with one speed.
///
/// # Errors
/// As for [`mains::refine`].
pub(super) fn refine(
    samples: &(impl SampleStore + ?Sized),
    rate_hz: f64,
    (start_hz, span): (f64, f64),
    orders: &[f64],
) -> Result<Fundamental, Error> {
    let by = |orders: &[f64]| mains::refine(samples, rate_hz, (start_hz, span), orders);
    let of_all = by(orders);
    let first = samples.part(0..samples.count().min(FIRST))?;
    let found_hz = of_all.as_ref().ok().map(|found| found.frequency_hz);
    let found = found_hz.map(|hz| (hz, false));
    let mut tried = found.into_iter().chain([(start_hz, true)]);
    let foreign = tried.find_map(|speed| ForeignLines::beside(&first, rate_hz, speed, orders));
    match foreign {
        Some(foreign) => by(&foreign.without(orders)).or(of_all),
        None => of_all,
    }
}
