//! Help, pages and plots: output for readers in addition to numbers.

use std::process::Stdio;

use crate::util::{Folder, command, record, steady};

/// A record of the thesis' stand at 5 kHz: 3 N m at 40 Hz and 1 N m at 230 Hz.
const RATE_HZ: f64 = 5000.0;

fn recorded(count: usize) -> String {
    let (shown, _) = steady(&[(3.0, 40.0, 0.0), (1.0, 230.0, 1.0)], RATE_HZ, count);
    record(&shown, RATE_HZ)
}

/// The record without the lines of some samples.
fn without(samples: std::ops::Range<usize>, count: usize) -> String {
    let text = recorded(count);
    let lines = text.lines().enumerate();
    let kept = lines.filter(|(line, _)| *line == 0 || !samples.contains(&(line - 1)));
    kept.map(|(_, line)| format!("{line}\n")).collect()
}

const COMPENSATE: [&str; 6] = [
    "compensate",
    "run.csv",
    "--stand",
    "stand.toml",
    "--band",
    "800",
];

fn compensate<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&COMPENSATE[..], more].concat()
}

#[test]
fn a_picture_of_another_format_is_refused_by_name_before_the_work() {
    let folder = Folder::new();
    folder.write("run.csv", recorded(2000));
    // There is no such stand: the picture is rejected before the stand is searched for.
    for verb in [
        &[
            "compensate",
            "run.csv",
            "--stand",
            "none.toml",
            "-o",
            "t.csv",
        ][..],
        &["inspect", "run.csv"],
    ] {
        let ran = folder.run(&[verb, &["--plot", "x.png"]].concat());
        ran.says(2, &["x.png", "SVG", "x.svg"]);
    }
    assert_eq!(folder.names(), ["run.csv", "stand.toml"]);
    let ran = folder.run(&compensate(&["-o", "t.csv", "--plot", "T.SVG"]));
    ran.says(0, &[]);
    assert!(folder.read("T.SVG").starts_with("<svg"));
}

#[test]
fn help_is_wrapped_at_the_width_of_the_terminal() {
    let folder = Folder::new();
    let ran = command(&folder.path(""), &["compensate", "--help"])
        .env("COLUMNS", "80")
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let text = String::from_utf8(ran.stdout).unwrap();
    let longest = text
        .lines()
        .max_by_key(|line| line.chars().count())
        .unwrap();
    assert!(longest.chars().count() <= 80, "{longest}");
    assert!(text.contains("Input:") && text.contains("Method:"));
}

#[test]
fn a_page_begins_with_where_it_comes_from() {
    let folder = Folder::new();
    folder.write("run.csv", "abc");
    let plain = std::fs::read(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/recordings/loads.csv"
    ));
    folder.write("it's.csv", plain.unwrap());
    let ran = command(
        &folder.path(""),
        &[
            "identify",
            "static",
            "it's.csv",
            "--load",
            "weight",
            "--reading",
            "bridge",
            "--html",
            "page.html",
        ],
    )
    .env("SOURCE_DATE_EPOCH", "1700000000")
    .output()
    .unwrap();
    assert!(
        ran.status.success(),
        "{}",
        String::from_utf8_lossy(&ran.stderr)
    );
    let page = folder.read("page.html");
    let head = page.split("<h2>").next().unwrap();
    // `date -u -d @1700000000` and `sha256sum tests/recordings/loads.csv`.
    for part in [
        "2023-11-14T22:13:20Z",
        concat!("torqcomp ", env!("CARGO_PKG_VERSION")),
        "torqcomp identify static 'it'\\''s.csv' --load weight --reading bridge --html page.html",
        "it's.csv, SHA-256 cd6c9742a59c9e905295af8ad3890ba9121be6460ccc75dd730d73fffe5b28ff",
        "<dt>stand file</dt><dd>none</dd>",
    ] {
        assert!(head.contains(part), "{part}\n{head}");
    }
    let ran = command(
        &folder.path(""),
        &[
            "diagnose",
            "--train",
            "x",
            "--applied",
            "1",
            "--measured",
            "2",
            "--html",
            "p",
        ],
    )
    .env("SOURCE_DATE_EPOCH", "yesterday")
    .output()
    .unwrap();
    assert_eq!(ran.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&ran.stderr).contains("SOURCE_DATE_EPOCH"));
}

