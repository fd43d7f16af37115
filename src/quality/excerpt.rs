//! What is wrong with a record that a verb works on, told from as much of it as may be kept.

use crate::recording::TimeAxis;
use crate::recording::moment::Moment;
use crate::warning::Warning;

/// Samples that are kept of a record that goes by as a stream, and looked at.
pub const OF_STREAM: usize = 1 << 16;
/// Samples that are looked at of a record that is gone through several times.
pub const OF_PASSES: usize = 1 << 18;

/// The record that an excerpt is from.
#[derive(Debug, Clone, Copy)]
pub struct Of<'a> {
    /// Name of the channel.
    pub name: &'a str,
    /// Unit in which its samples are said.
    pub unit: &'a str,
    /// That unit for each unit of the samples.
    pub scale: f64,
    /// Samples a second.
    pub rate_hz: f64,
    /// Time of the first sample.
    pub start: Moment,
    /// Samples in all.
    pub samples: usize,
}

/// The warnings of [`super::warnings`] about the first samples of a record; that it has more is said.
///
/// ```
/// use torqcomp::recording::moment::Moment;
/// use torqcomp::quality::excerpt::{Of, warnings};
/// let of = Of { name: "bridge", unit: "V", scale: 1e3, rate_hz: 1000.0, start: Moment::default(), samples: 5000 };
/// let samples: Vec<f64> = (0..1000).map(|i| (0.1 * f64::from(i)).sin().min(0.7) * 1e-3).collect();
/// let found = warnings(&samples, of);
/// assert_eq!(found[0].code, "clipped");
/// assert!(found[0].message.ends_with("(the first 1000 of 5000 samples were looked at)"));
/// ```
#[must_use]
pub fn warnings(samples: &[f64], of: Of) -> Vec<Warning> {
    let scaled: Vec<f64> = samples.iter().map(|sample| sample * of.scale).collect();
    let axis = TimeAxis::uniform(of.rate_hz, of.start);
    let mut found = super::warnings(of.name, of.unit, &scaled, &axis);
    if samples.len() < of.samples {
        let rest = format!(
            " (the first {} of {} samples were looked at)",
            samples.len(),
            of.samples
        );
        found
            .iter_mut()
            .for_each(|warning| warning.message += &rest);
    }
    found
}
