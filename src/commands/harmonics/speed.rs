//! Whether the speed changes over a record, which a fit of fixed frequencies cannot follow.

use torqcomp_dsp::harmonics::{Fundamental, refine_fundamental};
use torqcomp_dsp::store::SampleStore;

use crate::print::rounded;
use crate::recording::{Spool, UniformRecord};
use crate::warning::Warning;

/// Parts of the record whose speeds are compared.
const PARTS: usize = 4;
/// Most samples that are looked at in a part.
const MOST: usize = 1 << 15;
/// Fewest periods of the fundamental in a part.
const FEWEST: f64 = 8.0;
/// How far from the fundamental it is looked for, relative to it.
const SPAN: f64 = 0.05;
/// Difference of two speeds, in their standard uncertainties, that is none by chance.
const SIGNIFICANT: f64 = 5.0;
/// Turns that the highest order gains or loses over the record by a change that is worth saying.
const TURNS: f64 = 0.2;

/// A warning if the fundamental differs between the parts of a record by more than its uncertainty there, and by so much
/// that the highest order loses its phase.
pub(super) fn warning(
    record: &UniformRecord<Spool>,
    fundamental_hz: f64,
    orders: &[f64],
) -> Option<Warning> {
    let count = record.samples.count();
    let length = (count / PARTS).min(MOST);
    if (length as f64) * fundamental_hz < FEWEST * record.rate_hz {
        return None;
    }
    let part = |place: usize| {
        let start = place * (count - length) / (PARTS - 1);
        let samples = record.samples.part(start..start + length).ok()?;
        refine_fundamental(&samples, record.rate_hz, fundamental_hz, SPAN, orders).ok()
    };
    let found: Vec<Fundamental> = (0..PARTS).map(part).collect::<Option<_>>()?;
    let by_speed = |a: &&Fundamental, b: &&Fundamental| a.frequency_hz.total_cmp(&b.frequency_hz);
    let (slowest, fastest) = (
        found.iter().min_by(by_speed)?,
        found.iter().max_by(by_speed)?,
    );
    let change_hz = fastest.frequency_hz - slowest.frequency_hz;
    let std_hz = slowest.std_hz?.hypot(fastest.std_hz?);
    let duration_s = count as f64 / record.rate_hz;
    let highest = orders.iter().copied().fold(0.0, f64::max);
    let matters = change_hz > SIGNIFICANT * std_hz && change_hz * highest * duration_s > TURNS;
    matters.then(|| {
        Warning::new(
            "speed-changes",
            format!(
                "the fundamental changes over the record, from {} to {} Hz: the components are averages that come \
                 out too small, the more the higher their order; take a part of constant speed with --range",
                rounded(slowest.frequency_hz, 6),
                rounded(fastest.frequency_hz, 6)
            ),
        )
    })
}
