//! Times of the samples in messages with several of them.

use super::route::{Hop, Route};
use super::schema::{FieldKind, Schema};
use crate::failure::did_you_mean;

/// Spacing of the samples within a message.
#[derive(Debug, Clone, PartialEq)]
pub enum Spacing {
    /// Every message holds one sample.
    Single,
    /// Given by a field: seconds per unit of the field, or its reciprocal for a rate.
    Field {
        /// Path to it.
        hops: Vec<Hop>,
        /// Seconds per unit; of the reciprocal if the field is a rate.
        seconds: f64,
        /// Whether the field is a rate.
        is_rate: bool,
    },
    /// Samples are evenly spaced between the times of consecutive messages.
    Even,
}

/// Names of fields that hold a spacing or a rate: name, seconds per unit, whether it is a rate.
const NAMES: &[(&str, f64, bool)] = &[
    ("dt", 1.0, false),
    ("sample_period", 1.0, false),
    ("sampling_period", 1.0, false),
    ("sample_interval", 1.0, false),
    ("sampling_interval", 1.0, false),
    ("sample_time", 1.0, false),
    ("time_step", 1.0, false),
    ("time_increment", 1.0, false),
    ("period", 1.0, false),
    ("sample_rate", 1.0, true),
    ("sampling_rate", 1.0, true),
    ("sample_frequency", 1.0, true),
    ("sampling_frequency", 1.0, true),
    ("rate", 1.0, true),
    ("fs", 1.0, true),
];

/// Name endings that give the unit: ending, seconds per unit.
const ENDINGS: &[(&str, f64)] = &[
    ("_ns", 1e-9),
    ("_nsec", 1e-9),
    ("_us", 1e-6),
    ("_usec", 1e-6),
    ("_ms", 1e-3),
    ("_msec", 1e-3),
    ("_s", 1.0),
    ("_sec", 1.0),
    ("_hz", 1.0),
    ("_khz", 1e-3),
    ("_mhz", 1e-6),
];

impl Spacing {
    /// Finds the spacing of samples: from the field named by the user, from one with such a name,
    /// or evenly between messages.
    ///
    /// # Errors
    /// A sentence if the named field is missing or its name does not say what it contains.
    pub fn find(schema: &Schema, route: &Route, named: Option<&str>) -> Result<Self, String> {
        let fields = &schema.root().fields;
        if let Some(name) = named {
            let place = fields.iter().position(|field| field.name == name);
            let hint = || did_you_mean(name, fields.iter().map(|field| field.name.as_str()));
            let place = place.ok_or_else(|| {
                format!(
                    "there is no field \"{name}\"{} for the sample spacing",
                    hint()
                )
            })?;
            // Any other name given by the user is taken to be a spacing in seconds.
            let (seconds, is_rate) = meaning(name).unwrap_or((1.0, false));
            return Self::field(schema, place, seconds, is_rate)
                .ok_or_else(|| format!("\"{name}\" is not a single number"));
        }
        if !route.is_whole_list() {
            return Ok(Self::Single);
        }
        let found = fields.iter().enumerate().find_map(|(place, field)| {
            let (seconds, is_rate) = meaning(&field.name)?;
            Self::field(schema, place, seconds, is_rate)
        });
        Ok(found.unwrap_or(Self::Even))
    }

    fn field(schema: &Schema, place: usize, seconds: f64, is_rate: bool) -> Option<Self> {
        let field = &schema.root().fields[place];
        matches!(field.kind, FieldKind::Number(_)).then(|| Self::Field {
            hops: vec![Hop::Field(place)],
            seconds,
            is_rate,
        })
    }

    /// Path to the field, if any.
    pub fn hops(&self) -> Option<&Vec<Hop>> {
        match self {
            Self::Field { hops, .. } => Some(hops),
            _ => None,
        }
    }
}

/// Meaning of a field by its name.
fn meaning(name: &str) -> Option<(f64, bool)> {
    let name = name.to_lowercase();
    let ending = ENDINGS
        .iter()
        .find_map(|(ending, seconds)| Some((name.strip_suffix(ending)?, *seconds)));
    let (stem, scale) = ending.unwrap_or((&name, 1.0));
    NAMES
        .iter()
        .find(|(known, ..)| *known == stem)
        .map(|(_, seconds, is_rate)| (seconds * scale, *is_rate))
}

/// Assigns a time to every sample of a message.
#[derive(Debug)]
pub struct Blocks {
    spacing: Spacing,
    /// A message whose samples need the time of the next one.
    waiting: Option<(i64, Vec<f64>)>,
    /// Mean spacing up to the last message, in ns.
    last_ns: Option<f64>,
    /// Spacing that two successive messages have shared, in ns.
    usual_ns: Option<f64>,
    /// Number of messages with an invalid spacing.
    pub without_spacing: u64,
}

impl Blocks {
    /// Starts without a message.
    pub fn new(spacing: Spacing) -> Self {
        Self {
            spacing,
            waiting: None,
            last_ns: None,
            usual_ns: None,
            without_spacing: 0,
        }
    }

