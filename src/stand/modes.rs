//! `[[modes]]`: the response of the stand as a sum of modes.

use std::f64::consts::TAU;

use torqcomp_model::{Estimate, Kind, ModalPart, Mode};

use super::mechanics::refuse_bare_rate;
use super::section::Section;
use crate::failure::Failure;
use crate::identify::MODE_NUMBERS;

/// Keys of the correlation coefficients of a mode's numbers, and the indices of both numbers in its list
/// of keys.
pub const MODE_CORRELATIONS: [(&str, [usize; 2]); 6] = [
    ("correlation_frequency_damping", [0, 1]),
    ("correlation_frequency_residue", [0, 2]),
    ("correlation_damping_residue", [1, 2]),
    ("correlation_frequency_quadrature", [0, 3]),
    ("correlation_damping_quadrature", [1, 3]),
    ("correlation_residue_quadrature", [2, 3]),
];

/// A mode as given in the stand file.
#[derive(Debug, Clone)]
pub struct DeclaredMode {
    /// Those of [`MODE_NUMBERS`], the frequency in Hz.
    values: [f64; 4],
    stds: [Option<f64>; 4],
    /// In the order of [`MODE_CORRELATIONS`].
    correlations: [f64; 6],
    /// Its contribution to the displacement of the gage by a torque at the gage, if known.
    at_gage: Option<f64>,
    /// Whether its contributions follow from its mode shape at load and gage.
    has_shape: bool,
}

/// A mode as read, before its contribution is normalised.
struct ReadMode<'a> {
    section: &'a Section<'a>,
    mode: DeclaredMode,
    /// Its mode shape at the load and at the gage, instead of a residue.
    shape: Option<[Estimate; 2]>,
}

/// Parses all modes.
pub(super) fn declared_modes(sections: &[Section]) -> Result<Vec<DeclaredMode>, Failure> {
    let mut read: Vec<ReadMode> = sections
        .iter()
        .map(ReadMode::of)
        .collect::<Result<_, _>>()?;
    let with_shape = read.iter().filter(|mode| mode.shape.is_some()).count();
    if with_shape > 0 {
        if let Some(other) = read.iter().find(|mode| mode.shape.is_none()) {
            return Err(other.section.fail(
                "residue",
                "other modes have shape_at_load and shape_at_gage; give all modes in the same way, as residues are \
                 fractions of the static response and shapes have their own scale",
            ));
        }
        by_shapes(&mut read)?;
    } else {
        by_residues(&mut read);
    }
    Ok(read.into_iter().map(|read| read.mode).collect())
}

/// `r_k = φ_k(load) φ_k(gage)/ω_k²` and `g_k = φ_k(gage)²/ω_k²`, normalised by their sums over all
/// modes.
fn by_shapes(read: &mut [ReadMode]) -> Result<(), Failure> {
    let mut parts = Vec::new();
    for mode in &*read {
        let [load, gage] = mode
            .shape
            .as_ref()
            .map_or([0.0; 2], |s| [s[0].value(), s[1].value()]);
        let square = mode.mode.values[0].powi(2);
        parts.push([load * gage / square, gage * gage / square]);
    }
    let [residues, at_gage] = [0, 1].map(|k| parts.iter().map(|part| part[k]).sum::<f64>());
    if residues == 0.0 || !residues.is_finite() {
        return Err(read[0].section.fail(
            "shape_at_load",
            "with these shapes a static torque does not reach the gage (the sum of shape_at_load × shape_at_gage over \
             the square of the frequency is zero)",
        ));
    }
    for (mode, part) in read.iter_mut().zip(parts) {
        mode.mode.values[2] = part[0] / residues;
        mode.mode.at_gage = Some(part[1] / at_gage);
        mode.mode.has_shape = true;
        let scale = mode.mode.values[0].powi(2) * residues;
        let stds = mode.shape.as_ref().map(|[load, gage]| {
            let part = |a: &Estimate, b: &Estimate| Some(a.std_uncertainty()? * b.value() / scale);
            [part(load, gage), part(gage, load)]
        });
        let both = stds.into_iter().flatten().flatten();
        mode.mode.stds[2] = both.reduce(f64::hypot).map(f64::abs);
    }
    Ok(())
}

/// If no residue is negative, load and gage count as one place; a gage elsewhere needs mode shapes.
fn by_residues(read: &mut [ReadMode]) {
    let sum: f64 = read.iter().map(|mode| mode.mode.values[2]).sum();
    if sum > 0.0 && read.iter().all(|mode| mode.mode.values[2] >= 0.0) {
        for mode in read {
            mode.mode.at_gage = Some(mode.mode.values[2] / sum);
        }
    }
}

