//! Faults of a record used by a command, from as much of it as is kept.

use torqcomp_dsp::quality::streamed::Faults;

use super::samples::Findings;
use crate::recording::TimeAxis;
use crate::recording::moment::Moment;
use crate::warning::Warning;

/// Samples kept of a streamed record.
pub const OF_STREAM: usize = 1 << 16;
/// Samples used of a record that is read several times.
pub const OF_PASSES: usize = 1 << 18;

/// The record of an excerpt.
#[derive(Debug, Clone, Copy)]
pub struct Of<'a> {
    /// Name of the channel.
    pub name: &'a str,
    /// Unit in which its samples are reported.
    pub unit: &'a str,
    /// Number of these units per unit of the samples.
    pub scale: f64,
    /// Sampling rate in Hz.
    pub rate_hz: f64,
    /// Time of the first sample.
    pub start: Moment,
    /// Total number of samples.
    pub samples: usize,
    /// Clipping, standstills and spikes in all samples.
    pub faults: Faults,
}

/// The warnings of [`super::warnings`] about the first samples of a record, with clipping, standstills and spikes in
/// all of it; the other warnings mention that the record is longer.
///
/// ```
/// use torqcomp::recording::moment::Moment;
/// use torqcomp::quality::excerpt::{Of, warnings};
/// use torqcomp_dsp::quality::streamed::StreamedFaults;
/// let mut samples: Vec<f64> = (0..5000).map(|i| (5.0 + (0.1 * f64::from(i)).sin()) * 1e-3).collect();
/// samples[3000..3010].fill(0.0);
/// let mut faults = StreamedFaults::default();
/// faults.push(&samples);
/// let faults = faults.finish();
/// let of = Of { name: "bridge", unit: "mV", scale: 1e3, rate_hz: 1e3, start: Moment::default(), samples: 5000, faults };
/// let found = warnings(&samples[..1000], of);
/// assert_eq!((found.len(), found[0].code), (1, "stuck-channel"));
/// assert!(found[0].message.contains("10 samples at 0 mV, starting at 3 s"), "{}", found[0].message);
/// ```
pub fn warnings(samples: &[f64], of: Of) -> Vec<Warning> {
    let scaled: Vec<f64> = samples.iter().map(|sample| sample * of.scale).collect();
    let axis = TimeAxis::uniform(of.rate_hz, of.start);
    let faults = of.faults.scaled(of.scale);
    let findings = Findings::of(&scaled, axis.rate_hz).with(&faults);
    let mut found = super::of_findings(of.name, of.unit, findings, &axis);
    if samples.len() < of.samples {
        let rest = format!(
            " (the first {} of {} samples were checked)",
            samples.len(),
            of.samples
        );
        let in_all = |warning: &Warning| match warning.code {
            "clipped" => faults.clipping.is_some(),
            code => matches!(code, "stuck-channel" | "spikes"),
        };
        let of_first = found.iter_mut().filter(|warning| !in_all(warning));
        of_first.for_each(|warning| warning.message += &rest);
    }
    found
}
