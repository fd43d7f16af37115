//! Inverse check: the torque recovered by `compensate` with the plain stand and with the refined
//! one, compared with the applied torque.

use std::f64::consts::PI;
use std::path::Path;
use std::process::Command;

use crate::case::{Answer, Case};

/// Errors of the recovered torque, rms in N m.
pub struct Torque {
    /// With the stand of the best plain fit.
    pub plain: Result<f64, String>,
    /// With the stand written by `diagnose`.
    pub refined: Result<f64, String>,
    /// From the noise alone through the true plain stand.
    pub floor: f64,
}

/// Runs both.
pub fn check(answer: &Answer, binary: &Path) -> Torque {
    with_stand(&answer.case, binary, &answer.refined)
}

/// Runs the plain stand and another one.
pub fn with_stand(case: &Case, binary: &Path, stand: &Path) -> Torque {
    let plain = case.folder.join("plain.toml");
    Torque {
        plain: recovered(case, binary, &plain),
        refined: recovered(case, binary, stand),
        floor: floor(case),
    }
}

fn band_hz(case: &Case) -> f64 {
    1.02 * case.truth["records"]["top_hz"].as_f64().unwrap_or(2200.0)
}

/// White noise through `1 − r² + 2jζr` up to the band's end and through its edge, a fifth as wide.
fn floor(case: &Case) -> f64 {
    let constants = &case.truth["true_constants"];
    let number = |key: &str| constants[key].as_f64().unwrap_or(f64::NAN);
    let (natural_hz, ratio) = (number("natural_frequency_hz"), number("damping_ratio"));
    let (band_hz, steps) = (band_hz(case), 2400);
    let sum: f64 = (0..steps)
        .map(|step| {
            let part = 1.2 * (f64::from(step) + 0.5) / f64::from(steps);
            let edge = 0.5 * (1.0 + (PI * ((part - 1.0) / 0.2).max(0.0)).cos());
            let r = band_hz * part / natural_hz;
            edge * edge * ((1.0 - r * r).powi(2) + (2.0 * ratio * r).powi(2))
        })
        .sum();
    let rate_hz = case.truth["records"]["rate_hz"]
        .as_f64()
        .unwrap_or(f64::NAN);
    case.floor() * (sum * 1.2 / f64::from(steps) * band_hz / (rate_hz / 2.0)).sqrt()
}

fn recovered(case: &Case, binary: &Path, stand: &Path) -> Result<f64, String> {
    let folder = &case.folder;
    let output = Command::new(binary)
        .current_dir(folder)
        .args(["compensate", "holdout.csv", "--channel", case.column()])
        .args([
            "--band",
            &format!("{} Hz", band_hz(case).floor()),
            "-o",
            "-",
            "--stand",
        ])
        .arg(stand)
        .output()
        .map_err(|error| error.to_string())?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned());
    }
    let torque = column(&String::from_utf8_lossy(&output.stdout), 1);
    let table =
        std::fs::read_to_string(folder.join("holdout.csv")).map_err(|error| error.to_string())?;
    let applied = column(&table, 1);
    if torque.len() != applied.len() {
        return Err(format!(
            "{} rows instead of {}",
            torque.len(),
            applied.len()
        ));
    }
    // Excludes a twentieth at both ends, where the record begins and ends within the filter.
    let edge = applied.len() / 20;
    let inner = edge..applied.len() - edge;
    let errors: Vec<f64> = inner.map(|i| torque[i] - applied[i]).collect();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let square: f64 = errors.iter().map(|error| (error - mean).powi(2)).sum();
    Ok((square / errors.len() as f64).sqrt())
}

fn column(table: &str, index: usize) -> Vec<f64> {
    table
        .lines()
        .filter_map(|line| line.split(',').nth(index)?.trim().parse().ok())
        .collect()
}
