//! `--torque-factor`: torque or force per unit of a channel.

use torqcomp_model::{Dimension, Unit};

use crate::failure::{ErrorCode, Failure};
use crate::unit::RecordedChannel;

/// `"35.15 N/V"`: SI units of torque or force per number of the channel, and their dimension. A channel without a known
/// unit is in the unit of the factor; `unit_flag` gives another one.
pub(super) fn factor_of(
    text: &str,
    (channel, unit_flag): (RecordedChannel, &str),
) -> Result<(f64, Dimension), Failure> {
    let wrong = || {
        ErrorCode::InvalidValue.usage(format_args!(
            "--torque-factor {text}: expected a number, a unit of torque or force, and \"/\" the unit of \
             the channel, such as \"35.15 N/V\""
        ))
    };
    let (number, units) = text.trim().split_once(' ').ok_or_else(wrong)?;
    let number: f64 = number.parse().map_err(|_| wrong())?;
    let (effort, per) = units.rsplit_once('/').ok_or_else(wrong)?;
    let [effort, per] = [effort, per].map(|text| Unit::parse(text).map_err(|_| wrong()));
    let (effort, per) = (effort?, per?);
    if !number.is_finite() || number == 0.0 {
        return Err(wrong());
    }
    let scale = match channel.unit {
        Some(of) if of.unit.dimension() != per.dimension() => {
            return Err(ErrorCode::UnitUnsuitable.failed(format_args!(
                "--torque-factor {text} does not match channel \"{}\", which is in {}; give torque or force per \
                 {}, or {unit_flag} if the channel is in another unit",
                channel.name, of.text, of.text
            )));
        }
        Some(of) => of.unit.factor() / per.factor(),
        None => 1.0,
    };
    Ok((number * scale * effort.factor(), effort.dimension()))
}
