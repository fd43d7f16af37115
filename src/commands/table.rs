//! `table`: the inverse transfer function over frequency, Appendix D of the thesis for any stand.

use std::fmt::Write;

use num_complex::Complex64;
use serde::Serialize;
use torqcomp_dsp::compensate::Inverse;

use super::Outcome;
use crate::cli;
use crate::failure::Failure;
use crate::io::output;
use crate::print::{self, rounded};
use crate::stand::{self, Mechanics, Stand};

/// Most rows of a table.
const MOST_ROWS: f64 = 1e7;
/// Significant digits of the table.
const DIGITS: u32 = 10;

/// JSON document.
#[derive(Debug, Serialize)]
struct Report {
    schema: &'static str,
    version: &'static str,
    stand: String,
    rows: Vec<Row>,
}

/// Torque that acted over the torque recorded, at one frequency.
#[derive(Debug, Serialize)]
struct Row {
    frequency_hz: f64,
    magnitude: f64,
    phase_deg: f64,
    /// Relative standard uncertainty of the magnitude; `null` if unknown.
    magnitude_relative_std: Option<f64>,
    phase_std_deg: Option<f64>,
}

/// Runs the verb.
pub fn run(args: &cli::Table) -> Result<Outcome, Failure> {
    let stand = stand::read(&args.stand)?;
    let mechanics = stand.mechanics()?;
    if args.to < args.from {
        return Err(Failure::usage(format_args!(
            "--to {} lies below --from {}",
            args.to, args.from
        )));
    }
    let steps = ((args.to - args.from) / args.step * (1.0 + 1e-12)).floor();
    if steps >= MOST_ROWS {
        return Err(Failure::usage(format_args!(
            "a table of {steps} rows is too long; choose a larger --step"
        )));
    }
    let refined = match stand.effects.is_empty() {
        true => None,
        false => Some(stand.inverse()?),
    };
    let rows: Vec<Row> = (0..=steps as u64)
        .map(|i| args.from + i as f64 * args.step)
        .map(|hz| row(&stand, mechanics, refined.as_ref(), hz))
        .collect();
    let text = if args.json {
        print::json(&Report {
            schema: "torqcomp.table/1",
            version: env!("CARGO_PKG_VERSION"),
            stand: stand.file.clone(),
            rows,
        })
    } else {
        csv(&rows, args.uncertainty)
    };
    output::write_all(
        args.result.output.as_deref(),
        args.result.force,
        &[args.stand.as_path()],
        &text,
    )?;
    Ok(Outcome::Done)
}

/// A row, of the refined stand if there is one: then its uncertainty is not known, as that of the effects is not.
fn row(stand: &Stand, mechanics: &Mechanics, refined: Option<&Inverse>, frequency_hz: f64) -> Row {
    let recorder = &stand.recorder.recorder;
    let mechanical = mechanics.response.inverse(frequency_hz);
    let recorded = recorder.response(frequency_hz);
    // Of effects there is no more than the response, so that only their own phase folds.
    let of_effects = refined.map(|inverse| inverse(frequency_hz) * recorded / mechanical);
    let (more, phase_of_effects) = of_effects.unwrap_or(Complex64::ONE).to_polar();
    let magnitude = more * mechanical.norm() / recorded.norm();
    let phase_rad = mechanical.arg() - recorder.phase_rad(frequency_hz) + phase_of_effects;
    let std = mechanics
        .response
        .inverse_uncertainty(frequency_hz, &mechanics.std)
        .ok()
        .flatten()
        .filter(|_| refined.is_none());
    Row {
        frequency_hz,
        magnitude,
        phase_deg: phase_rad.to_degrees(),
        magnitude_relative_std: std.as_ref().map(|s| s.magnitude_relative),
        phase_std_deg: std.as_ref().map(|s| s.phase_rad.to_degrees()),
    }
}

fn csv(rows: &[Row], uncertainty: bool) -> String {
    let mut text = "frequency_hz,magnitude,phase_deg".to_owned();
    if uncertainty {
        text.push_str(",magnitude_relative_std,phase_std_deg");
    }
    text.push('\n');
    for row in rows {
        // Where nothing passes, there is no inverse: an empty cell.
        let cell = |value: f64| match value.is_finite() {
            true => rounded(value, DIGITS),
            false => String::new(),
        };
        let _ = write!(
            text,
            "{},{},{}",
            rounded(row.frequency_hz, DIGITS),
            cell(row.magnitude),
            cell(row.phase_deg)
        );
        if uncertainty {
            // An unknown uncertainty is an empty cell, never 0.
            let cell = |std: Option<f64>| std.map_or_else(String::new, |s| rounded(s, 4));
            let _ = write!(
                text,
                ",{},{}",
                cell(row.magnitude_relative_std),
                cell(row.phase_std_deg)
            );
        }
        text.push('\n');
    }
    text
}
