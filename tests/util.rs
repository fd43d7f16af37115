//! Running the binary in a separate folder.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;

/// The stand of the thesis, as a stand file.
pub const HERTEL: &str = r#"schema = "torqcomp.stand/1"
[mechanics]
inertia = "5.85e-3 slug ft^2"
damping = "3.07 ft lbf s/rad"
stiffness = "8.1e4 ft lbf/rad"
[calibration]
torque_per_volt = "1.23e3 ft lbf/V"
"#;

/// Compensates `in.csv`.
pub const COMPENSATE: [&str; 6] = [
    "compensate",
    "in.csv",
    "--stand",
    "stand.toml",
    "-o",
    "out.csv",
];

/// Components of `in.csv`, for the fundamental that follows.
pub const HARMONICS: [&str; 5] = [
    "harmonics",
    "in.csv",
    "--stand",
    "stand.toml",
    "--fundamental",
];

/// Simulates `record.csv`.
pub const SIMULATE: [&str; 6] = [
    "simulate",
    "record.csv",
    "--stand",
    "stand.toml",
    "--applied",
    "applied_n_m",
];

/// Number of records per case of a test of coverage: few, unless the environment requests more.
pub fn trials(default: usize) -> usize {
    let number = std::env::var("TORQCOMP_TRIALS").ok();
    number.and_then(|n| n.parse().ok()).unwrap_or(default)
}

/// Sends a signal to a process.
pub fn signal(name: &str, child: &std::process::Child) {
    let sent = std::process::Command::new("kill")
        .args(["-s", name, &child.id().to_string()])
        .status();
    assert!(sent.expect("kill is there").success(), "{name}");
}

/// A number of a report.
pub fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// The codes of the warnings in a report.
pub fn codes(report: &Value) -> Vec<&str> {
    let warnings = report["warnings"].as_array().expect("warnings");
    warnings.iter().filter_map(|w| w["code"].as_str()).collect()
}

/// A folder that is removed with its files.
pub struct Folder(tempfile::TempDir);

/// Results of a run of the binary.
#[derive(Debug)]
pub struct Ran {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Folder {
    /// An empty folder with the stand of the thesis in `stand.toml`.
    pub fn new() -> Self {
        let folder = Self(tempfile::tempdir().expect("a temporary folder"));
        folder.write("stand.toml", HERTEL);
        folder
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> &Self {
        std::fs::write(self.path(name), content).expect("the folder can be written");
        self
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).expect("the file is there")
    }

    /// Names of the files in the folder, sorted.
    pub fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = std::fs::read_dir(self.0.path())
            .expect("the folder can be read")
            .map(|entry| {
                entry
                    .expect("an entry")
                    .file_name()
                    .into_string()
                    .expect("a name")
            })
            .collect();
        names.sort();
        names
    }

    /// Runs `torqcomp` in the folder.
    pub fn run(&self, args: &[&str]) -> Ran {
        self.pipe(args, b"")
    }

    /// Runs `torqcomp` in the folder with bytes on standard input.
    pub fn pipe(&self, args: &[&str], stdin: &[u8]) -> Ran {
        let mut child = command(self.0.path(), args)
            .stdin(Stdio::piped())
            .spawn()
            .expect("the binary starts");
        let mut pipe = child.stdin.take().expect("a pipe");
        let bytes = stdin.to_vec();
        let writer = std::thread::spawn(move || {
            // The binary may end before it has read everything.
            let _ = pipe.write_all(&bytes);
        });
        let output = child.wait_with_output().expect("the binary ends");
        writer.join().expect("the writer ends");
        Ran {
            code: output.status.code().expect("an exit code"),
            stdout: String::from_utf8(output.stdout).expect("UTF-8"),
            stderr: String::from_utf8(output.stderr).expect("UTF-8"),
        }
    }

