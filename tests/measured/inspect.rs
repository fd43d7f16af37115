//! Findings of `inspect` in third-party recordings, against counts made here.

use std::path::Path;
use std::process::Command;

use libtest_mimic::Failed;
use serde_json::Value;

use crate::check;

/// A test: its name and function of the folder of the recordings.
pub type Test = (&'static str, fn(&Path) -> Result<(), Failed>);

pub const TESTS: [Test; 6] = [
    ("inspect_finds_nothing_wrong_with_good_records", good),
    ("inspect_counts_repeated_samples", repeated),
    ("inspect_counts_gaps_of_a_balance", gaps),
    ("inspect_finds_copies_and_multiples", copies),
    ("inspect_finds_the_resolution_of_converters", resolution),
    ("inspect_finds_saturation_and_held_samples", saturated),
];

fn inspect(folder: &Path, args: &[&str]) -> Result<Value, Failed> {
    let output = Command::new(env!("CARGO_BIN_EXE_torqcomp"))
        .arg("inspect")
        .args(args)
        .arg("--json")
        .current_dir(folder)
        .output()?;
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    check(output.status.success(), said)?;
    Ok(serde_json::from_slice(&output.stdout)?)
}

fn codes(report: &Value) -> Vec<String> {
    let warnings = report["warnings"].as_array().cloned().unwrap_or_default();
    let code = |warning: &Value| warning["code"].as_str().unwrap_or_default().to_owned();
    warnings.iter().map(code).collect()
}

/// Cells of a column, as text, from the lines in which it is a number.
fn column(path: &Path, separator: char, place: usize) -> Result<Vec<String>, Failed> {
    let text = String::from_utf8_lossy(&std::fs::read(path)?).into_owned();
    let cell = |line: &str| -> Option<String> {
        let cell = line.split(separator).nth(place)?.trim().to_owned();
        cell.replace(',', ".").parse::<f64>().ok().map(|_| cell)
    };
    Ok(text.lines().filter_map(cell).collect())
}

fn numbers(cells: &[String]) -> Vec<f64> {
    let number = |cell: &String| cell.replace(',', ".").parse().unwrap_or(f64::NAN);
    cells.iter().map(number).collect()
}

/// Widely used benchmarks: their only fault is mains hum of the laboratory.
fn good(folder: &Path) -> Result<(), Failed> {
    for file in [
        "silverbox/estimation.csv",
        "emps/estimation.csv",
        "boucwen/estimation.csv",
        "f16/multisine_level1.csv",
        "f16/multisine_level3.csv",
    ] {
        let report = inspect(folder, &[file])?;
        let mut found = codes(&report);
        found.retain(|code| code != "mains-lines");
        check(found.is_empty(), format!("{file}: {found:?}"))?;
        check(
            report["channels"][0]["rate_hz"].is_number(),
            format!("{file}: {report}"),
        )?;
    }
    // The lines at 50, 100 and 150 Hz of the shaker's force appear at both levels; none elsewhere.
    let quiet = ["silverbox/estimation.csv", "emps/estimation.csv"];
    for file in quiet {
        check(codes(&inspect(folder, &[file])?).is_empty(), file)?;
    }
    let report = inspect(folder, &["f16/multisine_level1.csv"])?;
    let lines = report["channels"][0]["mains"].as_array().cloned();
    let frequencies: Vec<f64> = lines
        .unwrap_or_default()
        .iter()
        .filter_map(|line| line["frequency_hz"].as_f64())
        .collect();
    check(
        frequencies == [50.0, 100.0, 150.0],
        format!("{frequencies:?}"),
    )
}

/// Number of samples whose text equals the previous one.
fn repeated(folder: &Path) -> Result<(), Failed> {
    let mut seen = 0;
    for entry in std::fs::read_dir(folder.join("torque_transducer"))? {
        let path = entry?.path();
        let name = path.to_str().unwrap_or_default();
        let cells = column(&path, '\t', 1)?;
        let equal = cells.windows(2).filter(|pair| pair[0] == pair[1]).count();
        let part = equal as f64 / (cells.len() - 1) as f64;
        let report = inspect(folder, &[name])?;
        let found = report["channels"][0]["repeated"].as_f64().unwrap_or(-1.0);
        check(
            (found - part).abs() < 1e-12,
            format!("{name}: {found}, counted {part}"),
        )?;
        let said = codes(&report).contains(&"repeated-samples".to_owned());
        let is_torque = name.contains("torque__");
        check(said == is_torque, format!("{name}: {part}, said: {said}"))?;
        if is_torque {
            check((0.26..0.31).contains(&part), format!("{name}: {part}"))?;
        }
        seen += 1;
    }
    check(seen == 5, format!("{seen} files"))
}

/// Number of steps between stamps longer than 1.5 times the typical one.
fn gaps(folder: &Path) -> Result<(), Failed> {
    for file in [
        "thrust_balance/1.caldata_m4_l5_F9_725.txt",
        "thrust_balance/2.caldata_m4_l5_F9_725.txt",
        "thrust_balance/data15.txt",
    ] {
        let times = numbers(&column(&folder.join(file), '\t', 0)?);
        let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        let middle = steps[steps.len() / 2];
        let near = |s: &&f64| (*s / middle - 1.0).abs() <= 0.01;
        let usual =
            steps.iter().filter(near).sum::<f64>() / steps.iter().filter(near).count() as f64;
        let counted = steps.iter().filter(|s| **s > 1.5 * usual).count();
        check((middle - 0.016).abs() < 1e-4, format!("{file}: {middle}"))?;
        let report = inspect(folder, &[file, "--time-column", "1", "--time-unit", "s"])?;
        let channel = &report["channels"][0];
        check(
            channel["gaps"].as_u64() == Some(counted as u64) && counted > 100,
            format!("{file}: {}, counted {counted}", channel["gaps"]),
        )?;
        check(
            codes(&report).contains(&"time-gaps".to_owned()),
            format!("{file}: {:?}", codes(&report)),
        )?;
    }
    Ok(())
}

/// Two pairs of files are identical, and one file has channels that are multiples.
fn copies(folder: &Path) -> Result<(), Failed> {
    let transducer = "torque_transducer/generating__60rpm-torque__ILC-OFF_10pc-load.txt";
    for pair in [
        ["dialects/abb_drive_monitor.txt", transducer],
        [
            "dialects/lvdt_tab_decimalcomma_noheader.txt",
            "thrust_balance/data1.txt",
        ],
    ] {
        let [a, b] = pair.map(|file| std::fs::read(folder.join(file)));
        check(a? == b?, format!("{pair:?} are no longer the same"))?;
        let found = codes(&inspect(folder, &pair)?);
        check(found == ["identical-files"], format!("{pair:?}: {found:?}"))?;
    }
    let file = "dialects/phyprakit_Cassy.txt";
    // The header lines contain numbers as well, except for their first cells.
    let samples = column(&folder.join(file), '\t', 0)?.len();
    let last = |place: usize| -> Result<Vec<f64>, Failed> {
        let cells = column(&folder.join(file), '\t', place)?;
        Ok(numbers(&cells[cells.len() - samples..]))
    };
    let (volts, shifted) = (last(3)?, last(4)?);
    let off = volts.iter().zip(&shifted);
    let most = off.map(|(a, b)| (b - a + 2.57).abs()).fold(0.0, f64::max);
    check(
        most < 1e-9,
        format!("U_k is U_B1 less 2.57 V but for {most}"),
    )?;
    let report = inspect(folder, &[file])?;
    let said = report.to_string();
    check(
        codes(&report)
            .iter()
            .filter(|c| *c == "channel-multiple")
            .count()
            == 2
            && said.contains("2.57 V"),
        said,
    )
}

/// The converter of the strain beam has 12 bits over 5 V.
fn resolution(folder: &Path) -> Result<(), Failed> {
    let report = inspect(folder, &["strain_beam/set0_test0.txt"])?;
    let channels = report["channels"].as_array().cloned().unwrap_or_default();
    let gages = channels.iter().filter(|channel| {
        let name = channel["name"].as_str().unwrap_or_default();
        name.starts_with("SG_")
    });
    let mut seen = 0;
    for gage in gages {
        let step = gage["resolution"].as_f64().unwrap_or(0.0);
        check((step * 4096.0 / 5.0 - 1.0).abs() < 1e-4, gage)?;
        seen += 1;
    }
    check(seen == 2, report)
}

/// A 16-bit droop counter at its limit, and an oscilloscope that stores every value twice.
fn saturated(folder: &Path) -> Result<(), Failed> {
    let file = "dialects/mitsubishi_MRconfigurator.csv";
    let droop = numbers(&column(&folder.join(file), ',', 3)?);
    let counted = droop.iter().filter(|x| **x == -32768.0).count();
    let report = inspect(folder, &[file])?;
    let channels = report["channels"].as_array().cloned().unwrap_or_default();
    let clipped: Vec<&Value> = channels.iter().filter(|c| c["clipped"] != 0).collect();
    check(
        clipped.len() == 1
            && clipped[0]["clipped"].as_u64() == Some(counted as u64)
            && clipped[0]["clipped_low"] == -32768.0,
        format!("counted {counted}: {clipped:?}"),
    )?;
    let report = inspect(folder, &["dialects/rigol_DS1054Z-A.csv"])?;
    let channels = report["channels"].as_array().cloned().unwrap_or_default();
    let held = channels
        .iter()
        .filter(|channel| channel["hold"] == 2)
        .count();
    check(held >= 3, report)
}
