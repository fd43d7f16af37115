//! Cases as files: `train.csv`, `holdout.csv`, `stand.toml`, `plain.toml` and `truth.json`.

use std::fmt::Write as _;
use std::io;
use std::path::Path;

use super::plant::{Constants, FT_LBF};
use super::record::{Case, Record};

/// The stand as the thesis declares it.
pub const DECLARED: &str = r#"schema = "torqcomp.stand/1"
name = "Hertel single-phase motor stand"

[mechanics]
inertia = "5.85e-3 slug ft^2"
damping = "3.07 ft lbf s/rad"
stiffness = "8.1e4 ft lbf/rad"

[calibration]
torque_per_volt = "1.23e3 ft lbf/V"
"#;

/// Every eighth case records volts instead of torque.
pub fn in_volts(case: &Case) -> bool {
    case.number % 8 == 6
}

/// Heading of the measured column.
pub fn measured_column(case: &Case) -> &'static str {
    if in_volts(case) {
        "measured_V"
    } else {
        "measured_n_m"
    }
}

/// A record as a table.
pub fn table(record: &Record, volts: bool) -> String {
    let rate_hz = record.span.written_rate_hz();
    // A millionth of a step or finer, except for the rate of the thesis' stand, whose steps need five
    // decimals.
    let decimals = if record.span.slower == 1.0 {
        5
    } else {
        7 + rate_hz.log10().ceil().max(0.0) as usize
    };
    let (heading, scale, digits) = if volts {
        ("measured_V", 1.0 / (1.23e3 * FT_LBF), 11)
    } else {
        ("measured_n_m", 1.0, 8)
    };
    let mut text = format!("time_s,applied_n_m,{heading}\n");
    for (index, (applied, measured)) in record
        .applied_n_m
        .iter()
        .zip(&record.measured_n_m)
        .enumerate()
    {
        let time_s = index as f64 / rate_hz;
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "{time_s:.decimals$},{applied:.8},{:.digits$}",
            measured * scale
        );
    }
    text
}

/// The stand of the best plain fit: stiffness as declared, natural frequency and damping ratio fitted.
fn plain_stand(case: &Case) -> String {
    let stiffness = Constants::hertel().stiffness_n_m;
    let omega = case.plain.omega / case.train.span.slower;
    let inertia = stiffness / omega.powi(2);
    let damping = 2.0 * case.plain.damping_ratio * (stiffness * inertia).sqrt();
    format!(
        "schema = \"torqcomp.stand/1\"\nname = \"best plain fit\"\n\n[mechanics]\n\
         inertia = \"{inertia:.12e} kg m^2\"\ndamping = \"{damping:.12e} N m s/rad\"\n\
         stiffness = \"{stiffness:.12e} N m/rad\"\n\n[calibration]\n\
         torque_per_volt = \"1.23e3 ft lbf/V\"\n"
    )
}

/// The stand as it is declared.
fn declared(case: &Case) -> String {
    let Some(constants) = case.declared else {
        return DECLARED.to_owned();
    };
    let constants = constants.written(&case.train.span);
    format!(
        "schema = \"torqcomp.stand/1\"\nname = \"blind stand\"\n\n[mechanics]\n\
         inertia = \"{:.6e} kg m^2\"\ndamping = \"{:.6e} N m s/rad\"\n\
         stiffness = \"8.1e4 ft lbf/rad\"\n\n[calibration]\n\
         torque_per_volt = \"1.23e3 ft lbf/V\"\n",
        constants.inertia_kg_m2, constants.damping_n_m_s
    )
}

/// Writes a case into a separate folder.
pub fn write(case: &Case, folder: &Path) -> io::Result<()> {
    std::fs::create_dir_all(folder)?;
    let volts = in_volts(case);
    let mut truth = case.truth.clone();
    truth["measured_column"] = measured_column(case).into();
    std::fs::write(folder.join("train.csv"), table(&case.train, volts))?;
    std::fs::write(folder.join("holdout.csv"), table(&case.holdout, volts))?;
    std::fs::write(folder.join("stand.toml"), declared(case))?;
    std::fs::write(folder.join("plain.toml"), plain_stand(case))?;
    std::fs::write(folder.join("truth.json"), format!("{truth:#}\n"))
}
