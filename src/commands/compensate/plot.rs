//! The picture of the recorded and the compensated signal over time.

use crate::chart::{Chart, Envelope, Series, picture};

/// Height of the panel, in user units.
const HEIGHT: f64 = 330.0;

/// Both signals, gathered sample by sample in bounded memory.
#[derive(Debug, Clone)]
pub struct Traces {
    range: Option<(f64, f64)>,
    recorded: Envelope,
    compensated: Envelope,
}

impl Traces {
    /// No samples yet; only those within the range, in seconds, will be drawn.
    pub fn new(range: Option<(f64, f64)>) -> Self {
        Self {
            range,
            recorded: Envelope::new(),
            compensated: Envelope::new(),
        }
    }

    pub fn add(&mut self, time_s: f64, recorded: f64, compensated: f64) {
        let within = |(from, to): (f64, f64)| (from..=to).contains(&time_s);
        if self.range.is_none_or(within) {
            self.recorded.add(time_s, recorded);
            self.compensated.add(time_s, compensated);
        }
    }

    /// Whether no sample lay within the range.
    pub fn is_empty(&self) -> bool {
        self.recorded.is_empty()
    }

    pub fn svg(&self, unit: &str) -> String {
        let series = vec![
            Series::new("recorded", self.recorded.points()),
            Series::new("compensated", self.compensated.points()),
        ];
        let chart = Chart::new("", "time, s", unit, series);
        picture("Recorded and compensated signal", HEIGHT, &[chart])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_range_is_drawn() {
        let mut traces = Traces::new(Some((1.0, 2.0)));
        for i in 0..300 {
            traces.add(0.01 * f64::from(i), 1.0, -1.0 + f64::from(i % 7));
        }
        assert_eq!(traces.recorded.points().len(), 101);
        let svg = traces.svg("N m & <x>");
        assert!(svg.contains("N m &amp; &lt;x&gt;") && !svg.contains("NaN"));
        assert_eq!(svg.matches("<path").count(), 2);
        assert!(Traces::new(None).is_empty());
    }
}