    /// Runs a command that must succeed, and parses its JSON.
    pub fn json(&self, args: &[&str]) -> Value {
        let ran = self.run(args);
        assert_eq!(ran.code, 0, "{args:?}: {}", ran.stderr);
        serde_json::from_str(&ran.stdout).expect("one JSON document")
    }
}

/// The command in a folder, with its outputs captured.
pub fn command(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_torqcomp"));
    command
        .args(args)
        .current_dir(folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

impl Ran {
    /// Checks the exit code and that standard error contains all of these.
    pub fn says(&self, code: i32, parts: &[&str]) -> &Self {
        assert_eq!(self.code, code, "stderr: {}", self.stderr);
        for part in parts {
            assert!(
                self.stderr.contains(part),
                "{part:?} is not in: {}",
                self.stderr
            );
        }
        self
    }
}

/// Columns of a result: its headings and its numbers.
pub fn table(text: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut lines = text.lines();
    let head = lines
        .next()
        .expect("headings")
        .split(',')
        .map(str::to_owned)
        .collect();
    let rows = lines
        .map(|line| {
            line.split(',')
                .map(|cell| cell.parse().expect("a number"))
                .collect()
        })
        .collect();
    (head, rows)
}

/// One column of a result.
pub fn column(text: &str, name: &str) -> Vec<f64> {
    let (head, rows) = table(text);
    let place = head
        .iter()
        .position(|h| h == name || h.split_once(" [").is_some_and(|(own, _)| own == name))
        .unwrap_or_else(|| panic!("{name} in {head:?}"));
    rows.iter().map(|row| row[place]).collect()
}

/// Response of Hertel's stand, `K / (K − Jω² + jωf)`, in the units of the thesis: magnitude and
/// phase in rad. Written out here to be independent of the code under test.
pub fn hertel_response(frequency_hz: f64) -> (f64, f64) {
    let omega = std::f64::consts::TAU * frequency_hz;
    let (real, imaginary) = (8.1e4 - 5.85e-3 * omega * omega, 3.07 * omega);
    (8.1e4 / real.hypot(imaginary), -imaginary.atan2(real))
}

/// A steady record: torque components (amplitude in N m, Hz, rad) as shown by the beam, and the
/// torque itself, at a rate and for a number of samples.
pub fn steady(parts: &[(f64, f64, f64)], rate_hz: f64, count: usize) -> (Vec<f64>, Vec<f64>) {
    (0..count)
        .map(|i| {
            let t = i as f64 / rate_hz;
            parts
                .iter()
                .fold((0.0, 0.0), |(shown, acted), (a, f, phase)| {
                    let (gain, lag) = hertel_response(*f);
                    let turn = std::f64::consts::TAU * f * t + phase;
                    (
                        shown + a * gain * (turn + lag).cos(),
                        acted + a * turn.cos(),
                    )
                })
        })
        .unzip()
}

/// A recorder's file with `time_s` and another column, to 17 digits: `value` of the sample index.
pub fn sampled(heading: &str, rate_hz: f64, count: usize, value: impl Fn(usize) -> f64) -> String {
    let row = |i| format!("{},{:e}\n", i as f64 / rate_hz, value(i));
    let rows: String = (0..count).map(row).collect();
    format!("time_s,{heading}\n{rows}")
}

/// A recorder's file `time_s,bridge_V` of a torque in N m.
pub fn record(torque_n_m: &[f64], rate_hz: f64) -> String {
    let volts = |i: usize| torque_n_m[i] / (1.23e3 * 1.355_817_948_331_400_4);
    sampled("bridge_V", rate_hz, torque_n_m.len(), volts)
}

/// Fails with actual, expected and difference unless both agree to a relative tolerance.
#[track_caller]
pub fn assert_close(got: f64, want: f64, relative: f64) {
    let difference = (got - want).abs() / want.abs();
    assert!(
        difference <= relative,
        "got {got:e}, want {want:e}, relative difference {difference:e}"
    );
}
