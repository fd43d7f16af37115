//! Outputs appear whole or not at all.

use std::io::Read;
use std::process::Stdio;

use crate::noise::Noise;
use crate::util::{Folder, command, record, steady};

fn folder() -> Folder {
    let folder = Folder::new();
    let (shown, _) = steady(&[(1.0, 60.0, 0.0), (0.3, 1200.0, 1.0)], 20_000.0, 60_000);
    folder.write("in.csv", record(&shown, 20_000.0));
    folder
}

const COMPENSATE: [&str; 4] = ["compensate", "in.csv", "--stand", "stand.toml"];

#[test]
fn an_existing_output_is_kept_without_force() {
    let folder = folder();
    folder.write("out.csv", "precious\n");
    let args = [&COMPENSATE[..], &["-o", "out.csv"]].concat();
    folder.run(&args).says(1, &["out.csv exists", "--force"]);
    assert_eq!(folder.read("out.csv"), "precious\n");
    let forced = [&args[..], &["--force"]].concat();
    assert_eq!(folder.run(&forced).code, 0);
    assert_eq!(folder.read("out.csv").lines().count(), 60_001);
    assert_eq!(folder.names(), ["in.csv", "out.csv", "stand.toml"]);
}

#[test]
fn an_input_is_never_replaced() {
    let folder = folder();
    let before = folder.read("in.csv");
    for output in ["in.csv", "./in.csv", "stand.toml"] {
        let args = [&COMPENSATE[..], &["-o", output, "--force"]].concat();
        folder.run(&args).says(2, &["write to another file"]);
    }
    assert_eq!(folder.read("in.csv"), before);
    for verb in ["table", "predict"] {
        let args = [verb, "--stand", "stand.toml", "-o", "stand.toml", "--force"];
        assert_ne!(folder.run(&args).code, 0);
        assert_eq!(folder.read("stand.toml"), crate::util::HERTEL);
    }
    let both = [&COMPENSATE[..], &["-o", "a.csv", "--plot", "./a.csv"]].concat();
    folder.run(&both).says(2, &["write to another file"]);
}

#[cfg(unix)]
#[test]
fn links_and_permissions_are_kept() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    folder.write("real.csv", "old\n");
    std::fs::set_permissions(folder.path("real.csv"), PermissionsExt::from_mode(0o600)).unwrap();
    std::os::unix::fs::symlink("real.csv", folder.path("link.csv")).unwrap();
    let args = [&COMPENSATE[..], &["-o", "link.csv", "--force"]].concat();
    assert_eq!(folder.run(&args).code, 0);
    assert!(folder.path("link.csv").is_symlink());
    assert_eq!(folder.read("real.csv").lines().count(), 60_001);
    let mode = std::fs::metadata(folder.path("real.csv"))
        .unwrap()
        .permissions()
        .mode();
    assert_eq!(mode & 0o777, 0o600);
}

#[cfg(target_os = "linux")]
#[test]
fn talk_that_nobody_can_hear_is_no_failure() {
    let folder = folder();
    let full = std::fs::File::options()
        .write(true)
        .open("/dev/full")
        .expect("the device");
    let args = [&COMPENSATE[..], &["-o", "out.csv"]].concat();
    let ran = command(&folder.path(""), &args)
        .stderr(Stdio::from(full))
        .output()
        .expect("it ends");
    assert_eq!(ran.status.code(), Some(0));
    assert_eq!(folder.read("out.csv").lines().count(), 60_001);
}

#[test]
fn a_failed_run_leaves_the_old_output() {
    let folder = folder();
    folder.write("out.csv", "precious\n");
    let broken = folder.read("in.csv").replace("\n2.5,", "\n2.5,x");
    folder.write("in.csv", broken);
    let args = [&COMPENSATE[..], &["-o", "out.csv", "--force"]].concat();
    folder.run(&args).says(1, &["line 50002"]);
    assert_eq!(folder.read("out.csv"), "precious\n");
    assert_eq!(folder.names(), ["in.csv", "out.csv", "stand.toml"]);
}

