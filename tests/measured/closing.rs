//! `diagnose` on recordings made by others: which effect is named, and what is said where none can be.

use std::fmt::Write;
use std::path::Path;

use libtest_mimic::Failed;
use serde_json::Value;

use super::{check, rows};

/// A folder with pieces of recordings, and the program run in it.
struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    fn new() -> Result<Self, Failed> {
        Ok(Self {
            folder: tempfile::tempdir()?,
        })
    }

    /// Writes the rows of a table in a range, its heading above them.
    fn cut(&self, from: &Path, range: std::ops::Range<usize>, name: &str) -> Result<(), Failed> {
        let text = std::fs::read_to_string(from)?;
        let mut lines = text.lines();
        let mut piece = String::new();
        writeln!(piece, "{}", lines.next().unwrap_or_default())?;
        for line in lines.skip(range.start).take(range.len()) {
            writeln!(piece, "{line}")?;
        }
        Ok(std::fs::write(self.folder.path().join(name), piece)?)
    }

    fn run(&self, args: &[&str]) -> Result<(i32, String, String), Failed> {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_torqcomp"))
            .args(args)
            .current_dir(self.folder.path())
            .output()?;
        let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
        Ok((
            output.status.code().unwrap_or(-1),
            text(output.stdout),
            text(output.stderr),
        ))
    }

    fn diagnose(&self, applied: &str, measured: &str) -> Result<Value, Failed> {
        let (code, out, err) = self.run(&[
            "diagnose",
            "--train",
            "train.csv",
            "--holdout",
            "holdout.csv",
            "--applied",
            applied,
            "--measured",
            measured,
            "-o",
            "refined.toml",
            "--json",
        ])?;
        check(code == 0, err)?;
        Ok(serde_json::from_str(&out)?)
    }
}

fn held_out(report: &Value, which: &str, unit: &str) -> f64 {
    let error = &report["error"][which][format!("holdout_{unit}")];
    error.as_f64().unwrap_or(f64::NAN)
}

/// Nothing but the cubic spring of the circuit, and 7 mV before it is known.
pub fn silverbox(folder: &Path) -> Result<(), Failed> {
    let file = folder.join("silverbox/estimation.csv");
    let bench = Bench::new()?;
    bench.cut(&file, 0..12_000, "train.csv")?;
    bench.cut(&file, 40_000..48_000, "holdout.csv")?;
    let report = bench.diagnose("v1_in_V", "v2_out_V")?;
    check(
        report["effects"] == serde_json::json!(["cubic-stiffness"]),
        &report["effects"],
    )?;
    let [before, after] = ["before", "after"].map(|w| held_out(&report, w, "rms"));
    check(before > 5e-3 && after < 0.4e-3, format!("{before} {after}"))?;

    // The refined stand on its own, on what it has not seen.
    let (code, out, err) = bench.run(&[
        "simulate",
        "holdout.csv",
        "--stand",
        "refined.toml",
        "--applied",
        "v1_in_V",
    ])?;
    check(code == 0, err)?;
    let truth = std::fs::read_to_string(bench.folder.path().join("holdout.csv"))?;
    let (simulated, truth) = (rows(&out), rows(&truth));
    let settled = 500..simulated.len() - 20;
    let count = settled.len() as f64;
    let squares = settled.map(|i| (simulated[i][1] - truth[i][2]).powi(2));
    let rms = (squares.sum::<f64>() / count).sqrt();
    check(rms < 0.45e-3, format!("{rms} V are left of the record"))
}

/// Hysteresis, named and simulated to a hundredth of the record.
pub fn bouc_wen(folder: &Path) -> Result<(), Failed> {
    let file = folder.join("boucwen/estimation.csv");
    let bench = Bench::new()?;
    bench.cut(&file, 0..12_000, "train.csv")?;
    bench.cut(&file, 20_000..28_000, "holdout.csv")?;
    let report = bench.diagnose("force_in_N", "displacement_out_m")?;
    check(
        report["effects"] == serde_json::json!(["bouc-wen-hysteresis"]),
        &report["effects"],
    )?;
    let [before, after] = ["before", "after"].map(|w| held_out(&report, w, "relative"));
    check(before > 0.2 && after < 0.013, format!("{before} {after}"))
}

/// The error depends on the level, and no effect of the list explains it all.
pub fn f16(folder: &Path) -> Result<(), Failed> {
    let bench = Bench::new()?;
    for (level, name) in [(1, "train.csv"), (3, "holdout.csv")] {
        let file = folder.join(format!("f16/multisine_level{level}.csv"));
        bench.cut(&file, 8192..16_384, name)?;
    }
    let report = bench.diagnose("force_N", "accel_payload")?;
    let verdict = report["verdict"].as_str().unwrap_or_default();
    check(
        verdict == "unexplained" || verdict == "partly-explained",
        verdict,
    )?;
    let described = report["residual"]["described"].as_str().unwrap_or_default();
    check(described.contains("depends on amplitude"), described)
}

/// No spring: sent to the verb that takes a body which moves freely.
pub fn emps(folder: &Path) -> Result<(), Failed> {
    let file = folder.join("emps/estimation.csv");
    let bench = Bench::new()?;
    let path = file.to_str().unwrap_or_default();
    let columns = [
        "--applied",
        "control_V",
        "--measured",
        "measured_position_m",
    ];
    let args = [&["diagnose", "--train", path][..], &columns].concat();
    let (code, out, err) = bench.run(&args)?;
    check(code == 1 && out.is_empty(), &out)?;
    check(
        err.contains("periods") && err.contains("identify runup"),
        &err,
    )
}

/// Channels the wrong way round.
pub fn swapped(folder: &Path) -> Result<(), Failed> {
    let file = folder.join("silverbox/estimation.csv");
    let bench = Bench::new()?;
    bench.cut(&file, 20_000..28_000, "train.csv")?;
    let columns = ["--applied", "v2_out_V", "--measured", "v1_in_V"];
    let args = [&["diagnose", "--train", "train.csv"][..], &columns].concat();
    let (code, out, err) = bench.run(&args)?;
    check(code == 1 && err.contains("look swapped"), out + &err)
}

/// One turn a second: order 60 and the grid coincide.
pub fn order_or_mains(folder: &Path) -> Result<(), Failed> {
    let file = folder.join("torque_transducer/generating__60rpm-torque__ILC-OFF_0pc-load.txt");
    let path = file.to_str().unwrap_or_default();
    let args = [
        "harmonics",
        path,
        "--unit",
        "N m",
        "--fundamental",
        "1",
        "--refine",
        "--orders",
        "1-200",
        "--json",
    ];
    let (code, out, err) = super::run(super::STAND, &args)?;
    check(code == 0, &err)?;
    let report: Value = serde_json::from_str(&out)?;
    let warnings = report["warnings"].as_array().ok_or("no warnings")?;
    let said = warnings.iter().find(|w| w["code"] == "order-or-mains");
    let message = said.and_then(|w| w["message"].as_str()).unwrap_or_default();
    check(
        message.contains("60 (60.") && message.contains("another speed"),
        &out,
    )
}
