//! `table`: the inverse transfer function over frequency, Appendix D of the thesis for any stand.

use num_complex::Complex64;
use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_dsp::compensate::Inverse;

use super::{Outcome, conclude, publish};
use crate::cli::{self, Strictness};
use crate::failure::{ErrorCode, Failure};
use crate::identify::Motion;
use crate::print::{Report, rounded};
use crate::stand::{self, Mechanics, Stand};
use torqcomp_model::InverseUncertainty;

/// Maximum number of rows of a table.
const MOST_ROWS: f64 = 1e7;
/// Significant digits of the table.
const DIGITS: u32 = 10;

/// The inverse transfer function of a stand over frequency.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct TableReport {
    /// Path of the stand file.
    stand: String,
    /// The inverse transfer function, by frequency.
    rows: Vec<TableRow>,
    /// Whether the text has columns of uncertainties.
    #[serde(skip)]
    with_uncertainty: bool,
}

/// Applied over recorded torque at one frequency.
#[derive(Debug, Serialize, JsonSchema)]
struct TableRow {
    /// Frequency, in Hz.
    frequency_hz: f64,
    /// Applied over recorded torque.
    magnitude: f64,
    /// Phase lead of the applied torque over the recorded one, in degrees.
    phase_deg: f64,
    /// Relative standard uncertainty of the magnitude, to second order in the constants; `null` if unknown.
    magnitude_relative_std: Option<f64>,
    /// Standard uncertainty of the phase, in degrees; `null` if unknown.
    phase_std_deg: Option<f64>,
}

/// Runs the verb.
pub fn run(args: &cli::Table) -> Result<Outcome, Failure> {
    let stand = stand::read(&args.stand)?;
    let mechanics = stand.mechanics()?;
    if args.to < args.from {
        return Err(ErrorCode::InvalidValue.usage(format_args!(
            "--to {} lies below --from {}",
            args.to, args.from
        )));
    }
    let steps = ((args.to - args.from) / args.step * (1.0 + 1e-12)).floor();
    if steps >= MOST_ROWS {
        return Err(ErrorCode::InvalidValue.usage(format_args!(
            "a table of {steps} rows is too long; choose a larger --step"
        )));
    }
    let refined = match stand.effects.is_empty() && mechanics.measures == Motion::Displacement {
        true => None,
        false => Some(stand.inverse()?),
    };
    let output = args.result.open(&[args.stand.as_path()])?;
    let report = TableReport {
        rows: (0..=steps as u64)
            .map(|i| args.from + i as f64 * args.step)
            .map(|hz| row(&stand, mechanics, refined.as_ref(), hz))
            .collect(),
        stand: stand.file.clone(),
        with_uncertainty: args.uncertainty,
    };
    publish(&report, args.json, output)?;
    Ok(conclude(&stand.warnings, false, &Strictness::default()))
}

/// A row, of the refined stand if there is one.
fn row(
    stand: &Stand,
    mechanics: &Mechanics,
    refined: Option<&Inverse>,
    frequency_hz: f64,
) -> TableRow {
    let recorder = &stand.recorder.recorder;
    let mechanical = mechanics.response.inverse(frequency_hz);
    let recorded = recorder.response(frequency_hz);
    // Effects give only a response, so only their own phase is wrapped.
    let of_effects = refined.map(|inverse| inverse(frequency_hz) * recorded / mechanical);
    let (more, phase_of_effects) = of_effects.unwrap_or(Complex64::ONE).to_polar();
    let magnitude = more * mechanical.norm() / recorded.norm();
    let phase_rad = mechanical.arg() - recorder.phase_rad(frequency_hz) + phase_of_effects;
    let std = stand.inverse_uncertainty(frequency_hz);
    TableRow {
        frequency_hz,
        magnitude,
        phase_deg: phase_rad.to_degrees(),
        magnitude_relative_std: std.as_ref().map(InverseUncertainty::magnitude),
        phase_std_deg: std.as_ref().map(|s| s.phase_rad.to_degrees()),
    }
}

impl Report for TableReport {
    const SCHEMA: &'static str = "torqcomp.table/1";

    fn text(&self) -> String {
        let mut text = "frequency_hz,magnitude,phase_deg".to_owned();
        if self.with_uncertainty {
            text.push_str(",magnitude_relative_std,phase_std_deg");
        }
        text.push('\n');
        for row in &self.rows {
            // Without transmission there is no inverse: an empty cell.
            let cell = |value: f64| match value.is_finite() {
                true => rounded(value, DIGITS),
                false => String::new(),
            };
            let mut cells = vec![
                rounded(row.frequency_hz, DIGITS),
                cell(row.magnitude),
                cell(row.phase_deg),
            ];
            if self.with_uncertainty {
                // An unknown uncertainty is an empty cell, never 0.
                let std = |std: Option<f64>| std.map_or_else(String::new, |s| rounded(s, 4));
                cells.extend([std(row.magnitude_relative_std), std(row.phase_std_deg)]);
            }
            text.push_str(&cells.join(","));
            text.push('\n');
        }
        text
    }
}
