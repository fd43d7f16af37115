//! Tables whose rows are incomplete or belong to several sources, as their own columns show.

use std::fmt::Write;

use crate::noise::Noise;
use crate::util::Folder;

fn inspected(folder: &Folder, text: &str, more: &[&str]) -> serde_json::Value {
    folder.write("in.csv", text);
    folder.json(&[&["inspect", "in.csv", "--json"], more].concat())
}

/// Rows of a count and a torque, without those that are lost.
fn counted(lost: impl Fn(usize) -> bool, noise: &mut Noise) -> String {
    let kept = (0..2000).filter(|i| !lost(*i));
    let rows = kept.map(|i| {
        format!(
            "{i},{:.5}\n",
            5.0 + (0.05 * i as f64).sin() + 0.01 * noise.normal()
        )
    });
    format!("Sample,torque_Nm\n{}", rows.collect::<String>())
}

#[test]
fn a_count_that_jumps_is_said() {
    let folder = Folder::new();
    let mut noise = Noise(51);
    let rate = ["--rate", "1000"];
    let gap = inspected(
        &folder,
        &counted(|i| (700..837).contains(&i), &mut noise),
        &rate,
    );
    let told = gap.to_string();
    assert!(
        told.contains("counter-jumps") && told.contains("137 rows"),
        "{gap}"
    );
    let every = inspected(&folder, &counted(|i| i % 53 == 7, &mut noise), &rate);
    assert!(every.to_string().contains("counter-jumps"), "{every}");
    let whole = inspected(&folder, &counted(|_| false, &mut noise), &rate);
    assert!(!whole.to_string().contains("counter-jumps"), "{whole}");
}

/// A count that jumps, and a clock that slows down, far beyond the first rows, in memory and as a stream.
#[test]
fn the_whole_record_is_checked_for_missing_rows_and_other_clocks() {
    let folder = Folder::new();
    let mut noise = Noise(53);
    let stand = "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"60 Hz\"\ndamping_ratio = 0.02\n";
    folder.write("stand.toml", stand);
    let rows = 60_000;
    let torque =
        |i: usize, noise: &mut Noise| 5.0 + (0.05 * i as f64).sin() + 0.01 * noise.normal();
    let mut counts = "Sample,torque_Nm\n".to_owned();
    let mut clocks = "dev_time_s,torque_Nm,pc_time_s\n".to_owned();
    for i in 0..rows {
        let lost = if i < 50_000 { 0 } else { 137 };
        let _ = writeln!(counts, "{},{:.5}", i + lost, torque(i, &mut noise));
        let t = i as f64 / 1000.0;
        let slower = t - 0.02 * (t - 20.0).max(0.0);
        let _ = writeln!(clocks, "{t:.4},{:.5},{slower:.6}", torque(i, &mut noise));
    }
    let rate = ["--rate", "1000"];
    for (text, more, code, says) in [
        (&counts, &rate[..], "counter-jumps", "137 rows are missing"),
        (&clocks, &[][..], "clocks-disagree", "1.3 % slower"),
    ] {
        folder.write("in.csv", text);
        let command =
            "compensate in.csv --stand stand.toml --channel torque -o out.csv --force --json";
        for verb in [
            command,
            "extract in.csv --channel torque -o out.csv --force",
            "inspect in.csv --json",
        ] {
            let args = [&verb.split(' ').collect::<Vec<_>>(), more].concat();
            let ran = folder.run(&args);
            let told = ran.stdout + &ran.stderr;
            assert!(told.contains(code) && told.contains(says), "{verb}: {told}");
        }
        // Cut before that, nothing is said.
        let first: String = text
            .lines()
            .take(15_000)
            .map(|line| format!("{line}\n"))
            .collect();
        let report = inspected(&folder, &first, more).to_string();
        assert!(!report.contains(code), "{report}");
    }
}

#[test]
fn sources_in_turn_are_named_by_their_column() {
    let folder = Folder::new();
    let mut noise = Noise(52);
    for count in [3, 6] {
        let mut text = "time_s,joint_id,effort_Nm\n".to_owned();
        for i in 0..400 {
            for joint in 1..=count {
                let level = 4.0 + 0.3 * f64::from(joint) + 0.01 * noise.normal();
                let _ = writeln!(text, "{:.4},{joint},{level:.5}", f64::from(i) / 1000.0);
            }
        }
        let report = inspected(&folder, &text, &[]);
        let told = report.to_string();
        assert!(
            told.contains("joint_id") && told.contains("cycles through"),
            "{report}"
        );
    }
}

#[test]
fn two_clocks_that_disagree_are_said() {
    let folder = Folder::new();
    for (factor, is_said) in [(1.01, true), (1.003, true), (1.0001, false), (1.0, false)] {
        let mut text = "dev_time_s,pc_time_s,torque_Nm\n".to_owned();
        for i in 0..3000 {
            let t = f64::from(i) / 1000.0;
            let _ = writeln!(text, "{t:.4},{:.6},{:.5}", factor * t, (40.0 * t).sin());
        }
        let report = inspected(&folder, &text, &[]);
        let told = report.to_string().contains("clocks-disagree");
        assert_eq!(told, is_said, "{factor}: {report}");
    }
}