impl<'a> ReadMode<'a> {
    fn of(section: &'a Section) -> Result<Self, Failure> {
        refuse_bare_rate(section)?;
        let frequency = section.positive("natural_frequency", Kind::Frequency)?;
        let damping = section.not_negative("damping_ratio", Kind::Ratio)?;
        let residue = section.quantity("residue", Kind::Ratio)?;
        let quadrature = section.quantity("quadrature", Kind::Ratio)?;
        let shape = [
            section.quantity("shape_at_load", Kind::Ratio)?,
            section.quantity("shape_at_gage", Kind::Ratio)?,
        ];
        let mut correlations = [0.0; 6];
        for ((key, _), value) in MODE_CORRELATIONS.into_iter().zip(&mut correlations) {
            *value = section.correlation(key)?;
        }
        // The source is informative only.
        let _ = section.text("source")?;
        section.finish()?;
        let shape = match (residue.is_some(), shape) {
            (true, [None, None]) => None,
            (false, [Some(load), Some(gage)]) => Some([load, gage]),
            (true, _) => {
                return Err(section.fail(
                    "residue",
                    "shape_at_load and shape_at_gage give the residue, too; keep one of them",
                ));
            }
            (false, _) => return Err(section.fail("", NO_RESIDUE)),
        };
        let number = |estimate: &Option<Estimate>| estimate.as_ref().map_or(0.0, Estimate::value);
        let std =
            |estimate: &Option<Estimate>| estimate.as_ref().and_then(Estimate::std_uncertainty);
        let mode = DeclaredMode {
            values: [
                frequency.value(),
                damping.value(),
                number(&residue),
                number(&quadrature),
            ],
            stds: [
                frequency.std_uncertainty(),
                damping.std_uncertainty(),
                std(&residue),
                std(&quadrature),
            ],
            correlations,
            at_gage: None,
            has_shape: false,
        };
        Ok(Self {
            section,
            mode,
            shape,
        })
    }
}

/// Message for a mode with frequency and damping only.
const NO_RESIDUE: &str = "residue is missing: the fraction of this mode in the static response, as in residue = 0.9; a \
    decay does not give it: determine it by identify response with a known torque or force, or give shape_at_load and \
    shape_at_gage of all modes. If only one of the modes is the stand's, repeat identify decay with --modes 1";

impl DeclaredMode {
    /// The mode and the index within it of a number, from its index among the numbers of all modes.
    pub(super) fn place(of_all: usize) -> (usize, usize) {
        (of_all / MODE_NUMBERS.len(), of_all % MODE_NUMBERS.len())
    }

    /// Its contribution to the response.
    pub(super) fn part(&self) -> ModalPart {
        let [frequency_hz, damping_ratio, residue, quadrature] = self.values;
        ModalPart {
            mode: Mode {
                omega_rad_s: TAU * frequency_hz,
                damping_ratio,
            },
            residue,
            quadrature,
            at_gage: self.at_gage,
        }
    }

    /// Whether its contributions follow from its mode shape at load and gage.
    pub fn has_shape(&self) -> bool {
        self.has_shape
    }

    /// Standard uncertainties of its numbers.
    pub(super) fn stds(&self) -> [Option<f64>; 4] {
        self.stds
    }

    /// Correlation coefficient of the errors of two of its numbers.
    pub(super) fn correlation(&self, i: usize, k: usize) -> f64 {
        let both = MODE_CORRELATIONS.iter().zip(self.correlations);
        let found = both.filter(|((_, pair), _)| *pair == [i.min(k), i.max(k)]);
        found.map(|(_, value)| value).sum()
    }

    /// All modes with one number of one of them, by its index among those of all, changed by a multiple of its standard
    /// uncertainty. Residues that follow from mode shapes change with the frequency, and add up to 1 again.
    pub(super) fn all_moved(modes: &[Self], of_all: usize, by: f64) -> Option<Vec<Self>> {
        let (place, number) = Self::place(of_all);
        let mut moved = modes.to_vec();
        let mode = &mut moved[place];
        let before_hz = mode.values[0];
        mode.values[number] += by * mode.stds[number]?;
        if mode.has_shape {
            mode.values[2] *= (before_hz / mode.values[0]).powi(2);
            let sum: f64 = moved.iter().map(|mode| mode.values[2]).sum();
            for mode in &mut moved {
                mode.values[2] /= sum;
            }
        }
        Some(moved)
    }
}

#[cfg(test)]
mod tests {
    use crate::stand::{Stand, parse};

    fn read(modes: &str) -> Result<Stand, String> {
        let text = format!("schema = \"torqcomp.stand/1\"\n{modes}");
        parse("s.toml", &text).map_err(|failure| failure.to_string())
    }

    /// A mode at 100 Hz and one at 200 Hz, with additional lines.
    fn two(first: &str, second: &str) -> String {
        let mode = |hz, more| {
            format!("[[modes]]\nnatural_frequency = \"{hz} Hz\"\ndamping_ratio = 0.01\n{more}\n")
        };
        mode(100, first) + &mode(200, second)
    }

