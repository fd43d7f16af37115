//! Checks of the fundamental and its orders.

use torqcomp_dsp::harmonics::{Fundamental, Harmonics};

use super::rotation::Rotation;
use super::{
    ComponentTorque, WayBack, filtered, foreign::ForeignLines, level, multiple, named, speed,
    unexplained, unlisted,
};
use crate::print::short;
use crate::recording::UniformRecord;
use crate::warning::{Warning, WarningCode};

/// Warnings about the speed and the orders, and about components that are lost in noise.
pub(super) fn warnings(
    way: &WayBack,
    record: &UniformRecord,
    (fundamental, orders): (&Fundamental, &[f64]),
    (found, components): (&Harmonics, &[ComponentTorque]),
) -> Vec<Warning> {
    let given = Rotation {
        record,
        fundamental_hz: fundamental.frequency_hz,
        orders,
    };
    let orders = unlisted::shown(&given);
    let shown = Rotation {
        orders: &orders,
        ..given
    };
    let is_given = fundamental.std_hz.is_none();
    let foreign = ForeignLines::of(&shown, is_given);
    let kept = foreign.as_ref().map(|foreign| foreign.without(&orders));
    let kept = Rotation {
        orders: kept.as_deref().unwrap_or(&orders),
        ..given
    };
    let mut all = of_orders(way, is_given, &given, &kept);
    // Its place among the orders is that at the right speed.
    let is_off = all.iter().any(|warning| warning.code == "fundamental-off");
    let foreign = foreign.filter(|_| !is_off);
    all.extend(foreign.map(|foreign| foreign.warning(fundamental.frequency_hz)));
    let little = match all.is_empty() {
        true => unexplained::warning(&shown, found),
        false => None,
    };
    // Beside that, no component may be called zero.
    let lost = match little {
        Some(_) => None,
        None => lost_warning(components),
    };
    all.extend(little.into_iter().chain(lost));
    all
}

/// Checks that the speed is constant and as given, and that all orders are in the band of a compensated record; `shown` has
/// the requested orders and others that the record shows, without those beside other lines.
fn of_orders(way: &WayBack, is_given: bool, of: &Rotation, shown: &Rotation) -> Vec<Warning> {
    let load = speed::load_changes(of);
    // A load step leaves slow components that bias the speed slightly.
    let multiple = multiple::warning(of, |hz| way.inverse(hz).norm());
    let changing = match &multiple {
        Some(_) => None,
        None => speed::warning(shown),
    };
    let is_steady = |others: &[&Option<Warning>]| others.iter().all(|found| found.is_none());
    let sways = is_steady(&[&multiple, &changing])
        .then(|| speed::sways(shown))
        .flatten();
    // A speed that sways has no better mean.
    let off = (is_given && is_steady(&[&multiple, &sways]))
        .then(|| {
            let off = speed::off(shown, load.is_some());
            off.or_else(|| multiple::other_unit(of))
        })
        .flatten();
    let level = is_steady(&[&off, &changing, &sways])
        .then(|| level::warning(of))
        .flatten();
    let is_compensated = way.stand.is_none();
    let beyond = is_compensated.then(|| filtered::warning(of));
    let all = [
        multiple,
        off,
        changing,
        sways,
        level,
        load,
        beyond.flatten(),
    ];
    all.into_iter().flatten().collect()
}

fn lost_warning(components: &[ComponentTorque]) -> Option<Warning> {
    let lost: Vec<String> = components
        .iter()
        .filter(|c| c.torque < 2.0 * c.std)
        .map(|c| short(c.order))
        .collect();
    (!lost.is_empty()).then(|| {
        WarningCode::ComponentsLostInNoise.warning(format!(
            "below twice their own uncertainty, so they may be zero: {}",
            named(&lost)
        ))
    })
}