#[test]
fn a_compensation_has_its_page() {
    let folder = Folder::new();
    let text = recorded(40_000);
    let ran = folder.pipe(
        &[
            "compensate",
            "-",
            "--stand",
            "stand.toml",
            "-o",
            "torque.csv",
            "--html",
            "page.html",
        ],
        text.as_bytes(),
    );
    ran.says(0, &[]);
    let page = folder.read("page.html");
    for part in [
        "<dt>input</dt><dd>standard input</dd>",
        "<dt>stand file</dt><dd>stand.toml, SHA-256 ",
        "stiffness = &quot;8.1e4 ft lbf/rad&quot;",
        "time, s",
        "frequency, Hz",
        "N m/√Hz",
        "gain, no unit",
        "compensated band",
        "chosen for the least expected error from the record and its noise",
        "Uncertainty: ",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert_eq!(page.matches("<figure>").count(), 3);
    assert!(
        !page.contains("NaN") && page.len() < 600_000,
        "{}",
        page.len()
    );
}

/// Peak of a line in a page's chart, in axis units: logarithms on a logarithmic axis.
pub(crate) fn highest(page: &str, title: &str, series: usize) -> (f64, f64) {
    let figure = page.split("<figure>").find(|f| f.contains(title)).unwrap();
    let drawing = figure.split("data-axes=\"").nth(1).unwrap();
    let axes: Vec<f64> = drawing
        .split('"')
        .next()
        .unwrap()
        .split(' ')
        .map(|number| number.parse().unwrap())
        .collect();
    let [left, right, top, bottom, x0, x1, _, y0, y1, _] = axes[..] else {
        panic!("{axes:?}");
    };
    let path = drawing.split("<path class=\"line").nth(1 + series).unwrap();
    let path = path
        .split("d=\"")
        .nth(1)
        .unwrap()
        .split('"')
        .next()
        .unwrap();
    let points = path.split(['M', 'L']).filter(|point| !point.is_empty());
    let points = points.map(|point| {
        let (x, y) = point.split_once(' ').unwrap();
        (x.parse::<f64>().unwrap(), y.parse::<f64>().unwrap())
    });
    let (x, y) = points.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
    (
        x0 + (x - left) / (right - left) * (x1 - x0),
        y0 + (bottom - y) / (bottom - top) * (y1 - y0),
    )
}

#[test]
fn the_charts_of_a_compensation_show_what_was_computed() {
    let folder = Folder::new();
    folder.write("run.csv", recorded(40_000));
    folder
        .run(&compensate(&["-o", "torque.csv", "--html", "page.html"]))
        .says(0, &[]);
    let page = folder.read("page.html");
    // A line of amplitude a in a Hann window of 4096 samples at 5 kHz has the mean square a²/2, and at its centre the
    // density a²/2 / (1.5 Δf): 3 N m at 40 Hz, which is 0.23 bins off (−0.08 dB of its power).
    let (x, y) = highest(&page, "Amplitude spectral density", 1);
    let step_hz: f64 = 5000.0 / 4096.0;
    let density = (4.5 / (1.5 * step_hz)).sqrt();
    assert!(
        (10_f64.powf(x) - 40.0).abs() < step_hz,
        "{}",
        10_f64.powf(x)
    );
    assert!(
        (10_f64.powf(y) / density - 1.0).abs() < 0.05,
        "{} {density}",
        10_f64.powf(y)
    );
    // 1/|H| of the thesis' stand at 800 Hz is 0.9176; for a band that ends there the gain falls above it.
    let (x, gain) = highest(&page, "Torque per recorded torque", 0);
    let inverse = 1.0 / crate::util::hertel_response(x).0;
    assert!(
        gain < inverse * 1.01 && gain > 0.5 * inverse,
        "{x} {gain} {inverse}"
    );
}

#[test]
fn what_was_bridged_is_listed_and_marked_with_what_it_affects() {
    let folder = Folder::new();
    // 10 samples from 0.4 s on are missing: from 0.3998 s to 0.402 s.
    folder.write("run.csv", without(2000..2010, 5000));
    for way in [&["--fill", "linear"][..], &["--resample"]] {
        let outputs = [
            "-o", "t.csv", "--force", "--plot", "t.svg", "--html", "t.html",
        ];
        let report = folder.json(&compensate(&[way, &outputs, &["--json"]].concat()));
        let filled = report["filled"].as_array().expect("a list");
        assert_eq!(filled.len(), 1, "{way:?}");
        let number = |key: &str| filled[0][key].as_f64().unwrap();
        assert!((number("from_s") - 0.3998).abs() < 1e-9 && (number("to_s") - 0.402).abs() < 1e-9);
        assert_eq!(filled[0]["samples"], 10);
        let reach_s = report["reach_s"].as_f64().unwrap();
        assert!(reach_s > 1.0 / RATE_HZ && reach_s < 0.1, "{reach_s}");
        let ran = folder.run(&compensate(&[way, &outputs].concat()));
        ran.says(
            0,
            &[
                "filled in    10 samples at 1 place",
                "0.3998 s to 0.402 s (10)",
            ],
        );
        for file in ["t.svg", "t.html"] {
            let text = folder.read(file);
            for class in ["filled", "smeared"] {
                assert!(
                    text.contains(&format!("<rect class=\"{class}\"")),
                    "{file} {class}"
                );
            }
        }
    }
    // The result differs from that of the whole record only within the marked intervals.
    let report = folder.json(&compensate(&["--fill", "linear", "-o", "a.csv", "--json"]));
    folder.write("run.csv", recorded(5000));
    folder.run(&compensate(&["-o", "b.csv"])).says(0, &[]);
    let [a, b] = ["a.csv", "b.csv"]
        .map(|file| crate::util::column(&folder.read(file), "compensated_torque_n_m"));
    let difference: Vec<f64> = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).collect();
    let largest = difference.iter().copied().fold(0.0, f64::max);
    let reach_s = report["reach_s"].as_f64().unwrap();
    let is_marked = |i: usize| (0.3998 - reach_s..=0.402 + reach_s).contains(&(i as f64 / RATE_HZ));
    let outside = (0..5000).filter(|i| !is_marked(*i)).map(|i| difference[i]);
    let outside = outside.fold(0.0, f64::max);
    assert!(
        largest > 1e-3 && outside < 0.02 * largest,
        "{outside} {largest}"
    );
}