#[test]
fn folders_that_are_not_there() {
    let folder = folder();
    let args = [&COMPENSATE[..], &["-o", "none/out.csv"]].concat();
    folder
        .run(&args)
        .says(1, &["none/out.csv", "folder none does not exist"]);
    let args = [&COMPENSATE[..], &["-o", "."]].concat();
    folder.run(&args).says(2, &["folder"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_named() {
    let folder = folder();
    let args = [&COMPENSATE[..], &["-o", "/dev/full"]].concat();
    folder.run(&args).says(1, &["/dev/full", "no space left"]);
    for verb in [&["table", "--stand", "stand.toml"][..], &COMPENSATE[..]] {
        let full = std::fs::File::options()
            .write(true)
            .open("/dev/full")
            .expect("the device");
        let ran = command(&folder.path(""), verb)
            .stdout(Stdio::from(full))
            .output()
            .expect("the binary ends");
        assert_eq!(ran.status.code(), Some(1), "{verb:?}");
        assert!(String::from_utf8_lossy(&ran.stderr).contains("no space left"));
    }
    assert_eq!(folder.names(), ["in.csv", "stand.toml"]);
}

#[cfg(unix)]
#[test]
fn a_reader_that_goes_away_is_no_failure() {
    let folder = folder();
    let mut child = command(&folder.path(""), &COMPENSATE)
        .spawn()
        .expect("the binary starts");
    let mut start = [0; 100];
    let mut pipe = child.stdout.take().expect("a pipe");
    pipe.read_exact(&mut start).expect("the first rows");
    drop(pipe);
    let ran = child.wait_with_output().expect("the binary ends");
    assert_eq!(ran.status.code(), Some(0));
    assert!(start.starts_with(b"time_s,torque_n_m\n0,"));
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_leaves_nothing() {
    let folder = folder();
    let mut child = command(
        &folder.path(""),
        &["compensate", "-", "--stand", "stand.toml", "-o", "out.csv"],
    )
    .stdin(Stdio::piped())
    .spawn()
    .expect("the binary starts");
    let mut pipe = child.stdin.take().expect("a pipe");
    std::io::Write::write_all(&mut pipe, folder.read("in.csv").as_bytes()).expect("rows");
    // It waits for more rows, its temporary file being open.
    let part = || folder.names().iter().any(|name| name.ends_with(".part"));
    for _ in 0..500 {
        if part() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    assert!(part(), "{:?}", folder.names());
    let killed = std::process::Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .expect("kill");
    assert!(killed.success());
    assert_eq!(child.wait().expect("the binary ends").code(), Some(130));
    drop(pipe);
    assert_eq!(folder.names(), ["in.csv", "stand.toml"]);
}

#[test]
fn pipes_in_and_out_give_the_same_bytes_as_files() {
    let folder = folder();
    let file = [&COMPENSATE[..], &["-o", "out.csv"]].concat();
    assert_eq!(folder.run(&file).code, 0);
    let bytes = folder.read("in.csv").into_bytes();
    let piped = folder.pipe(
        &["compensate", "-", "--stand", "stand.toml", "-o", "-"],
        &bytes,
    );
    assert_eq!(piped.code, 0, "{}", piped.stderr);
    assert!(piped.stdout == folder.read("out.csv"), "bytes differ");
}

#[test]
fn threads_do_not_change_a_byte() {
    let folder = folder();
    let run = |threads: &str, json: &str| {
        let args = [
            &COMPENSATE[..],
            &["-o", "out.csv", "--force", "--json", "--threads", threads],
        ]
        .concat();
        let ran = folder.run(&args);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        folder.write(json, &ran.stdout);
        (folder.read("out.csv"), ran.stdout)
    };
    let once = run("1", "1.json");
    for threads in ["2", "3", "8"] {
        assert!(run(threads, "n.json") == once, "{threads} threads");
    }
}

#[test]
fn json_is_one_document_and_talk_goes_to_stderr() {
    let folder = folder();
    let args = [&COMPENSATE[..], &["-o", "out.csv", "--json"]].concat();
    let report = folder.json(&args);
    assert_eq!(report["schema"], "torqcomp.compensate/1");
    assert_eq!(report["samples"], 60_000);
    assert_eq!(report["band_hz"], 2400.0);
    assert_eq!(report["unit"], "N m");
    assert!(report["noise"]["largest_gain"].as_f64().unwrap() > 15.0);
    // No uncertainty is known for this stand: null, not 0.
    assert!(report["noise"]["gain"][3]["relative_std"].is_null());
    let quiet = folder.run(&[&COMPENSATE[..], &["-q"]].concat());
    assert_eq!(quiet.stderr, "");
}

#[test]
fn strict_turns_a_warning_into_3() {
    let folder = Folder::new();
    // Nothing but noise above 100 Hz.
    let mut noise = Noise(1);
    let noisy: Vec<f64> = (0..60_000)
        .map(|i| (f64::from(i) * 0.01).sin() + 0.01 * (noise.uniform() - 0.5))
        .collect();
    folder.write("in.csv", record(&noisy, 20_000.0));
    let args = [&COMPENSATE[..], &["-o", "out.csv", "--force"]].concat();
    folder.run(&args).says(0, &["band-lost-in-noise", "--band"]);
    let strict = [&args[..], &["--strict"]].concat();
    folder.run(&strict).says(3, &["band-lost-in-noise"]);
    // The same record with a band that holds the signal has nothing to warn of.
    let low = [&args[..], &["--strict", "--band", "34"]].concat();
    assert_eq!(folder.run(&low).code, 0);
}

#[test]
fn a_plot_is_an_svg_file() {
    let folder = folder();
    let args = [
        &COMPENSATE[..],
        &[
            "-o",
            "out.csv",
            "--plot",
            "out.svg",
            "--plot-range",
            "0.1..0.12",
        ],
    ]
    .concat();
    assert_eq!(folder.run(&args).code, 0);
    let svg = folder.read("out.svg");
    assert!(svg.starts_with("<svg ") && svg.contains("compensated") && !svg.contains("NaN"));
    folder.run(&args).says(1, &["exists"]);
}
