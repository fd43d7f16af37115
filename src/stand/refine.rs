//! Writing the results of a diagnosis to a stand file.

use toml_edit::{ArrayOfTables, DocumentMut, InlineTable, Item, Table, value};
use torqcomp_decimal::digits;

use torqcomp_model::Estimate;

use super::update::{COMMON, CORRELATIONS, MODES, table_of};
use super::{Given, MODE_CORRELATIONS, Stand};
use crate::failure::{ErrorCode, Failure};
use crate::print::unit_of_quotient;

/// A parameter of an effect as written: name, value, and standard uncertainty.
pub type WrittenParameter<'a> = (&'a str, String, Option<String>);
/// An effect as written: kind, form, parameters.
pub type Written<'a> = (&'a str, &'a str, Vec<WrittenParameter<'a>>);

/// Results of a diagnosis.
pub struct Refined<'a> {
    /// Natural frequency in Hz, and its standard uncertainty.
    pub natural_hz: (f64, Option<f64>),
    /// Damping ratio, and its standard uncertainty.
    pub damping_ratio: (f64, Option<f64>),
    /// Fitted numbers of each mode of a stand with several, by the keys of its table.
    pub modes: Vec<Vec<(&'static str, Estimate)>>,
    /// Static gain, recorded per applied quantity, in SI units, if found, and its standard uncertainty.
    pub gain: Option<(f64, Option<f64>)>,
    /// Units of record and applied quantity in SI.
    pub units: (&'a str, &'a str),
    /// Unit of the record as given in its file.
    pub measured_unit: &'a str,
    /// Offset of the records, and displacement under a constant load, in SI units of the record.
    pub constants: [f64; 2],
    /// Effects: kind, form, parameters as text.
    pub effects: Vec<Written<'a>>,
    /// Origin of the numbers.
    pub source: String,
    /// Verdict of the diagnosis.
    pub verdict: &'a str,
}

impl Refined<'_> {
    /// Inertia `K/ω₀²` and damping `2ζK/ω₀` for a declared stiffness, with standard uncertainties from the stiffness
    /// and the fit.
    fn beside(&self, stiffness: &Estimate) -> [(f64, Option<f64>); 2] {
        let relative = |(value, std): (f64, Option<f64>)| std.map(|std| std / value);
        let omega = std::f64::consts::TAU * self.natural_hz.0;
        let common = stiffness.relative_std().unwrap_or(0.0);
        let frequency = relative(self.natural_hz);
        let inertia = stiffness.value() / (omega * omega);
        let damping = 2.0 * self.damping_ratio.0 * stiffness.value() / omega;
        let ratio = relative(self.damping_ratio).zip(frequency);
        [
            (inertia, frequency.map(|w| inertia * common.hypot(2.0 * w))),
            (
                damping,
                ratio.map(|(z, w)| damping * common.hypot(z).hypot(w)),
            ),
        ]
    }

    /// A quantity with its standard uncertainty and its source.
    fn quantity(&self, (number, std): (f64, Option<f64>), unit: &str) -> Item {
        let estimate = Estimate::of(unit.to_owned(), number, std);
        value(table_of(&estimate, Some(&self.source)))
    }

    fn write_mechanics(&self, document: &mut DocumentMut, declared: Option<&Stand>) {
        let given = declared.and_then(|stand| Some(&stand.mechanics.as_ref()?.given));
        let mechanics = document
            .entry("mechanics")
            .or_insert(Item::Table(Table::new()));
        if let Some(Given::Constants { stiffness, .. }) = given
            && self.gain.is_none()
        {
            // Torque over torque determines only ratios, so the stiffness stays as declared.
            let [inertia, damping] = self.beside(stiffness);
            mechanics["inertia"] = self.quantity(inertia, "kg m^2");
            mechanics["damping"] = self.quantity(damping, "N m s/rad");
            if let Some(table) = mechanics.as_table_like_mut() {
                table.remove(COMMON);
                for key in CORRELATIONS {
                    table.remove(key);
                }
            }
            if let Some(common) = stiffness.relative_std() {
                mechanics[COMMON] = value(digits::text(common, 9));
            }
            return;
        }
        const GAIN: &str = "static_gain";
        const MEASURES: &str = "measures";
        let [kept, measures] = [GAIN, MEASURES].map(|key| mechanics.get(key).cloned());
        let mut table = Table::new();
        if self.modes.is_empty() {
            table["natural_frequency"] = self.quantity(self.natural_hz, "Hz");
            table["damping_ratio"] = self.quantity(self.damping_ratio, "");
            document.remove(MODES);
        }
        if let Some(measures) = measures {
            table[MEASURES] = measures;
        }
        if let Some(gain) = self.gain {
            table[GAIN] = self.quantity(gain, &unit_of_quotient(self.units));
            document.remove("calibration");
        } else if let Some(kept) = kept {
            table[GAIN] = kept;
        }
        match table.is_empty() {
            true => drop(document.remove("mechanics")),
            false => document["mechanics"] = Item::Table(table),
        }
        self.write_modes(document);
    }

    /// Writes the fitted numbers of each mode to its table.
    fn write_modes(&self, document: &mut DocumentMut) {
        let tables = document
            .get_mut(MODES)
            .and_then(Item::as_array_of_tables_mut);
        let tables = tables.into_iter().flat_map(ArrayOfTables::iter_mut);
        for (table, mode) in tables.zip(&self.modes) {
            for (key, estimate) in mode {
                let number = (estimate.value(), estimate.std_uncertainty());
                table[*key] = self.quantity(number, estimate.unit());
            }
            for (key, _) in MODE_CORRELATIONS {
                table.remove(key);
            }
            table.remove("source");
        }
    }

    fn write_effects(&self, document: &mut DocumentMut) {
        document.remove("effects");
        let mut effects = ArrayOfTables::new();
        for (kind, form, parameters) in &self.effects {
            let mut table = Table::new();
            table["kind"] = value(*kind);
            table["form"] = value(*form);
            for (name, text, std) in parameters {
                table[*name] = match std {
                    None => value(text.as_str()),
                    Some(std) => {
                        let mut inline = InlineTable::new();
                        inline.insert("value", text.as_str().into());
                        inline.insert("std", std.as_str().into());
                        value(inline)
                    }
                };
            }
            table["source"] = value(self.source.as_str());
            effects.push(table);
        }
        if !effects.is_empty() {
            document["effects"] = Item::ArrayOfTables(effects);
        }
    }
}

/// The text of a stand file with the refined constants and the effects: the declared one with changes, or a
/// new one.
///
/// # Errors
/// If the declared text cannot be parsed again.
pub fn refine(declared: Option<(&Stand, &str)>, refined: &Refined) -> Result<String, Failure> {
    let text = declared.map_or(
        "schema = \"torqcomp.stand/1\"\nname = \"refined stand\"\n",
        |d| d.1,
    );
    let mut document: DocumentMut = text.parse().map_err(Failure::of(ErrorCode::InvalidStand))?;
    refined.write_mechanics(&mut document, declared.map(|d| d.0));
    refined.write_effects(&mut document);
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

/// The SI unit of the same dimension, as text; empty if none.
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
