//! Peak memory of the verbs on records of two lengths: what grows with the record, and by how much a row.

use std::fmt::Write as _;
use std::process::Stdio;

use crate::util::{Folder, command};

/// Rows of the two records; the pieces that verbs work on are shorter than the first.
const ROWS: [usize; 2] = [400_000, 1_200_000];
/// Bytes a row that count as none: pieces of several sizes leave gaps between them.
const NONE: f64 = 12.0;

/// A record of 20 kHz: torque, bridge voltage and a decay that begins anew every 2 s.
fn record(rows: usize) -> String {
    let mut text = String::from("time_s,torque_Nm,bridge_V,ringing_V\n");
    for i in 0..rows {
        let t = i as f64 / 20_000.0;
        let since = (i % 40_000) as f64 / 20_000.0;
        let torque = (377.0 * t).cos() + 0.3 * ((i * i % 1000) as f64).sin();
        let ringing = (-20.0 * since).exp() * (3707.0 * since).cos();
        let _ = writeln!(text, "{t:.5},{torque:.5},{:.7},{ringing:.5}", 1e-3 * torque);
    }
    text
}

/// Largest resident memory of a run so far, in bytes.
fn peak(process: u32) -> Option<f64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: f64 = line.trim().strip_suffix(" kB")?.parse().ok()?;
    Some(1024.0 * kibibytes)
}

/// Largest resident memory of a run that must succeed, in bytes.
fn peak_of(folder: &Folder, args: &[&str]) -> f64 {
    let mut child = command(&folder.path(""), args)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the binary starts");
    let mut largest = 0.0_f64;
    loop {
        largest = largest.max(peak(child.id()).unwrap_or(0.0));
        if let Some(status) = child.try_wait().expect("a state") {
            assert!(status.success(), "{args:?}: {status}");
            return largest;
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
}

/// Each with the most bytes a row that docs/reliability.md states.
const VERBS: [(&str, f64); 6] = [
    (
        "compensate LONG --channel bridge --stand stand.toml -o out.csv --force",
        NONE,
    ),
    ("extract LONG --channel bridge -o out.csv --force", NONE),
    (
        "simulate LONG --applied torque --stand stand.toml -o out.csv --force",
        NONE,
    ),
    (
        "harmonics LONG --channel bridge --stand stand.toml --fundamental 60 --orders 1-5",
        60.0,
    ),
    ("inspect LONG", 120.0),
    ("identify decay LONG --channel ringing", 110.0),
];

#[test]
fn memory_grows_by_no_more_than_is_stated() {
    let folder = Folder::new();
    let names = ROWS.map(|rows| format!("{rows}.csv"));
    for (rows, name) in ROWS.iter().zip(&names) {
        folder.write(name, record(*rows));
    }
    let mut wrong = String::new();
    for (verb, most) in VERBS {
        let of = |name: &str| {
            let line = verb.replace("LONG", name);
            peak_of(&folder, &line.split(' ').collect::<Vec<_>>())
        };
        let (short, long) = (of(&names[0]), of(&names[1]));
        let slope = (long - short) / (ROWS[1] - ROWS[0]) as f64;
        let told = format!(
            "{verb}: {:.0} and {:.0} MB, {slope:.1} bytes a row, at most {most}\n",
            short / 1e6,
            long / 1e6
        );
        print!("{told}");
        if slope > most {
            wrong.push_str(&told);
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

/// What cannot have room is refused before anything is read or written.
#[test]
fn a_text_without_room_is_refused() {
    let folder = Folder::new();
    folder.write("long.csv", record(10_000));
    let file = std::fs::File::options()
        .write(true)
        .open(folder.path("long.csv"));
    // The rest takes no room on the disk.
    file.expect("a file").set_len(3 << 30).expect("a length");
    let script = "ulimit -v 1000000; exec \"$0\" identify decay long.csv -o out.toml";
    let ran = std::process::Command::new("sh")
        .args(["-c", script, env!("CARGO_BIN_EXE_torqcomp")])
        .current_dir(folder.path(""))
        .output()
        .expect("the shell starts");
    assert_eq!(ran.status.code(), Some(1));
    let said = String::from_utf8_lossy(&ran.stderr);
    assert!(
        said.contains("at least 2.1 GB of memory, and this process may have 1 GB"),
        "{said}"
    );
    assert_eq!(folder.names(), ["long.csv", "stand.toml"]);
}