/// Axis labels of all charts in a picture or a page: centred texts below a panel, and above it.
fn axis_labels(svg: &str) -> Vec<String> {
    let mut found = Vec::new();
    for text in svg.split("<text ").skip(1) {
        let (attributes, rest) = text.split_once('>').unwrap();
        let content = rest.split_once("</text>").unwrap().0;
        let plain = content
            .replace("<tspan class=\"name\">", "")
            .replace("</tspan>", "");
        let is_number = plain.trim().replace('\u{2212}', "-").parse::<f64>().is_ok();
        let is_x = attributes.contains("text-anchor=\"middle\"") && !is_number;
        let is_left = ["x=\"8\"", "x=\"78\""]
            .iter()
            .any(|x| attributes.starts_with(x));
        let is_y = is_left && !attributes.contains("text-anchor") && !attributes.contains("class=");
        if is_x || is_y {
            found.push(plain);
        }
    }
    found
}

/// Every axis of every chart names its quantity and its unit.
#[test]
fn every_axis_has_a_quantity_and_a_unit() {
    let folder = Folder::new();
    folder.write("run.csv", recorded(4000));
    let mut pictures = Vec::new();
    let args = compensate(&["-o", "t.csv", "--plot", "plot.svg", "--html", "page.html"]);
    folder.run(&args).says(0, &[]);
    pictures.extend(["plot.svg", "page.html"]);
    folder
        .run(&["inspect", "run.csv", "--plot", "inspect.svg", "-o", "i.txt"])
        .says(0, &[]);
    folder.write("no-time.csv", "1\n2\n4\n3\n2\n");
    folder.run(&[
        "inspect",
        "no-time.csv",
        "--plot",
        "no-time.svg",
        "-o",
        "n.txt",
    ]);
    pictures.extend(["inspect.svg", "no-time.svg"]);
    let mut ring = "time_s,T [N m],a [rad]\n".to_owned();
    let mut torque = "time_s,T [N m],w [rad/s]\n".to_owned();
    let mut noise = crate::noise::Noise(7);
    let (mut x, mut v, mut w) = (0.0, 0.0, 0.0);
    for i in 0..6000 {
        let t = f64::from(i) / 1000.0;
        let drive = if i % 1000 == 100 { 200.0 } else { 0.0 };
        // A spring of 2800 N m/rad at 40 Hz.
        for _ in 0..20 {
            let a = drive - (2.0 * std::f64::consts::PI * 40.0_f64).powi(2) * x - 20.0 * v;
            v += a * 5e-5;
            x += v * 5e-5;
        }
        ring += &format!("{t},{drive},{:.9}\n", x + 1e-6 * noise.uniform());
        let push = (t * 3.0).sin();
        w += (push - 0.1 * w) * 1e-3 / 0.05;
        torque += &format!("{t},{:.6},{w:.6}\n", push + 1e-3 * noise.uniform());
    }
    folder.write("hits.csv", ring).write("runup.csv", torque);
    folder.write("decay.csv", {
        let row = |i: i32| {
            let t = f64::from(i) / 1000.0;
            format!("{t},{:.6}\n", (-3.0 * t).exp() * (250.0 * t).cos())
        };
        format!("time_s,U [mV]\n{}", (0..2000).map(row).collect::<String>())
    });
    folder.write(
        "loads.csv",
        "load [N m],U [V]\n0,0.01\n5,1.01\n10,2.012\n5,1.011\n0,0.011\n",
    );
    let tests: [&[&str]; 4] = [
        &["decay", "decay.csv"],
        &["response", "hits.csv", "--applied", "T", "--measured", "a"],
        &["runup", "runup.csv", "--torque", "T", "--motion", "w"],
        &["static", "loads.csv", "--load", "load", "--reading", "U"],
    ];
    let pages = ["decay.html", "response.html", "runup.html", "static.html"];
    for (test, page) in tests.iter().zip(pages) {
        let ran = folder.run(&[&["identify"], *test, &["--html", page]].concat());
        assert_eq!(ran.code, 0, "{}", ran.stderr);
    }
    pictures.extend(pages);
    let known = [
        "no unit",
        "unit not given",
        "as recorded",
        "samples",
        "%",
        "degrees",
    ];
    for picture in pictures {
        let labels = axis_labels(&folder.read(picture));
        assert!(labels.len() >= 2, "{picture}: {labels:?}");
        for label in labels {
            let label = label.replace(" (no numbers)", "");
            let (quantity, unit) = label
                .rsplit_once(", ")
                .unwrap_or_else(|| panic!("{picture}: \"{label}\""));
            let bare = unit.trim_end_matches("/√Hz");
            let is_unit = known.contains(&unit) || torqcomp_model::Unit::parse(bare).is_ok();
            assert!(is_unit && !quantity.is_empty(), "{picture}: \"{label}\"");
        }
    }
}
