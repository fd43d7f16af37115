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
