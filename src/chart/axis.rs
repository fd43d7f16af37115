//! Range of an axis, linear or logarithmic, and its ticks.

/// Maximum decades of a logarithmic axis.
const MOST_DECADES: f64 = 12.0;
/// Decades above which a logarithmic axis has ticks at powers of ten.
const LONG: f64 = 1.2;

/// A range of values, or of their logarithms on a logarithmic axis.
#[derive(PartialEq)]
pub(super) struct Axis {
    low: f64,
    high: f64,
    log: bool,
}

impl Axis {
    /// Range of the values that can be drawn, extended by a fraction `room` at both ends. `None` if there are no such
    /// values.
    pub(super) fn over(values: impl Iterator<Item = f64>, log: bool, room: f64) -> Option<Self> {
        let place = |v: f64| if log { v.log10() } else { v };
        let (low, high) = values
            .map(place)
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
                (low.min(v), high.max(v))
            });
        if low > high {
            return None;
        }
        let low = match log {
            true => low.max(high - MOST_DECADES),
            false => low,
        };
        let spare = match high > low {
            true => room * (high - low),
            false if log => 0.5,
            false => 0.5_f64.max(1e-6 * low.abs()),
        };
        Some(Self {
            low: low - spare,
            high: high + spare,
            log,
        })
    }

    /// Its ends and whether it is logarithmic, for the script of a page.
    pub(super) fn ends(&self) -> String {
        format!("{} {} {}", self.low, self.high, u8::from(self.log))
    }

    pub(super) fn contains(&self, value: f64) -> bool {
        value.is_finite() && (!self.log || value.log10() >= self.low)
    }

    /// Position of a value along the axis, from 0 to 1.
    pub(super) fn part(&self, value: f64) -> f64 {
        let place = if self.log { value.log10() } else { value };
        (place - self.low) / (self.high - self.low)
    }

    /// About `count` ticks: 1, 2 or 5 times powers of ten; on a long logarithmic axis the powers alone.
    pub(super) fn marks(&self, count: f64) -> Vec<f64> {
        if self.log && self.high - self.low > LONG {
            return self.powers(count);
        }
        let value = |place: f64| if self.log { 10_f64.powf(place) } else { place };
        let (low, high) = (value(self.low), value(self.high));
        let step = step(high - low, count);
        let (first, last) = ((low / step).ceil(), (high / step).floor());
        let steps = (last - first).max(0.0) as usize;
        (0..=steps).map(|i| (first + i as f64) * step).collect()
    }

    fn powers(&self, count: f64) -> Vec<f64> {
        let every = ((self.high - self.low) / count).ceil().max(1.0) as i32;
        let (from, to) = (self.low.ceil() as i32, self.high.floor() as i32);
        if to - from >= 3 {
            let decades = (from..=to).filter(|decade| decade % every == 0);
            return decades.map(|decade| 10_f64.powi(decade)).collect();
        }
        // One to three powers are too few to read values from.
        (from - 1..=to)
            .flat_map(|decade| [1.0, 2.0, 5.0].map(|f| f * 10_f64.powi(decade)))
            .filter(|v| (self.low..=self.high).contains(&v.log10()))
            .collect()
    }
}

/// The smallest of 1, 2 or 5 times a power of ten that divides a range into at most `count` parts.
fn step(range: f64, count: f64) -> f64 {
    let rough = range / count;
    let power = 10_f64.powf(rough.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|f| f * power)
        .find(|step| *step >= rough)
        .unwrap_or(10.0 * power)
}
