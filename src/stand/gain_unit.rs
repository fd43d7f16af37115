//! Whether a record has the unit of a static gain.

use torqcomp_decimal::digits;
use torqcomp_model::Unit;

use super::StaticGain;
use super::signal::TransducerSignal;
use crate::failure::{ErrorCode, Failure};
use crate::unit::NamedUnit;

/// Rejects a channel that is not recorded in the unit of the static gain of a stand file.
///
/// # Errors
/// If its unit is another one: that of the applied quantity, as with a gain written as its inverse, or any other.
pub(super) fn check(
    file: &str,
    channel: &str,
    named: &NamedUnit,
    gain: &StaticGain,
) -> Result<(), Failure> {
    let parse = |unit: &str| Unit::parse(unit).map_err(Failure::of(ErrorCode::UnitUnclear));
    let (over, under) = (parse(&gain.recorded_unit)?, parse(&gain.applied_unit)?);
    let (of_over, of_under) = (&gain.recorded_unit, &gain.applied_unit);
    let is_other = over.dimension() != named.unit.dimension();
    let recorded = &named.text;
    let why = if is_other && is_applied(&named.unit, &under) {
        let signal = TransducerSignal::of(&under);
        match signal.is_some_and(|signal| signal != TransducerSignal::Force) {
            true => format!(
                "the static_gain of {file} is in {of_over}/{of_under}, but \"{channel}\" is recorded in \"{recorded}\": a \
                 static gain is recorded over applied quantity; write the inverse, static_gain = \"{} \
                 {of_under}/{of_over}\"",
                digits::text(over.factor() / (under.factor() * gain.value), 6)
            ),
            false => format!(
                "\"{channel}\" is recorded in \"{recorded}\", already converted, but the static_gain of {file} is for a \
                 record in {of_over}: choose the channel in {of_over} with --channel, or compensate this one {}with \
                 static_gain = \"1 {of_under}/{of_under}\" in [mechanics]",
                match is_mass(&named.unit) {
                    true => "with --unit lbf, kgf or gf, and ",
                    false => "",
                }
            ),
        }
    } else if is_other || over.ratio_of() != named.unit.ratio_of() {
        format!(
            "the channel \"{channel}\" is in \"{recorded}\", but the static_gain of {file} expects \"{of_over}\"; choose \
             another channel, or say the unit with --unit"
        )
    } else {
        return Ok(());
    };
    Err(ErrorCode::UnitUnsuitable.failed(why))
}

/// Whether a record in a unit is one of an applied quantity; scales show a force as a mass.
fn is_applied(recorded: &Unit, applied: &Unit) -> bool {
    let is_force = TransducerSignal::of(applied) == Some(TransducerSignal::Force);
    recorded.dimension() == applied.dimension() || is_force && is_mass(recorded)
}

fn is_mass(unit: &Unit) -> bool {
    Unit::parse("kg").is_ok_and(|kilogram| kilogram.dimension() == unit.dimension())
}