    #[test]
    fn residues_are_parts_of_the_response_at_rest() {
        let stand = read(&two("residue = 0.9", "residue = 0.06")).unwrap();
        let modes = stand.modes().unwrap();
        assert!((modes.residual() - 0.04).abs() < 1e-15);
        // Load and gage in the same place: 0.9 of 0.96.
        assert!((modes.parts()[0].at_gage.unwrap() - 0.9375).abs() < 1e-15);
        assert!(stand.warnings.is_empty());
    }

    /// φ φ/f²: 2·1/1 and −2·2/4 are 2 and −1, normalised by 1; at the gage 1/1 and 4/4.
    #[test]
    fn shapes_give_residues_and_what_a_torque_at_the_gage_does() {
        let text = two(
            "shape_at_load = 2\nshape_at_gage = 1",
            "shape_at_load = -2\nshape_at_gage = 2",
        );
        let modes = read(&text).unwrap().modes().unwrap();
        let got: Vec<_> = modes
            .parts()
            .iter()
            .map(|p| (p.residue, p.at_gage))
            .collect();
        assert_eq!(got, [(2.0, Some(0.5)), (-1.0, Some(0.5))]);
    }

    /// A single mode carries all of the static response, whatever its shape.
    #[test]
    fn uncertain_shapes_of_one_mode_do_not_matter() {
        let text = "[[modes]]\nnatural_frequency = \"100 Hz\"\ndamping_ratio = 0.01\n\
                    shape_at_load = { value = 2, std = 0.02 }\nshape_at_gage = { value = 1, std = 0.02 }\n";
        let std = read(text).unwrap().inverse_uncertainty(150.0).unwrap();
        assert!(std.magnitude_relative < 1e-12, "{std:?}");
    }

    /// `r₁ = a/(a + b)` with `a = 2·1/1`, `b = 1·2/4`, and a standard uncertainty of `a` of 1 %: `r₁` is 0.8 and changes
    /// by `0.8 · 0.2 · 1 %`, `r₂` by as much the other way. At 150 Hz without damping, `H = r₁/(1 − 2.25) + r₂/(1 −
    /// 0.5625)` is −0.64 + 0.457143.
    #[test]
    fn uncertain_shapes_of_two_modes_shift_the_response_between_them() {
        let text = two(
            "shape_at_load = { value = 2, std = 0.02 }\nshape_at_gage = 1",
            "shape_at_load = 1\nshape_at_gage = 2",
        )
        .replace("0.01", "0.0");
        let std = read(&text).unwrap().inverse_uncertainty(150.0).unwrap();
        let expected = 0.0016 * (1.0 / 1.25 + 1.0 / 0.4375) / (0.64 - 0.457_143);
        let relative = std.magnitude_relative / expected;
        assert!((relative - 1.0).abs() < 1e-4, "{std:?}, {expected}");
    }

    #[test]
    fn mistakes_are_named_with_their_place() {
        let refused = |text: &str, parts: &[&str]| {
            let message = read(text).unwrap_err();
            let missing = parts.iter().find(|part| !message.contains(**part));
            assert!(missing.is_none(), "{message}: {missing:?}");
        };
        refused(
            &two("residue = 0.9", ""),
            &["line 6", "residue is missing", "identify response"],
        );
        refused(
            &two("residue = 0.9", "shape_at_load = 1\nshape_at_gage = 1"),
            &["line 5", "same way"],
        );
        refused(
            &two("residue = 0.9\nshape_at_load = 1", "residue = 1"),
            &["line 5", "keep one"],
        );
        refused(
            &two("residue = 0.9", "residu = 0.1"),
            &["line 9", "did you mean"],
        );
        refused(
            &two(
                "residue = 0.9\ncorrelation_damping_residue = 2",
                "residue = 0.1",
            ),
            &["line 6", "-1 to 1"],
        );
        let beside = format!(
            "[mechanics]\nstiffness = \"1 N m/rad\"\n{}",
            two("residue = 1", "residue = 0")
        );
        refused(&beside, &["line 3", "[[modes]]"]);
    }

    #[test]
    fn residues_that_hardly_are_parts_of_one_are_told() {
        let stand = read(&two("residue = 3e-5", "residue = 1e-6")).unwrap();
        assert_eq!(stand.warnings[0].code, "residues-do-not-add-up");
    }

    #[test]
    fn torques_need_the_shapes_where_residues_have_both_signs() {
        let effect =
            "[[effects]]\nkind = \"coulomb-friction\"\nform = \"sharp\"\ntorque = \"5 N m\"\n";
        let mixed = two("residue = 1.2", "residue = -0.2") + effect;
        let message = read(&mixed).unwrap().chain().unwrap_err().to_string();
        assert!(message.contains("shape_at_gage"), "{message}");
        let same = two("residue = 0.8", "residue = 0.2") + effect;
        assert!(read(&same).unwrap().chain().is_ok());
    }
}
