use super::*;

fn layout(text: &str) -> Layout {
    find(text.as_bytes(), true, &DialectOverride::default()).unwrap()
}

fn names(layout: &Layout) -> Vec<&str> {
    layout.columns.iter().map(|c| c.name.as_str()).collect()
}

fn units(layout: &Layout) -> Vec<Option<&str>> {
    layout
        .columns
        .iter()
        .map(|c| c.unit.as_ref().map(|u| u.text.as_str()))
        .collect()
}

#[test]
fn plain_csv() {
    let found = layout("time_s,bridge_V\n0,0.5\n0.1,0.6\n");
    assert_eq!(found.dialect.delimiter, Delimiter::Byte(b','));
    assert_eq!(names(&found), ["time", "bridge"]);
    assert_eq!(units(&found), [Some("s"), Some("V")]);
    assert_eq!(
        (found.heading_line, found.data_line, found.data_offset),
        (Some(1), 2, 16)
    );
}

#[test]
fn decimal_comma_with_semicolon_tab_and_spaces() {
    for (text, delimiter) in [
        (
            "Zeit [s];Kraft [N]\n0,0;1,5\n0,1;1,6\n",
            Delimiter::Byte(b';'),
        ),
        ("0,0\t1,5\n0,1\t1,6\n", Delimiter::Byte(b'\t')),
        ("0,0  1,5\n0,1  1,6\n", Delimiter::Spaces),
    ] {
        let found = layout(text);
        assert_eq!(
            found.dialect,
            Dialect {
                delimiter,
                decimal: b','
            },
            "{text}"
        );
        assert_eq!(found.columns.len(), 2);
    }
}

#[test]
fn preamble_units_row_and_odd_lines_between() {
    let found = layout(
        "C:\\data\\test.txt\nSampling Frequency - 5000\nMon, Jun 6, 2022\nAccel\tSG_300_a\tTime\n\
         Voltage (unscaled)\tVoltage (unscaled)\tSec\n0.0 0.0\t\t\n\n1.0\t2.0\t0.0E+0\n1.0\t2.5\t2.0E-4\n",
    );
    assert_eq!(names(&found), ["Accel", "SG_300_a", "Time"]);
    assert_eq!(units(&found), [None, None, Some("Sec")]);
    assert_eq!((found.heading_line, found.data_line), (Some(4), 8));
}

#[test]
fn units_row_of_its_own() {
    let found = layout("time,force\n(ms),(N)\n0,1\n1,2\n2,3\n");
    assert_eq!(names(&found), ["time", "force"]);
    assert_eq!(units(&found), [Some("ms"), Some("N")]);
}

#[test]
fn trailing_separator_bom_and_crlf() {
    let found = layout("\u{feff}Time [s]\tTorque [N m]\t\r\n0.000\t  1.5\t\r\n0.001\t  1.6\t\r\n");
    assert_eq!(names(&found), ["Time", "Torque"]);
    assert_eq!(found.columns.len(), 2);
}

#[test]
fn headings_in_a_comment_and_quoted() {
    assert_eq!(
        names(&layout("# a file\n# time_s,bridge_V\n0,1\n1,2\n")),
        ["time", "bridge"]
    );
    assert_eq!(
        names(&layout("\"time, rel\",\"U (V)\"\n0,1\n1,2\n")),
        ["time, rel", "U"]
    );
}

#[test]
fn no_headings() {
    let found = layout("0 1.5\n1 1.6\n");
    assert_eq!(names(&found), ["column 1", "column 2"]);
    assert_eq!(found.heading_line, None);
    assert_eq!(layout("0.5\n0.6\n0.7\n").columns.len(), 1);
}

#[test]
fn a_comma_that_could_be_either_is_asked_for() {
    let error = find(b"0,5\n0,6\n0,7\n", true, &DialectOverride::default()).unwrap_err();
    assert!(error.to_string().contains("--decimal ,"), "{error}");
    // Headings settle it, and so does the user.
    assert_eq!(layout("time_s,bridge_V\n0,5\n1,6\n").columns.len(), 2);
    let told = DialectOverride {
        decimal: Some(b','),
        ..DialectOverride::default()
    };
    assert_eq!(
        find(b"0,5\n0,6\n0,7\n", true, &told).unwrap().columns.len(),
        1
    );
}

#[test]
fn what_is_no_table_is_refused() {
    for text in ["", "\n\n", "hello\nworld\n", "a,b,c\nd,e,f\n"] {
        let error = find(text.as_bytes(), true, &DialectOverride::default()).unwrap_err();
        let message = error.to_string();
        assert!(
            message.contains("empty") || message.contains("no table"),
            "{message}"
        );
    }
}

#[test]
fn latin_1_headings_are_read() {
    let found = find(
        b"Zeit (s);Dehnung (\xB5m/m)\n0;1\n1;2\n",
        true,
        &DialectOverride::default(),
    )
    .unwrap();
    assert_eq!(units(&found), [Some("s"), Some("µm/m")]);
}
