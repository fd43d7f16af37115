//! Peak memory of the commands on records of two lengths: growth with the record, in bytes per row.

use std::collections::HashSet;
use std::fmt::Write as _;
use std::io::Write as _;
use std::process::Stdio;

use crate::util::{Folder, command};

/// Numbers of rows of the two records; the pieces processed by commands are shorter than the first.
const ROWS: [usize; 2] = [400_000, 1_200_000];
/// Bytes per row that count as zero: pieces of several sizes leave gaps between them.
const NONE: f64 = 12.0;

/// A record at 20 kHz with some of its channels: torque, bridge voltage, a decay that restarts every 2 s, and noise
/// with the response of a resonance to it; and lines with the response of a stand to them.
fn record(rows: usize, channels: &[&str]) -> String {
    let names: Vec<String> = channels.iter().map(|name| format!(",{name}")).collect();
    let mut text = format!("time_s{}\n", names.concat());
    let (mut noise, mut ringing) = (1_u64, [0.0; 2]);
    for i in 0..rows {
        let t = i as f64 / 20_000.0;
        let since = (i % 40_000) as f64 / 20_000.0;
        let torque = (377.0 * t).cos() + 0.3 * ((i * i % 1000) as f64).sin();
        noise = noise
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        let applied = (noise >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
        // A resonance at 0.3 rad per sample: 955 Hz.
        let (slow, fast) = (18.0 * t, 47.0 * t);
        let angle = slow.sin() + 0.2 * fast.sin();
        // 0.01 θ'' + 0.5 θ', in N m.
        let turning = 9.0 * slow.cos() - 3.24 * slow.sin() + 4.7 * fast.cos() - 4.418 * fast.sin();
        let answer = applied + 2.0 * 0.98 * 0.3_f64.cos() * ringing[0] - 0.98 * 0.98 * ringing[1];
        ringing = [answer, ringing[0]];
        let _ = write!(text, "{t:.5}");
        for channel in channels {
            let _ = match *channel {
                "torque_Nm" => write!(text, ",{torque:.5}"),
                "bridge_V" => write!(text, ",{:.7}", 1e-3 * torque),
                "ringing_V" => {
                    write!(
                        text,
                        ",{:.5}",
                        (-20.0 * since).exp() * (3707.0 * since).cos()
                    )
                }
                "angle_rad" => write!(text, ",{angle:.7}"),
                "turning_Nm" => write!(text, ",{:.5}", turning + 0.1 * applied),
                "noise_Nm" => write!(text, ",{applied:.5}"),
                "answer_V" => write!(text, ",{answer:.5}"),
                "driving_Nm" => write!(text, ",{:.5}", driven(t)[0]),
                "driven_Nm" => write!(text, ",{:.5}", driven(t)[1] + 0.01 * applied),
                other => panic!("no channel {other}"),
            };
        }
        text.push('\n');
    }
    text
}

/// A torque of 12 lines from 50 to 1260 Hz, and the response of a stand with 600 Hz and a damping ratio of 0.02.
fn driven(t: f64) -> [f64; 2] {
    let line = |k: i32| {
        let hz = 50.0 + 110.3 * f64::from(k);
        let ratio = hz / 600.0;
        let (real, imaginary) = (1.0 - ratio * ratio, 0.04 * ratio);
        let phase = std::f64::consts::TAU * hz * t + f64::from(k * k);
        let lag = imaginary.atan2(real);
        [phase.cos(), (phase - lag).cos() / real.hypot(imaginary)]
    };
    (0..12)
        .map(line)
        .fold([0.0; 2], |sum, [u, y]| [sum[0] + u, sum[1] + y])
}

/// Peak resident memory of a run so far, in bytes.
fn peak(process: u32) -> Option<f64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: f64 = line.trim().strip_suffix(" kB")?.parse().ok()?;
    Some(1024.0 * kibibytes)
}

/// Peak resident memory of a run that must succeed, in bytes.
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

