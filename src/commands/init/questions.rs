//! Questions of `init`, by source of data.

use torqcomp_model::Kind;

use super::range;

/// One entry of the file: its place, question and meaning.
pub(super) struct Question {
    pub(super) section: &'static str,
    pub(super) key: &'static str,
    /// The flag without its dashes.
    pub(super) flag: &'static str,
    /// Kind of its quantity; `None` if the unit or a list of words determines it.
    pub(super) kind: Option<Kind>,
    pub(super) example: &'static str,
    pub(super) meaning: &'static str,
    pub(super) is_needed: bool,
}

const fn needed(
    [section, key, flag]: [&'static str; 3],
    kind: Option<Kind>,
    example: &'static str,
    meaning: &'static str,
) -> Question {
    Question {
        section,
        key,
        flag,
        kind,
        example,
        meaning,
        is_needed: true,
    }
}

const fn optional(question: Question) -> Question {
    Question {
        is_needed: false,
        ..question
    }
}

pub(super) const MECHANICS: [Question; 2] = [
    optional(needed(
        ["mechanics", "natural_frequency", "natural-frequency"],
        Some(Kind::Frequency),
        "590 Hz",
        "at which the stand rings",
    )),
    optional(needed(
        ["mechanics", "damping_ratio", "damping-ratio"],
        Some(Kind::Ratio),
        "0.02",
        "2 % is 0.02",
    )),
];

pub(super) const TRANSDUCER: [Question; 5] = [
    needed(
        ["calibration", "sensitivity", "sensitivity"],
        None,
        "2 mV/V",
        "change of the output from no load to rated torque; also in V, mA or Hz",
    ),
    needed(
        ["calibration", "rated_torque", "rated-torque"],
        Some(Kind::Torque),
        "50 N m",
        "torque for this change",
    ),
    EXCITATION,
    GAIN,
    ZERO,
];

pub(super) const BRIDGE: [Question; 5] = [
    optional(needed(
        ["calibration", "torque_per_ratio", "torque-per-ratio"],
        Some(Kind::TorquePerRatio),
        "25 N m/(mV/V)",
        "torque per bridge output over excitation",
    )),
    optional(needed(
        ["calibration", "torque_per_volt", "torque-per-volt"],
        Some(Kind::TorquePerVolt),
        "12.5 N m/V",
        "torque per recorded volt",
    )),
    EXCITATION,
    GAIN,
    ZERO,
];

pub(super) const DRAWING: [Question; 12] = [
    length("width", "20 mm", "across the force"),
    length("depth", "10 mm", "along the force"),
    length("length", "200 mm", "from the clamp to the stator"),
    needed(
        ["beam", "elastic_modulus", "elastic-modulus"],
        Some(Kind::Pressure),
        "200 GPa",
        "200 GPa for steel, 70 GPa for aluminium",
    ),
    length(
        "radius",
        "100 mm",
        "from the shaft to where the beam meets the stator",
    ),
    needed(
        ["beam", "gage_position", "gage-position"],
        Some(Kind::Length),
        "50 mm",
        "distance of the gage from the clamp",
    ),
    needed(
        ["gage", "gage_factor", "gage-factor"],
        Some(Kind::Ratio),
        "2.05",
        "from the gage's data sheet",
    ),
    needed(
        ["gage", "resistance", "gage-resistance"],
        Some(Kind::Resistance),
        "350 ohm",
        "of one gage",
    ),
    needed(
        ["bridge", "layout", "layout"],
        None,
        "full",
        "quarter, half, half-opposite or full",
    ),
    EXCITATION,
    GAIN,
    ZERO,
];

const EXCITATION: Question = optional(needed(
    ["bridge", "excitation", "excitation"],
    Some(Kind::Voltage),
    "5 V",
    "supply of the bridge; needed to convert between volts and mV/V",
));
const GAIN: Question = optional(needed(
    ["recorder", "gain", "gain"],
    Some(Kind::Gain),
    "200",
    "recorded volts per bridge volt; needed to convert between volts and mV/V",
));
const ZERO: Question = optional(needed(
    ["recorder", "zero", "zero"],
    None,
    "12 mA",
    "record at no load, in the unit of the record",
));

const fn length(key: &'static str, example: &'static str, meaning: &'static str) -> Question {
    needed(["beam", key, key], Some(Kind::Length), example, meaning)
}

impl Question {
    pub(super) fn text(&self) -> String {
        let skip = if self.is_needed {
            ""
        } else {
            "; Enter to skip"
        };
        format!(
            "{} ({}), such as {}{skip}",
            self.key.replace('_', " "),
            self.meaning,
            self.example
        )
    }

    /// Whether the file accepts its standard uncertainty.
    pub(super) fn has_std(&self) -> bool {
        !matches!(self.key, "layout" | "zero" | "resistance")
    }

    pub(super) fn std_text(&self) -> String {
        format!(
            "standard uncertainty of the {}, in its unit or in % (for a limit, divide by 1.73); Enter if unknown",
            self.key.replace('_', " ")
        )
    }

    /// Checks the standard uncertainty of the given value.
    pub(super) fn check_std(&self, answer: &str, value: &str) -> Result<(), String> {
        match (answer, self.kind) {
            ("", _) | (_, None) => Ok(()),
            (text, Some(kind)) => kind
                .parse_std(text, value)
                .map(|_| ())
                .map_err(|error| error.to_string()),
        }
    }

    pub(super) fn check(&self, answer: &str) -> Result<(), String> {
        if let Some(advice) = range::advice(answer) {
            return Err(advice);
        }
        match (answer, self.kind) {
            ("", _) if self.is_needed => Err(format!("required, such as {}", self.example)),
            ("", _) | (_, None) => Ok(()),
            (text, Some(kind)) => kind
                .parse(text)
                .map(|_| ())
                .map_err(|error| error.to_string()),
        }
    }
}
