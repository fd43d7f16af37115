//! Outputs are complete or absent.

use std::io::Read;
use std::process::{Child, ChildStdin, Stdio};

use crate::noise::Noise;
use crate::util::{Folder, command, record, sampled, signal, steady};

fn folder() -> Folder {
    let folder = Folder::new();
    let (shown, _) = steady(&[(1.0, 60.0, 0.0), (0.3, 1200.0, 1.0)], 20_000.0, 60_000);
    folder.write("in.csv", record(&shown, 20_000.0));
    folder
}

const COMPENSATE: [&str; 4] = ["compensate", "in.csv", "--stand", "stand.toml"];

#[test]
fn text_does_not_get_the_name_of_another_format() {
    let folder = folder();
    for (name, said) in [
        ("out.parquet", "COPY (FROM 'out.csv') TO 'out.parquet'"),
        ("out.Feather", "polars"),
        ("out.xlsx", "name it out.csv"),
    ] {
        let args = [&COMPENSATE[..], &["-o", name]].concat();
        folder.run(&args).says(2, &["text or MCAP", said]);
        folder
            .run(&["extract", "in.csv", "-o", name])
            .says(2, &["name it out.csv"]);
    }
    let named = [
        "extract",
        "in.csv",
        "-o",
        "out/",
        "--name",
        "{stem}.parquet",
    ];
    folder.run(&named).says(2, &["name it {stem}.csv"]);
    assert_eq!(folder.names(), ["in.csv", "stand.toml"]);
}

#[test]
fn an_existing_output_is_kept_without_force() {
    let folder = folder();
    folder.write("out.csv", "precious\n");
    let args = [&COMPENSATE[..], &["-o", "out.csv"]].concat();
    folder
        .run(&args)
        .says(1, &["out.csv: the output exists", "--force"]);
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
    let both = [&COMPENSATE[..], &["-o", "a.svg", "--plot", "./a.svg"]].concat();
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
    assert!(start.starts_with(b"time_s,compensated_torque_n_m\n0,"));
}

/// With this fault, incomplete outputs have temporary names, as on systems without unnamed files; with the other, which no
/// call has, they have none.
const NAMED: [&str; 2] = ["unnamed * 95", "none * 95"];

/// A run that has read the rows of the record and waits for more in its standard input.
fn waiting(mut run: std::process::Command, folder: &Folder) -> (Child, ChildStdin) {
    let child = run.stdin(Stdio::piped()).spawn();
    let mut child = child.expect("the program starts");
    let mut pipe = child.stdin.take().expect("a pipe");
    std::io::Write::write_all(&mut pipe, folder.read("in.csv").as_bytes()).expect("rows");
    (child, pipe)
}

/// A script in which `$0` is the binary.
fn in_shell(script: &str, folder: &Folder) -> std::process::Command {
    let mut shell = std::process::Command::new("sh");
    shell
        .args(["-c", script, env!("CARGO_BIN_EXE_torqcomp")])
        .current_dir(folder.path(""));
    shell
}

/// The compensation of standard input into a file.
const OF_STDIN: [&str; 6] = ["compensate", "-", "--stand", "stand.toml", "-o", "out.csv"];