/// A command, the channels of its record, the rows of a short and a long one, and the maximum bytes per row stated in
/// docs/reliability.md.
type Measured = (&'static str, &'static [&'static str], [usize; 2], f64);

const VERBS: [Measured; 10] = [
    (
        "compensate LONG --stand stand.toml -o out.csv --force",
        &["bridge_V"],
        ROWS,
        NONE,
    ),
    (
        "compensate LONG --stand refined.toml -o out.csv --force",
        &["bridge_V"],
        ROWS,
        NONE,
    ),
    ("extract LONG -o out.csv --force", &["bridge_V"], ROWS, NONE),
    (
        "simulate LONG --stand stand.toml -o out.csv --force",
        &["torque_Nm"],
        ROWS,
        NONE,
    ),
    (
        "harmonics LONG --stand stand.toml --fundamental 60 --orders 1-5 --refine",
        &["bridge_V"],
        ROWS,
        NONE,
    ),
    // Its first 4 million numbers are kept.
    (
        "inspect LONG",
        &["torque_Nm", "bridge_V", "ringing_V"],
        [1_100_000, 2_000_000],
        NONE,
    ),
    // Twelve decays are fitted, those of 24 s.
    (
        "identify decay LONG",
        &["ringing_V"],
        [1_100_000, 2_000_000],
        32.0,
    ),
    (
        "identify response LONG --applied noise --measured answer --excitation random --modes 1 --band 300..3000",
        &["noise_Nm", "answer_V"],
        ROWS,
        95.0,
    ),
    (
        "identify runup LONG --motion angle --torque turning",
        &["angle_rad", "turning_Nm"],
        ROWS,
        110.0,
    ),
    (
        "diagnose --train LONG --applied driving --measured driven",
        &["driving_Nm", "driven_Nm"],
        [20_000, 60_000],
        700.0,
    ),
];

/// The stand of `stand.toml` with an effect without a frequency response.
const EFFECT: &str = "\n[[effects]]\nkind = \"cubic-stiffness\"\nform = \"beside\"\ncoefficient = \"1e-5 N m/(N m)^3\"\n";

#[test]
fn memory_grows_by_no_more_than_is_stated() {
    let folder = Folder::new();
    let refined = folder.read("stand.toml") + EFFECT;
    folder.write("refined.toml", refined);
    let mut wrong = String::new();
    let mut written = HashSet::new();
    for (verb, channels, rows, most) in VERBS {
        let [short, long] = rows.map(|rows| {
            let name = format!("{}_{rows}.csv", channels.join("_"));
            if written.insert(name.clone()) {
                folder.write(&name, record(rows, channels));
            }
            let line = verb.replace("LONG", &name);
            peak_of(&folder, &line.split(' ').collect::<Vec<_>>())
        });
        let slope = (long - short) / (rows[1] - rows[0]) as f64;
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

/// A decompression bomb of rows takes no more memory than its text.
#[test]
fn a_packed_record_takes_as_much_as_its_text() {
    let folder = Folder::new();
    let text = "0.5,1.25\n".repeat(4_000_000);
    let text = format!("x_V,y_V\n{text}");
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    packed.write_all(text.as_bytes()).expect("memory takes all");
    let packed = packed.finish().expect("memory takes all");
    assert!(200 * packed.len() < text.len(), "{}", packed.len());
    folder.write("plain", text).write("packed", packed);
    let [plain, packed] = ["plain", "packed"].map(|name| {
        let words = ["extract", name, "--channel", "x", "--rate", "1000"];
        peak_of(&folder, &words)
    });
    println!(
        "{:.0} MB of the text, {:.0} MB packed",
        plain / 1e6,
        packed / 1e6
    );
    assert!(packed < plain + 4e6, "{plain} and {packed} bytes");
}

/// Data that cannot fit is rejected before anything is read or written.
#[test]
fn a_text_without_room_is_refused() {
    let folder = Folder::new();
    folder.write("long.csv", record(10_000, &["ringing_V"]));
    let file = std::fs::File::options()
        .write(true)
        .open(folder.path("long.csv"));
    // The rest takes no space on the disk.
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
        said.contains("at least 3.2 GB of memory, and this process may have 1 GB"),
        "{said}"
    );
    assert_eq!(folder.names(), ["long.csv", "stand.toml"]);
}

/// So is a diagnosis whose records fit, but not the fits to them.
#[test]
fn a_diagnosis_without_room_is_refused() {
    let folder = Folder::new();
    let rows = "0.5,1.25\n-0.5,0.25\n".repeat(3_000_000);
    folder.write("long.csv", format!("driving_Nm,driven_Nm\n{rows}"));
    let script = "ulimit -v 580000; exec \"$0\" diagnose --train long.csv --rate 1000 --applied driving \
                  --measured driven";
    let ran = std::process::Command::new("sh")
        .args(["-c", script, env!("CARGO_BIN_EXE_torqcomp")])
        .current_dir(folder.path(""))
        .output()
        .expect("the shell starts");
    let said = String::from_utf8_lossy(&ran.stderr);
    assert_eq!(ran.status.code(), Some(1), "{said}");
    assert!(
        said.contains("the fits take at least 0.6 GB of memory, and this process may have 0.59 GB"),
        "{said}"
    );
    assert!(
        said.contains("choose a shorter part with --range"),
        "{said}"
    );
}
