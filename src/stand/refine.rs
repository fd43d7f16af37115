//! Writing what a diagnosis found into a stand file.

use toml_edit::{DocumentMut, Item, Table, value};

use super::{Given, Stand};
use crate::failure::Failure;
use crate::io::digits;

/// An effect as it is written: kind, form, parameters with their texts.
pub type Written<'a> = (&'a str, &'a str, Vec<(&'a str, String)>);

/// What a diagnosis found.
pub struct Refined<'a> {
    /// Natural frequency in Hz.
    pub natural_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Recorded per applied quantity at rest, in SI units, where it is part of the fit.
    pub gain: Option<f64>,
    /// Units of record and applied quantity in SI.
    pub units: (&'a str, &'a str),
    /// Unit of the record as its file gives it.
    pub measured_unit: &'a str,
    /// Constant in the records, and displacement by a constant load, in SI units of the record.
    pub constants: [f64; 2],
    /// Effects: kind, form, parameters with their texts.
    pub effects: Vec<Written<'a>>,
    /// Where the numbers come from.
    pub source: String,
    /// How the diagnosis ended.
    pub verdict: &'a str,
}

/// The text of a stand file with the refined constants and the effects: the declared one, changed where it was
/// refined, or a new one.
///
/// # Errors
/// If the declared text cannot be read again.
pub fn refine(declared: Option<(&Stand, &str)>, refined: &Refined) -> Result<String, Failure> {
    let text = declared.map_or(
        "schema = \"torqcomp.stand/1\"\nname = \"refined stand\"\n",
        |d| d.1,
    );
    let mut document: DocumentMut = text.parse().map_err(Failure::failed)?;
    let given = declared
        .and_then(|(stand, _)| stand.mechanics.as_ref())
        .map(|m| &m.given);
    let quantity = |number: f64, unit: &str| {
        let text = format!("{} {unit}", digits::text(number, 9));
        let mut table = toml_edit::InlineTable::new();
        table.insert("value", text.trim().into());
        table.insert("source", refined.source.as_str().into());
        value(table)
    };
    let omega = std::f64::consts::TAU * refined.natural_hz;
    let mechanics = document
        .entry("mechanics")
        .or_insert(Item::Table(Table::new()));
    match given {
        Some(Given::Constants { stiffness, .. }) if refined.gain.is_none() => {
            // Only ratios follow from torque against torque: the stiffness stays as declared.
            let k = stiffness.value();
            mechanics["inertia"] = quantity(k / (omega * omega), "kg m^2");
            mechanics["damping"] = quantity(2.0 * refined.damping_ratio * k / omega, "N m s/rad");
        }
        _ => {
            let mut table = Table::new();
            table["natural_frequency"] = quantity(refined.natural_hz, "Hz");
            table["damping_ratio"] = quantity(refined.damping_ratio, "");
            if let Some(gain) = refined.gain {
                let (recorded, applied) = refined.units;
                let one = |unit: &str| {
                    if unit.is_empty() {
                        "1".to_owned()
                    } else {
                        unit.to_owned()
                    }
                };
                let applied = if applied.contains([' ', '/']) {
                    format!("({applied})")
                } else {
                    one(applied)
                };
                let text = format!("{} {}/{applied}", digits::text(gain, 12), one(recorded));
                table["static_gain"] = value(text);
                document.remove("calibration");
            }
            document["mechanics"] = Item::Table(table);
        }
    }
    document.remove("effects");
    let mut effects = toml_edit::ArrayOfTables::new();
    for (kind, form, parameters) in &refined.effects {
        let mut table = Table::new();
        table["kind"] = value(*kind);
        table["form"] = value(*form);
        for (name, text) in parameters {
            table[*name] = value(text.as_str());
        }
        table["source"] = value(refined.source.as_str());
        effects.push(table);
    }
    if !effects.is_empty() {
        document["effects"] = Item::ArrayOfTables(effects);
    }
    let mut diagnosed = Table::new();
    diagnosed["measured_unit"] = value(refined.measured_unit);
    diagnosed["verdict"] = value(refined.verdict);
    for (key, number) in ["offset", "shift"].iter().zip(refined.constants) {
        let text = format!("{} {}", digits::text(number, 9), refined.units.0);
        diagnosed[*key] = value(text.trim());
    }
    document["diagnosed"] = Item::Table(diagnosed);
    Ok(document.to_string())
}

/// The SI unit of the same dimension as a unit, in text; empty for none.
#[must_use]
pub fn si_unit(text: &str) -> String {
    use torqcomp_model::{Kind, Unit, UnitSystem};
    let Ok(unit) = Unit::parse(text) else {
        return String::new();
    };
    let known = [
        Kind::Voltage,
        Kind::Torque,
        Kind::Force,
        Kind::Length,
        Kind::Acceleration,
        Kind::Angle,
    ];
    known
        .iter()
        .map(|kind| kind.unit(UnitSystem::Si))
        .find(|si| Unit::parse(si).is_ok_and(|si| si.dimension() == unit.dimension()))
        .map_or_else(|| text.to_owned(), str::to_owned)
}