    /// Takes a message's samples; those with known times are passed to `each`.
    pub fn push(
        &mut self,
        time_ns: i64,
        values: &[f64],
        spacing: Option<f64>,
        mut each: impl FnMut(i64, f64),
    ) {
        match &self.spacing {
            Spacing::Single => values.iter().for_each(|value| each(time_ns, *value)),
            Spacing::Field {
                seconds, is_rate, ..
            } => {
                let step = spacing.map(|s| if *is_rate { 1.0 / s } else { s } * seconds * 1e9);
                match step.filter(|step| *step > 0.0 && step.is_finite()) {
                    Some(step) => spread(time_ns, values, step, each),
                    None => self.without_spacing += 1,
                }
            }
            Spacing::Even => {
                self.give_waiting(Some(time_ns), each);
                self.waiting = Some((time_ns, values.to_vec()));
            }
        }
    }

    /// Outputs the last message's samples, with the previous spacing.
    pub fn finish(&mut self, each: impl FnMut(i64, f64)) {
        self.give_waiting(None, each);
    }

    fn give_waiting(&mut self, next_ns: Option<i64>, each: impl FnMut(i64, f64)) {
        let Some((time_ns, values)) = self.waiting.take() else {
            return;
        };
        let step = next_ns
            .and_then(|next| next.checked_sub(time_ns))
            .filter(|gap| *gap > 0 && !values.is_empty())
            .map(|gap| gap as f64 / values.len() as f64);
        match step
            .map(|step| self.within(step))
            .or(self.usual_ns)
            .or(self.last_ns)
        {
            Some(step) => spread(time_ns, &values, step, each),
            None if values.len() == 1 => spread(time_ns, &values, 0.0, each),
            None => self.without_spacing += 1,
        }
    }
}

/// Relative difference up to which two spacings are the same.
const SAME: f64 = 0.05;

impl Blocks {
    /// Spacing within a message from the mean one up to the next: the usual one, where whole messages are missing in between.
    fn within(&mut self, mean_ns: f64) -> f64 {
        let is_same = |a: f64, b: f64| (a / b - 1.0).abs() < SAME;
        let last_ns = self.last_ns.replace(mean_ns);
        if last_ns.is_some_and(|last| is_same(mean_ns, last)) {
            self.usual_ns = Some(mean_ns);
        }
        let is_over_gap = |usual: &f64| {
            let times = (mean_ns / usual).round();
            times >= 2.0 && is_same(mean_ns, times * usual)
        };
        self.usual_ns.filter(is_over_gap).unwrap_or(mean_ns)
    }
}

fn spread(time_ns: i64, values: &[f64], step_ns: f64, mut each: impl FnMut(i64, f64)) {
    for (place, value) in values.iter().enumerate() {
        let behind = (place as f64 * step_ns).round();
        each(time_ns.saturating_add(behind as i64), *value);
    }
}

#[cfg(test)]
mod tests {
    use super::super::path;
    use super::super::schema::ros2msg::{Generation, read};
    use super::*;

    fn spacing(text: &str, named: Option<&str>) -> Result<Spacing, String> {
        let schema = read("p/M", text, Generation::Ros2).unwrap();
        let route = Route::find(&schema, &path::parse("data[:]").unwrap()).unwrap();
        Spacing::find(&schema, &route, named)
    }

    fn times(spacing: Spacing, messages: &[(i64, usize, Option<f64>)]) -> (Vec<i64>, u64) {
        let mut blocks = Blocks::new(spacing);
        let mut times = Vec::new();
        for (time, count, step) in messages {
            blocks.push(*time, &vec![0.0; *count], *step, |time, _| times.push(time));
        }
        blocks.finish(|time, _| times.push(time));
        (times, blocks.without_spacing)
    }

    #[test]
    fn a_field_tells_the_spacing() {
        let found = spacing("float64 dt_us\nfloat32[] data", None).unwrap();
        let Spacing::Field { seconds, .. } = &found else {
            panic!("{found:?}");
        };
        assert_eq!(*seconds, 1e-6);
        let messages = [
            (1000, 2, Some(0.5)),
            (9000, 1, Some(0.5)),
            (0, 1, Some(0.0)),
        ];
        assert_eq!(times(found, &messages), (vec![1000, 1500, 9000], 1));
        let found = spacing("float64 sample_rate_hz\nfloat32[] data", None).unwrap();
        let messages = [(0, 3, Some(1e6))];
        assert_eq!(times(found, &messages), (vec![0, 1000, 2000], 0));
        let found = spacing("float64 step\nfloat32[] data", Some("step")).unwrap();
        assert_eq!(
            times(found, &[(0, 2, Some(1.0))]),
            (vec![0, 1_000_000_000], 0)
        );
        assert!(spacing("float64 step\nfloat32[] data", Some("stop")).is_err());
    }

    #[test]
    fn otherwise_samples_lie_evenly_between_messages() {
        let even = || spacing("float32[] data", None).unwrap();
        let messages = [(0, 4, None), (1000, 2, None), (1500, 3, None)];
        let expected = vec![0, 250, 500, 750, 1000, 1250, 1500, 1750, 2000];
        assert_eq!(times(even(), &messages), (expected, 0));
        assert_eq!(times(even(), &[(5, 3, None)]), (vec![], 1));
        // The third of five messages is lost.
        let messages = [(0, 2, None), (20, 2, None), (60, 2, None), (80, 2, None)];
        let expected = vec![0, 10, 20, 40, 60, 70, 80, 90];
        assert_eq!(times(even(), &messages), (expected, 0));
        let messages = [(0, 2, None), (20, 2, None), (40, 2, None), (80, 2, None)];
        let expected = vec![0, 10, 20, 30, 40, 50, 80, 90];
        assert_eq!(times(even(), &messages), (expected, 0));
        assert_eq!(times(even(), &[(5, 1, None)]), (vec![5], 0));
    }
}
