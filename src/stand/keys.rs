//! Every key of a stand file, with its type and meaning. [`Section`](super::section::Section) accepts no other, and
//! `docs/stand-keys.md` is generated from this list.

use torqcomp_model::Kind;

/// Type of a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Takes {
    /// A text.
    Text,
    /// One of several words.
    Word,
    /// A whole number.
    Whole,
    /// A quantity with its unit.
    Quantity(Kind),
    /// A quantity whose unit follows from the record.
    RecordQuantity,
    /// A section of its own.
    Section,
}

/// A key, its type, and its meaning.
pub(crate) type StandKey = (&'static str, Takes, &'static str);

/// A section as written (empty for the top level of the file), its meaning, and its keys.
pub(crate) type StandSection = (&'static str, &'static str, &'static [StandKey]);

/// Type of a key in a section.
pub(crate) fn takes(title: &str, name: &str) -> Option<Takes> {
    let (_, _, keys) = SECTIONS.iter().find(|section| section.0 == title)?;
    let (_, takes, _) = keys.iter().find(|key| key.0 == name)?;
    Some(*takes)
}

/// A conversion to the value of a key.
type Convert = fn(f64) -> f64;

/// Keys also known by other names, with the conversion from those.
const OTHER_TERMS: [(&str, &[&str], Convert); 3] = [
    (
        "damping_ratio",
        &["Q", "q_factor", "q_value", "quality_factor", "quality"],
        |q| 0.5 / q,
    ),
    (
        "damping_ratio",
        &["log_decrement", "logarithmic_decrement", "decrement"],
        |d| d / d.hypot(std::f64::consts::TAU),
    ),
    ("damping_ratio", &["loss_factor"], |eta| 0.5 * eta),
];

/// Conversion to a key from a value under another name.
pub(super) fn from_other_term(key: &str, name: &str) -> Option<Convert> {
    let is_it = |(of, names, _): &&(&str, &[&str], Convert)| {
        *of == key && names.iter().any(|known| known.eq_ignore_ascii_case(name))
    };
    OTHER_TERMS
        .iter()
        .find(is_it)
        .map(|(_, _, convert)| *convert)
}

use Takes::{Quantity, RecordQuantity, Section, Text, Whole, Word};

/// All sections, in the usual order of a stand file.
#[rustfmt::skip]
pub(crate) const SECTIONS: &[StandSection] = &[
    ("", "Identification of the file, and its sections.", &[
        ("schema", Text, "`\"torqcomp.stand/1\"`; required"),
        ("name", Text, "name of the stand"),
        ("mechanics", Section, "response of the stand"),
        ("modes", Section, "modes of the stand instead of a single response, one section each"),
        ("calibration", Section, "measured calibration"),
        ("beam", Section, "drawing of the beam"),
        ("parts", Section, "parts that make up the inertia, one section each"),
        ("friction", Section, "friction over speed, for the damping"),
        ("gage", Section, "strain gage"),
        ("bridge", Section, "bridge and its wiring"),
        ("recorder", Section, "amplifier and recorder"),
        ("effects", Section, "effects that the plain stand lacks, one section each"),
        ("diagnosed", Section, "written by `diagnose -o` about the diagnosis"),
    ]),
    ("[mechanics]", "`J θ'' + f θ' + K θ = T`, as inertia, damping and stiffness, or as natural frequency and damping ratio.", &[
        ("inertia", Quantity(Kind::Inertia), "`J`"),
        ("damping", Quantity(Kind::AngularDamping), "`f`"),
        ("stiffness", Quantity(Kind::AngularStiffness), "`K`"),
        ("common_std", Quantity(Kind::Ratio), "relative standard uncertainty common to these three, as when two follow \
            from a declared third (`identify` and `diagnose` write it); the `std` of each includes it, and it cancels \
            in the response"),
        ("correlation_inertia_damping", Quantity(Kind::Ratio), "correlation coefficient between the errors of inertia and damping, -1 to 1; 0 by default (`identify response` writes it)"),
        ("correlation_inertia_stiffness", Quantity(Kind::Ratio), "likewise between the errors of inertia and stiffness"),
        ("correlation_damping_stiffness", Quantity(Kind::Ratio), "likewise between the errors of damping and stiffness"),
        ("natural_frequency", Quantity(Kind::Frequency), "`√(K/J)/2π`, in place of the three"),
        ("damping_ratio", Quantity(Kind::Ratio), "`f/(2 √(K J))`, with `natural_frequency`"),
        ("static_gain", RecordQuantity, "static ratio of recorded to applied quantity, `\"1 V/V\"` or `\"2.5 mV/N\"`, \
            for stands that do not measure torque; with `natural_frequency` or `[[modes]]` only"),
        ("measures", Word, "`displacement` (default, or the torque of the beam), `speed` or `acceleration`: what is recorded; `static_gain` is then that of the displacement, with the unit of the record, as in `\"3e-7 (m/s^2)/N\"`"),
    ]),
    ("[[modes]]", "A mode of the stand, in place of the keys of `[mechanics]` above: the response is the sum of `(r + q s/ω) ω²/(s² + 2ζω s + ω²)` over all modes. The remainder, 1 − Σ r, is the compliance of the modes above the band.", &[
        ("natural_frequency", Quantity(Kind::Frequency), "`ω/2π`"),
        ("damping_ratio", Quantity(Kind::Ratio), "`ζ`"),
        ("residue", Quantity(Kind::Ratio), "`r`: its fraction of the static response"),
        ("quadrature", Quantity(Kind::Ratio), "`q`: the part proportional to the speed; 0 by default"),
        ("shape_at_load", Quantity(Kind::Ratio), "instead of `residue`, for all modes: mode shape where the torque \
            acts, of modes of unit modal mass in any common scale"),
        ("shape_at_gage", Quantity(Kind::Ratio), "likewise at the gage"),
        ("correlation_frequency_damping", Quantity(Kind::Ratio), "correlation coefficient between the errors of frequency and damping, -1 to 1; 0 by default (`identify response` writes it)"),
        ("correlation_frequency_residue", Quantity(Kind::Ratio), "likewise between the errors of frequency and residue"),
        ("correlation_damping_residue", Quantity(Kind::Ratio), "likewise between the errors of damping and residue"),
        ("correlation_frequency_quadrature", Quantity(Kind::Ratio), "likewise between the errors of frequency and quadrature"),
        ("correlation_damping_quadrature", Quantity(Kind::Ratio), "likewise between the errors of damping and quadrature"),
        ("correlation_residue_quadrature", Quantity(Kind::Ratio), "likewise between the errors of residue and quadrature"),
        ("source", Text, "where the numbers come from (informative)"),
    ]),
    ("[calibration]", "A measured calibration, in one of six forms; it replaces gage, bridge and recorder gain. The `std` of each quantity enters the stated uncertainty.", &[
        ("torque_per_volt", Quantity(Kind::TorquePerVolt), "torque per volt as recorded"),
        ("torque_per_ratio", Quantity(Kind::TorquePerRatio), "torque per bridge output over excitation"),
        ("sensitivity", RecordQuantity, "change of the output from no load to `rated_torque`, with its sign: `\"2.0012 mV/V\"`, `\"10 V\"`, `\"8 mA\"` or `\"30 kHz\"`"),
        ("rated_torque", Quantity(Kind::Torque), "torque of `sensitivity` or `frequency_at_rated`; with another form \
            the transducer's rated torque. A result beyond 1.5 times it causes a warning"),
        ("at_torque", Quantity(Kind::Torque), "torque of `sensitivity` or `frequency_at_rated` if it is not the rated one, as from known loads"),
        ("zero_frequency", Quantity(Kind::Frequency), "output at no load of a transducer with frequency output"),
        ("frequency_at_rated", Quantity(Kind::Frequency), "its output at `rated_torque`"),
        ("lever_arm", Quantity(Kind::Length), "distance from the shaft at which a recorded force acts"),
        ("points", Section, "a table of points, interpolated linearly, and extrapolated by 20 % of its range"),
        ("degree", Whole, "1, 2 or 3: degree of a least-squares polynomial through the points"),
    ]),
    ("[[calibration.points]]", "A point of the calibration, also written `points = [{ reading = \"1 mV/V\", torque = \"25 N m\" }, …]`.", &[
        ("reading", RecordQuantity, "output in V, mV/V, mA, Hz, ustrain or N"),
        ("torque", Quantity(Kind::Torque), "torque that gave it"),
        ("std", Quantity(Kind::Torque), "its standard uncertainty"),
    ]),
    ("[beam]", "The beam and where the gage sits on it.", &[
        ("section", Word, "`rectangle` (default), `circle` or `tube`"),
        ("width", Quantity(Kind::Length), "of a rectangle, across the force"),
        ("depth", Quantity(Kind::Length), "of a rectangle, along the force"),
        ("diameter", Quantity(Kind::Length), "of a circle"),
        ("outer_diameter", Quantity(Kind::Length), "of a tube"),
        ("inner_diameter", Quantity(Kind::Length), "of a tube"),
        ("length", Quantity(Kind::Length), "from the clamp to the stator"),
        ("elastic_modulus", Quantity(Kind::Pressure), "Young's modulus"),
        ("radius", Quantity(Kind::Length), "from the shaft to where the beam meets the stator"),
        ("gage_position", Quantity(Kind::Length), "distance of the gage from the clamp"),
        ("shear_modulus", Quantity(Kind::Pressure), "adds shear (Timoshenko)"),
        ("shear_coefficient", Quantity(Kind::Ratio), "follows from the section unless given"),
        ("clamp_stiffness", Quantity(Kind::AngularStiffness), "stiffness of a compliant clamp; rigid by default"),
        ("thread", Section, "a threaded piece"),
    ]),
    ("[beam.thread]", "A threaded piece of the beam.", &[
        ("length", Quantity(Kind::Length), "of the thread"),
        ("root_diameter", Quantity(Kind::Length), "of the thread"),
        ("at", Word, "end of the beam: `stator` (default) or `clamp`"),
    ]),
    ("[[parts]]", "A part of the inertia.", &[
        ("kind", Word, "`thin-ring`, `disc`, `hollow-cylinder` or `point-mass`"),
        ("name", Text, "name of the part"),
        ("mass", Quantity(Kind::Mass), "mass"),
        ("radius", Quantity(Kind::Length), "of a thin ring or a disc, or distance of a point mass from the shaft"),
        ("inner_radius", Quantity(Kind::Length), "of a hollow cylinder"),
        ("outer_radius", Quantity(Kind::Length), "of a hollow cylinder"),
    ]),
    ("[friction]", "Slope of a friction force over speed, from which the damping is predicted.", &[
        ("force_change", Quantity(Kind::Force), "increase of the force"),
        ("speed_change", Quantity(Kind::AngularSpeed), "increase of the speed"),
        ("radius", Quantity(Kind::Length), "at which the force acts"),
    ]),
    ("[gage]", "`ΔR/R₀ = GF (T₀/T) ε + C₂ (T₀/T)² ε²`.", &[
        ("gage_factor", Quantity(Kind::Ratio), "`GF`"),
        ("quadratic_coefficient", Quantity(Kind::Ratio), "`C₂`; 0 (default) for metal foil"),
        ("resistance", Quantity(Kind::Resistance), "before bonding"),
        ("bonded_resistance", Quantity(Kind::Resistance), "after bonding: the prestrain follows"),
        ("reference_temperature", Quantity(Kind::TemperatureAbsolute), "`T₀`; 25 °C by default"),
        ("bonding_temperature", Quantity(Kind::TemperatureAbsolute), "at which the bonded resistance was measured; \
            `temperature` by default"),
        ("temperature", Quantity(Kind::TemperatureAbsolute), "`T`, that of use; `T₀` by default"),
        ("resistance_drift", Quantity(Kind::Ratio), "change of the unbonded resistance from bonding to use, as a fraction"),
    ]),
    ("[bridge]", "The bridge, its supply and its wires.", &[
        ("layout", Word, "`quarter`, `half`, `half-opposite`, `half-poisson`, `full` or `full-poisson`; not needed beside a `[calibration]`"),
        ("poisson_ratio", Quantity(Kind::Ratio), "for the two that need it"),
        ("excitation", Quantity(Kind::Voltage), "constant voltage; not needed for a record in mV/V"),
        ("excitation_current", Quantity(Kind::Current), "constant current, in place of `excitation`"),
        ("wiring", Word, "`two-wire`, `three-wire` or `four-wire`"),
        ("lead_resistance", Quantity(Kind::Resistance), "of one wire"),
    ]),
    ("[recorder]", "The amplifier and the recorder.", &[
        ("gain", Quantity(Kind::Gain), "recorded volts per bridge volt, also in dB; negative for an inverting amplifier; 1 if it is not given, with a warning where it matters"),
        ("zero", RecordQuantity, "record at no load, in V, mV/V, mA, Hz, ustrain or N; subtracted from any record in such a unit"),
        ("low_pass", Quantity(Kind::Frequency), "cut-off of a Butterworth low-pass"),
        ("low_pass_order", Whole, "1 (default, an RC low-pass) to 16"),
        ("delay", Quantity(Kind::Time), "time by which the record lags"),
        ("input_resistance", Quantity(Kind::Resistance), "resistance loading the bridge"),
    ]),
    ("[[effects]]", "Effects that the plain stand lacks, with the parameters of their kind and form: see \
        [effects.md](effects.md).", &[
        ("kind", Word, "name of the effect, such as `cubic-stiffness`; required"),
        ("form", Word, "its form; the first one by default"),
        ("source", Text, "where the parameters come from (informative)"),
    ]),
    ("[diagnosed]", "Written by `diagnose -o` about the records; `simulate` and `compensate` use the unit and the \
        constants.", &[
        ("applied_unit", Text, "unit of the applied quantity (informative)"),
        ("verdict", Text, "verdict of the diagnosis (informative)"),
        ("records", Text, "the records (informative)"),
        ("measured_unit", Text, "unit of the record"),
        ("offset", RecordQuantity, "constant in the record"),
        ("shift", RecordQuantity, "displacement by a constant load"),
    ]),
];