/// Waits until a run has opened this many outputs, with or without a name.
#[cfg(unix)]
fn wait_for_outputs(folder: &Folder, child: &Child, count: usize) {
    let named = || {
        let names = folder.names();
        names.iter().filter(|name| name.ends_with(".part")).count()
    };
    let unnamed = || {
        let files = std::fs::read_dir(format!("/proc/{}/fd", child.id()));
        let links = files.into_iter().flatten().flatten();
        let links = links.filter_map(|file| std::fs::read_link(file.path()).ok());
        let deleted = links.filter(|to| to.to_string_lossy().ends_with(" (deleted)"));
        deleted.filter(|to| to.starts_with(folder.path(""))).count()
    };
    for _ in 0..1000 {
        if named().max(unnamed()) >= count {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    panic!("no {count} outputs in {:?}", folder.names());
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_leaves_nothing() {
    let folder = folder();
    let mut run = command(&folder.path(""), &OF_STDIN);
    run.env("TORQCOMP_FAULT", NAMED[0]);
    let (mut child, pipe) = waiting(run, &folder);
    // It waits for more rows with its temporary file open.
    wait_for_outputs(&folder, &child, 1);
    signal("TERM", &child);
    assert_eq!(child.wait().expect("the binary ends").code(), Some(143));
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
    assert_eq!(report["band_hz"], report["band"]["top_hz"]);
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
    // Only noise above 100 Hz.
    let mut noise = Noise(1);
    let noisy: Vec<f64> = (0..60_000)
        .map(|i| (f64::from(i) * 0.01).sin() + 0.01 * (noise.uniform() - 0.5))
        .collect();
    folder.write("in.csv", record(&noisy, 20_000.0));
    let args = [
        &COMPENSATE[..],
        &["-o", "out.csv", "--force", "--band", "rated"],
    ]
    .concat();
    folder.run(&args).says(0, &["band-lost-in-noise", "--band"]);
    let strict = [&args[..], &["--strict"]].concat();
    folder.run(&strict).says(3, &["band-lost-in-noise"]);
    // The same record with its automatic band causes no warning.
    let chosen = [&COMPENSATE[..], &["-o", "out.csv", "--force", "--strict"]].concat();
    assert_eq!(folder.run(&chosen).code, 0);
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

#[test]
fn one_file_cannot_be_two_outputs_or_input_and_output() {
    let folder = folder();
    std::fs::create_dir(folder.path("sub")).unwrap();
    let spelled = ["-o", "a.svg", "--plot", "sub/../a.svg"];
    let both = [&COMPENSATE[..], &spelled].concat();
    folder.run(&both).says(2, &["a.svg as well"]);
    let besides = ["-o", "a.csv", "--plot", "a.svg", "--html", "./a.svg"];
    let both = [&COMPENSATE[..], &besides].concat();
    folder.run(&both).says(2, &["a.svg as well"]);
    let diagnose = [
        "diagnose",
        "--train",
        "in.csv",
        "--applied",
        "2",
        "--measured",
        "3",
        "-o",
        "a.html",
        "--html",
        "./a.html",
    ];
    folder.run(&diagnose).says(2, &["a.html as well"]);
}

#[cfg(unix)]
#[test]
fn standard_input_is_not_replaced_while_it_is_read() {
    let folder = folder();
    let before = folder.read("in.csv");
    let args = [
        "compensate",
        "-",
        "--stand",
        "stand.toml",
        "-o",
        "in.csv",
        "--force",
    ];
    let ran = command(&folder.path(""), &args)
        .stdin(std::fs::File::open(folder.path("in.csv")).unwrap())
        .output()
        .expect("it ends");
    assert_eq!(ran.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&ran.stderr).contains("is standard input as well"));
    assert!(folder.read("in.csv") == before);
}

#[cfg(unix)]
#[test]
fn a_link_to_nothing_stays_one() {
    let folder = folder();
    std::fs::create_dir(folder.path("sub")).unwrap();
    std::os::unix::fs::symlink("sub/new.csv", folder.path("link.csv")).unwrap();
    let args = [&COMPENSATE[..], &["-o", "link.csv"]].concat();
    folder.run(&args).says(1, &["link.csv: the output exists"]);
    let forced = [&args[..], &["--force"]].concat();
    assert_eq!(folder.run(&forced).code, 0);
    assert!(folder.path("link.csv").is_symlink());
    assert_eq!(folder.read("sub/new.csv").lines().count(), 60_001);
}

/// The plot cannot be renamed, since a folder of that name is created during the run: the table must not appear
/// either.
#[cfg(unix)]
#[test]
fn two_outputs_appear_both_or_neither() {
    let cases = [None, Some("precious\n")].into_iter();
    for (old, named) in cases.flat_map(|old| NAMED.map(|named| (old, named))) {
        let folder = folder();
        if let Some(old) = old {
            folder.write("out.csv", old);
        }
        let args = [
            "compensate",
            "-",
            "--stand",
            "stand.toml",
            "-o",
            "out.csv",
            "--plot",
            "out.svg",
            "--force",
            "--json",
        ];
        let mut run = command(&folder.path(""), &args);
        run.env("TORQCOMP_FAULT", named);
        let (child, pipe) = waiting(run, &folder);
        wait_for_outputs(&folder, &child, 2);
        std::fs::create_dir(folder.path("out.svg")).unwrap();
        drop(pipe);
        let ran = child.wait_with_output().expect("it ends");
        assert_eq!(
            ran.status.code(),
            Some(1),
            "{}",
            String::from_utf8_lossy(&ran.stderr)
        );
        std::fs::remove_dir(folder.path("out.svg")).unwrap();
        match old {
            None => assert_eq!(folder.names(), ["in.csv", "stand.toml"]),
            Some(old) => {
                assert_eq!(folder.names(), ["in.csv", "out.csv", "stand.toml"]);
                assert_eq!(folder.read("out.csv"), old);
            }
        }
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_device_for_one_output_leaves_the_other_unwritten() {
    let folder = folder();
    let args = [&COMPENSATE[..], &["-o", "out.csv", "--plot", "/dev/full"]].concat();
    folder.run(&args).says(1, &["/dev/full", "no space left"]);
    assert_eq!(folder.names(), ["in.csv", "stand.toml"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_killed_run_leaves_nothing() {
    let folder = folder();
    let (mut child, _pipe) = waiting(command(&folder.path(""), &OF_STDIN), &folder);
    wait_for_outputs(&folder, &child, 1);
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(folder.names(), ["in.csv", "stand.toml"]);
}

/// A lack of memory that shows only during the run, from too little for its start to enough for all of it.
#[cfg(target_os = "linux")]
#[test]
fn a_run_without_memory_says_so_and_leaves_nothing() {
    let folder = folder();
    let mut said = String::new();
    for limit_kib in (16_000..).step_by(1000) {
        let script = format!("ulimit -v {limit_kib}; exec \"$0\" \"$@\"");
        let ran = in_shell(&script, &folder)
            .args(COMPENSATE)
            .args(["--whole-record", "-o", "out.csv"])
            .output()
            .expect("the shell starts");
        if ran.status.success() {
            break;
        }
        said.push_str(&String::from_utf8_lossy(&ran.stderr));
        assert_eq!(folder.names(), ["in.csv", "stand.toml"], "{limit_kib} kB");
    }
    assert!(said.contains("memory allocation of"), "{said}");
}

/// Rust's runtime opens `/dev/null` in place of a closed standard output.
#[cfg(target_os = "linux")]
#[test]
fn a_closed_standard_output_is_a_failure() {
    let folder = folder();
    let run = |rest: &str| {
        let script = format!("exec \"$0\" compensate in.csv --stand stand.toml {rest}");
        let ran = in_shell(&script, &folder).output();
        let ran = ran.expect("the shell starts");
        (
            ran.status.code(),
            String::from_utf8_lossy(&ran.stderr).into_owned(),
        )
    };
    let (code, said) = run(">&-");
    assert_eq!(code, Some(1), "{said}");
    assert!(
        said.contains("standard output: cannot be written: it is closed; redirect it"),
        "{said}"
    );
    for quiet in [">/dev/null", "<&- 2>&- >/dev/null", "-o out.csv >&-"] {
        assert_eq!(run(quiet).0, Some(0), "{quiet}");
    }
    assert_eq!(folder.names(), ["in.csv", "out.csv", "stand.toml"]);
}

#[cfg(target_os = "linux")]
#[test]
fn what_a_killed_run_left_is_removed_by_the_next() {
    let folder = folder();
    let start = || {
        let mut run = command(&folder.path(""), &OF_STDIN);
        run.env("TORQCOMP_FAULT", NAMED[0]);
        waiting(run, &folder)
    };
    let parts = || {
        folder
            .names()
            .iter()
            .filter(|name| name.ends_with(".part"))
            .count()
    };
    let wait = |count: usize| {
        while parts() < count {
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
    };
    let (mut killed, killed_pipe) = start();
    wait(1);
    // Another run that is still alive keeps its own.
    let (mut alive, alive_pipe) = start();
    wait(2);
    killed.kill().unwrap();
    killed.wait().unwrap();
    drop(killed_pipe);
    assert_eq!(parts(), 2);
    let done = [&COMPENSATE[..], &["-o", "third.csv"]].concat();
    assert_eq!(folder.run(&done).code, 0);
    assert_eq!(parts(), 1);
    drop(alive_pipe);
    assert_eq!(alive.wait().unwrap().code(), Some(0));
    assert_eq!(
        folder.names(),
        ["in.csv", "out.csv", "stand.toml", "third.csv"]
    );
}

#[cfg(target_os = "linux")]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").expect("the process");
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = u64::from_str_radix(mask.expect("a mask").trim(), 16).expect("a mask");
    mask >> (signal - 1) & 1 == 1
}

/// No signal that can be caught leaves files behind; ignored ones, as by `nohup`, remain ignored.
#[cfg(target_os = "linux")]
#[test]
fn signals_leave_nothing_or_are_ignored() {
    for (signal, number) in [
        ("TERM", 15),
        ("HUP", 1),
        ("QUIT", 3),
        ("XCPU", 24),
        ("INT", 2),
    ] {
        for ignored in [false, true] {
            // A shell's background job, or nohup, passes on ignored signals.
            if !ignored && is_ignored(number) {
                continue;
            }
            let folder = folder();
            let trap = match ignored {
                true => format!("trap '' {signal}; "),
                false => String::new(),
            };
            let script = format!("{trap}exec \"$0\" compensate - --stand stand.toml -o out.csv");
            let mut run = in_shell(&script, &folder);
            run.env("TORQCOMP_FAULT", NAMED[usize::from(ignored)])
                .stderr(Stdio::null());
            let (mut child, pipe) = waiting(run, &folder);
            wait_for_outputs(&folder, &child, 1);
            crate::util::signal(signal, &child);
            if !ignored {
                let code = child.wait().expect("it ends").code();
                assert_eq!(code, Some(128 + number), "{signal}");
                assert_eq!(folder.names(), ["in.csv", "stand.toml"], "{signal}");
                continue;
            }
            std::thread::sleep(std::time::Duration::from_millis(50));
            drop(pipe);
            assert_eq!(child.wait().expect("it ends").code(), Some(0), "{signal}");
            assert_eq!(
                folder.names(),
                ["in.csv", "out.csv", "stand.toml"],
                "{signal}"
            );
        }
    }
}

/// `ulimit -f` kills a writer by a signal unless that is handled.
#[cfg(target_os = "linux")]
#[test]
fn a_limit_of_file_sizes_leaves_nothing() {
    let folder = folder();
    let ran = std::process::Command::new("sh")
        .args([
            "-c",
            "ulimit -f 64; exec \"$0\" compensate in.csv --stand stand.toml -o out.csv",
        ])
        .arg(env!("CARGO_BIN_EXE_torqcomp"))
        .current_dir(folder.path(""))
        .output()
        .expect("the shell starts");
    assert_eq!(ran.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&ran.stderr).contains("out.csv: cannot be written"));
    assert_eq!(folder.names(), ["in.csv", "stand.toml"]);
}

#[test]
fn an_impossible_output_of_identify_is_refused_before_the_work() {
    let folder = folder();
    // The record could not be read either: the output is checked first.
    let args = ["identify", "decay", "none.csv", "-o", "none/stand.toml"];
    folder
        .run(&args)
        .says(1, &["the folder none does not exist"]);
}

/// `--strict` fails on a warning unless its code is allowed; an unknown code is a usage error.
#[test]
fn strict_lets_allowed_warnings_pass() {
    let folder = Folder::new();
    let wave = |i| (i as f64 * 0.05).cos();
    folder.write("record.csv", sampled("torque", 1e4, 400, wave));
    let args = [
        "simulate",
        "record.csv",
        "--stand",
        "stand.toml",
        "-o",
        "out.csv",
        "--force",
        "--strict",
    ];
    folder.run(&args).says(3, &["[unit-assumed]"]);
    let allowed = [&args[..], &["--allow", "unit-assumed"]].concat();
    folder.run(&allowed).says(0, &["[unit-assumed]"]);
    let other = [&args[..], &["--allow", "clipped"]].concat();
    folder.run(&other).says(3, &["[unit-assumed]"]);
    let wrong = [&args[..], &["--allow", "unit-asumed"]].concat();
    folder
        .run(&wrong)
        .says(2, &["did you mean \"unit-assumed\""]);
}
