//! `table` against Appendix D of the thesis and against an explicit formula of the response.

use crate::util::{Folder, hertel_response, table as rows_of};

/// The row at 0 Hz, with uncertainties.
const AT_REST: [&str; 6] = [
    "table",
    "--stand",
    "stand.toml",
    "--to",
    "0",
    "--uncertainty",
];

#[test]
fn the_default_table_is_that_of_the_thesis() {
    let ran = Folder::new().run(&["table", "--stand", "stand.toml"]);
    let (head, rows) = rows_of(&ran.stdout);
    assert_eq!(head, ["frequency_hz", "magnitude", "phase_deg"]);
    assert_eq!(rows.len(), 251);
    for row in &rows {
        let (gain, lag) = hertel_response(row[0]);
        assert!((row[1] * gain - 1.0).abs() < 1e-9, "{row:?}");
        assert!((row[2] + lag.to_degrees()).abs() < 1e-7, "{row:?}");
    }
    // Printed: 590 Hz, 0.14070231, 86.94786072.
    assert!(
        (rows[59][1] - 0.140_702_31).abs() < 1e-6 && (rows[59][2] - 86.947_860_72).abs() < 5e-4
    );
}

#[test]
fn a_delay_adds_to_the_phase_without_folding() {
    let folder = Folder::new();
    folder.write(
        "stand.toml",
        format!("{}[recorder]\ndelay = \"1 ms\"\n", crate::util::HERTEL),
    );
    let ran = folder.run(&[
        "table",
        "--stand",
        "stand.toml",
        "--from",
        "2000",
        "--to",
        "2000",
    ]);
    let (_, rows) = rows_of(&ran.stdout);
    let (_, lag) = hertel_response(2000.0);
    assert!(
        (rows[0][2] - (720.0 - lag.to_degrees())).abs() < 1e-6,
        "{rows:?}"
    );
}

#[test]
fn linear_effects_are_in_it_and_others_are_refused() {
    let folder = Folder::new();
    let stand = |effect: &str| {
        let text = format!("{}[[effects]]\n{effect}\n", crate::util::HERTEL);
        folder.write("stand.toml", text);
        folder.run(&[
            "table",
            "--stand",
            "stand.toml",
            "--from",
            "500",
            "--to",
            "500",
        ])
    };
    let ran = stand("kind = \"recorder-lowpass\"\nform = \"order-1\"\ncutoff = \"500 Hz\"");
    let (_, rows) = rows_of(&ran.stdout);
    // At its corner a low-pass has a gain of 1/√2 and a lag of 45 degrees.
    let (gain, lag) = hertel_response(500.0);
    assert!(
        (rows[0][1] * gain / 2.0_f64.sqrt() - 1.0).abs() < 1e-9,
        "{rows:?}"
    );
    assert!(
        (rows[0][2] - (45.0 - lag.to_degrees())).abs() < 1e-7,
        "{rows:?}"
    );
    let ran = stand("kind = \"capacitive-coupling\"\nform = \"ac-coupled\"\ncorner = \"500 Hz\"");
    // A series capacitor at its corner: 1/√2 as well, with a lead of 45 degrees; it blocks DC.
    let (_, rows) = rows_of(&ran.stdout);
    assert!(
        (rows[0][2] - (-45.0 - lag.to_degrees())).abs() < 1e-7,
        "{rows:?}"
    );
    let at_rest = folder.run(&AT_REST);
    assert_eq!(at_rest.stdout.lines().nth(1), Some("0,,,,"));
    let cubic = "kind = \"cubic-stiffness\"\nform = \"beside\"\ncoefficient = \"1 N m/(N m)^3\"";
    stand(cubic).says(1, &["cubic-stiffness", "no frequency response"]);
}

#[test]
fn uncertainty_is_empty_where_it_is_unknown() {
    let folder = Folder::new();
    let ran = folder.run(&AT_REST);
    assert_eq!(ran.stdout.lines().nth(1), Some("0,1,0,,"));
    let known = crate::util::HERTEL.replace(
        "\"8.1e4 ft lbf/rad\"",
        "{ value = \"8.1e4 ft lbf/rad\", std = \"810 ft lbf/rad\" }",
    );
    folder.write("stand.toml", known);
    let report = folder.json(&[
        "table",
        "--stand",
        "stand.toml",
        "--from",
        "2400",
        "--to",
        "2400",
        "--json",
    ]);
    // Far above resonance the inverse is Jω²/K: one per cent of K is one per cent of it, a little
    // more because of the 1 that is subtracted, 16.4/15.4.
    let std = report["rows"][0]["magnitude_relative_std"]
        .as_f64()
        .unwrap();
    assert!((std - 0.01 * 16.4 / 15.4).abs() < 2e-4, "{std}");
}
