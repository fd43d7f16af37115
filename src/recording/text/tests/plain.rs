use super::*;
use crate::io::csv::Delimiter;
use crate::recording::HoleKind;

#[test]
fn units_in_names_and_in_a_row() {
    for head in [
        "time_s,torque_Nm",
        "Time [s],torque [Nm]",
        "\"Time (s)\",\"torque (Nm)\"",
        "t / s,torque / Nm",
        "Time,torque\ns,Nm",
        "Time,torque\n(s),(Nm)",
        "# made by hand\n# Time [s],torque [Nm]",
        "Zeit in s,torque in Nm",
    ] {
        let found = read(&format!("{head}\n0,1.5\n0.001,1.6\n0.002,1.7\n0.003,1.8\n"));
        let channel = &found.channels[0];
        assert_eq!(found.channels.len(), 1, "{head}");
        assert_eq!(channel.name, "torque", "{head}");
        assert!(channel.unit.is_some(), "{head}");
        assert_eq!(channel.axis.rate_hz, Some(1000.0), "{head}");
        assert_eq!(channel.axis.assumed, None, "{head}");
    }
}

#[test]
fn plain_tables_are_told_from_others() {
    let is = |text: &str| super::super::is_plain(text.as_bytes(), true, &Options::default());
    assert!(is("time_s,bridge_V\n0,0.5\n0.1,0.6\n0.2,0.7\n"));
    assert!(is(
        "\u{feff}Time [s];Torque [N m]\r\n0,0;1,5\r\n0,1;1,6\r\n"
    ));
    for text in [
        "time_s,bridge_V\r\r\n0,0.5\r\r\n0.1,0.6\r\r\n",
        "Time;Force [N]\n12:00:00;1\n12:00:01;2\n",
        "t1 [s],a [V],t2 [s],b [V]\n0,1,0,2\n1,2,1,3\n",
        "X,CH1,Start,Increment,\nSequence,Volt,-1,0.5,\n0,1,\n1,2,\n",
        "time_s,load_N\n0,\"1,234.5\"\n1,\"2,345.5\"\n",
    ] {
        assert!(!is(text), "{text}");
    }
}

#[test]
fn german_headings_and_decimal_comma() {
    let text = "Messung vom 3.4.2024;;\nAbtastrate: 100 Hz;;\nZeit;Drehmoment;Drehzahl\nSekunden;Nm;U/min\n\
                0,00;-1,5;60\n0,01;-1,6;60,5\n0,02;-1.234,75;61\n";
    let found = read(text);
    check(
        &found,
        &[("Drehmoment", "Nm", 3), ("Drehzahl", "U/min", 3)],
        Some(100.0),
    );
    assert_eq!(found.channels[0].samples[2], -1234.75);
    assert_eq!(found.channels[0].axis.header_rate_hz, Some(100.0));
}

#[test]
fn encodings_line_ends_and_marks() {
    let text = "Zeit [s]\tKraft [N]\n0,0\t1,5\n0,5\t1,6\n1,0\t1,7\n";
    let wide: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let big: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
    for bytes in [
        text.as_bytes().to_vec(),
        [b"\xEF\xBB\xBF", text.as_bytes()].concat(),
        [b"\xFF\xFE".to_vec(), wide.clone()].concat(),
        [b"\xFE\xFF".to_vec(), big].concat(),
        wide,
        text.replace('\n', "\r").into_bytes(),
        text.replace('\n', "\r\n").into_bytes(),
        text.replace('\n', "\r\r\n").into_bytes(),
        text.replace('\n', "\t\r\n").into_bytes(),
        format!("{text}\x1A").into_bytes(),
        text.trim_end().as_bytes().to_vec(),
    ] {
        let found = read_bytes(&bytes, &Options::default());
        check(&found, &[("Kraft", "N", 3)], Some(2.0));
        assert_eq!(found.channels[0].samples, [1.5, 1.6, 1.7]);
    }
    // Latin-1.
    let found = read_bytes(b"t [s];Dehnung [\xB5m/m]\n0;1\n1;2\n", &Options::default());
    assert_eq!(found.channels[0].unit_text.as_deref(), Some("\u{b5}m/m"));
}

#[test]
fn time_in_other_units() {
    for (heading, step, rate) in [
        ("time_ms", 0.5, 2000.0),
        ("Time (us)", 100.0, 1e4),
        ("Time [\u{b5}s]", 100.0, 1e4),
        ("t [min]", 0.5, 1.0 / 30.0),
        ("Zeit [h]", 0.001, 1.0 / 3.6),
        ("timestamp_ns", 1e6, 1000.0),
    ] {
        let rows = rows(5, ",", &[&|row| format!("{}", row * step), &wave]);
        let found = read(&format!("{heading},force_N\n{rows}"));
        check(&found, &[("force", "N", 5)], Some(rate));
    }
}

#[test]
fn clocks() {
    for (head, stamps) in [
        ("Time", ["12:34:56.750", "12:34:57.000", "12:34:57.250"]),
        ("Uhrzeit", ["23:59:59,75", "00:00:00,00", "00:00:00,25"]),
        (
            "Timestamp",
            [
                "2024-02-28T23:59:59.75Z",
                "2024-02-29T00:00:00.00Z",
                "2024-02-29T00:00:00.25Z",
            ],
        ),
        (
            "Datum/Zeit",
            [
                "31.12.2023 23:59:59,75",
                "01.01.2024 00:00:00,00",
                "01.01.2024 00:00:00,25",
            ],
        ),
        (
            "Date",
            [
                "3/26/2026 2:34:31.75 PM",
                "3/26/2026 2:34:32 PM",
                "3/26/2026 2:34:32.25 PM",
            ],
        ),
    ] {
        let rows: Vec<String> = stamps
            .iter()
            .map(|stamp| format!("{stamp};1,5\n"))
            .collect();
        let found = read(&format!("{head};Kraft [N]\n{}", rows.concat()));
        check(&found, &[("Kraft", "N", 3)], Some(4.0));
        let axis = &found.channels[0].axis;
        assert_eq!(axis.start_text.as_deref(), Some(stamps[0]));
        assert_eq!(axis.stamps_s.as_ref().unwrap().as_slice(), [0.0, 0.25, 0.5]);
    }
    let text = "Date,Time,ms,Torque [Nm]\n2024/05/02,10:00:00,250,1\n2024/05/02,10:00:00,750,2\n\
                2024/05/02,10:00:01,250,3\n2024/05/02,10:00:01,750,4\n";
    let found = read(text);
    check(&found, &[("Torque", "Nm", 4)], Some(2.0));
    assert_eq!(
        found.channels[0].axis.start_text.as_deref(),
        Some("2024/05/02 10:00:00")
    );
}

#[test]
fn rates_in_the_head() {
    for head in [
        "Sample rate: 1000 Hz",
        "# Sample Rate = 1 kHz",
        "Abtastrate;1000",
        "Sample interval,0.001 s",
        "Delta t\t1 ms",
        "Sampling Period (ms): 1",
        "dt = 0.001",
    ] {
        let found = read(&format!("{head}\nforce [N],torque [Nm]\n1,2\n3,4\n5,6\n"));
        check(
            &found,
            &[("force", "N", 3), ("torque", "Nm", 3)],
            Some(1000.0),
        );
        assert_eq!(found.channels[0].axis.header_rate_hz, Some(1000.0));
    }
    // Numbers of samples and a rate; the rate settles a unit that is not said.
    let found = read("Sample rate: 50 Hz\nSample,force [N]\n0,2\n1,4\n2,6\n");
    check(&found, &[("force", "N", 3)], Some(50.0));
    let found = read("Sample rate: 50 Hz\nTime,force [N]\n0,2\n20,4\n40,6\n");
    check(&found, &[("force", "N", 3)], Some(50.0));
    assert_eq!(found.channels[0].axis.assumed, None);
    // Stamps that contradict the head win, and the head is kept.
    let found = read("Sample rate: 50 Hz\ntime_s,force [N]\n0,2\n0.01,4\n0.02,6\n");
    assert_eq!(found.channels[0].axis.rate_hz, Some(100.0));
    assert_eq!(found.channels[0].axis.header_rate_hz, Some(50.0));
}

#[test]
fn quotes_thousands_and_ragged_ends() {
    let text = "\"Time (s)\",\"Load (N)\",\"Note\"\n\"0.0\",\"1,234.5\",\"first, with comma\"\n\
                \"0.1\",\"-2,345.5\",\"\"\n\"0.2\",\"12.5\",\n\"0.3\",\"13.5\"\n";
    let found = read(text);
    check(&found, &[("Load", "N", 4)], Some(10.0));
    assert_eq!(found.channels[0].samples, [1234.5, -2345.5, 12.5, 13.5]);
    // The last line has no end and fewer cells.
    let found = read("t [s],a [V],b [V]\n0,1,2\n1,3,4\n2,5");
    assert_eq!(found.channels[0].samples, [1.0, 3.0]);
    assert_eq!(found.lost.unwrap().code, "last-line-cut");
}

#[test]
fn holes_are_kept_with_their_lines() {
    let found = read("t [s],a [V],b [V]\n0,1,2\n1,,4\n2,error,6\n\n3,7,NaN\n4,8\n5,9\n");
    let holes = |place: usize| -> Vec<(usize, usize, HoleKind)> {
        found.channels[place]
            .holes
            .iter()
            .map(|h| (h.index, h.line, h.what))
            .collect()
    };
    assert_eq!(holes(0), [(1, 3, HoleKind::Empty), (2, 4, HoleKind::Text)]);
    assert_eq!(holes(1), [(3, 6, HoleKind::NonFinite)]);
    assert_eq!(found.channels[1].samples.len(), 4);
    assert!(found.channels[0].samples[1].is_nan());
}

#[test]
fn several_columns_of_time() {
    let found = read("t1 [s],a [V],t2 [s],b [N]\n0,1,0,5\n0.5,2,0.25,6\n1,3,0.5,7\n,,0.75,8\n");
    let told: Vec<_> = found
        .channels
        .iter()
        .map(|c| (c.name.as_str(), c.samples.len(), c.axis.rate_hz))
        .collect();
    assert_eq!(told, [("a", 3, Some(2.0)), ("b", 4, Some(4.0))]);
    // Two ways to write the same time.
    let found = read(
        "Date/Time,Elapsed [s],a [V]\n2024-01-01 10:00:00,0,1\n2024-01-01 10:00:01,0.5,2\n\
                      2024-01-01 10:00:01,1.0,3\n2024-01-01 10:00:02,1.5,4\n",
    );
    check(&found, &[("a", "V", 4)], Some(2.0));
}

#[test]
fn what_is_assumed_is_said() {
    let found = read("time,force\n0,1\n0.5,2\n1.0,3\n");
    let axis = &found.channels[0].axis;
    assert_eq!(axis.rate_hz, Some(2.0));
    assert!(
        axis.assumed.as_ref().unwrap().contains("seconds"),
        "{axis:?}"
    );
    assert_eq!(found.warnings[0].code, "time-assumed");
    assert!(found.select(&Options::default()).is_err());
    let options = Options {
        time_unit: Some("ms".to_owned()),
        ..Options::default()
    };
    let found = read_bytes(b"time,force\n0,1\n0.5,2\n1.0,3\n", &options);
    assert_eq!(found.select(&options).unwrap().rate_hz, 2000.0);
    // Epochs.
    let found = read("timestamp,force\n1700000000000,1\n1700000000010,2\n1700000000020,3\n");
    assert_eq!(found.channels[0].axis.rate_hz, Some(100.0));
    // No headings: a first column that rises steadily.
    let rows = rows(20, "\t", &[&comma(step(0.016, 4)), &comma(wave)]);
    let found = read(&rows);
    check(&found, &[("column 2", "", 20)], Some(62.5));
    assert!(found.channels[0].axis.assumed.is_some());
}

#[test]
fn without_any_rate() {
    let found = read("a [V],b [N]\n1,2\n3,4\n2,1\n");
    check(&found, &[("a", "V", 3), ("b", "N", 3)], None);
    let error = found.select(&Options {
        channel: Some("a".to_owned()),
        ..Options::default()
    });
    assert!(error.unwrap_err().to_string().contains("--rate"));
    let options = Options {
        rate_hz: Some(10.0),
        channel: Some("b".to_owned()),
        ..Options::default()
    };
    let found = read_bytes(b"a [V],b [N]\n1,2\n3,4\n2,1\n", &options);
    let chosen = found.select(&options).unwrap();
    assert_eq!(
        (chosen.rate_hz, chosen.samples),
        (10.0, &[2.0, 4.0, 1.0][..])
    );
}

#[test]
fn the_user_is_asked_and_heard() {
    assert!(failure("0,5\n0,6\n0,7\n").contains("--decimal ,"));
    assert!(failure("a;b\n1,234;2,345\n3,456;4,567\n").contains("--decimal ,"));
    let mut options = Options::default();
    options.told.decimal = Some(b',');
    let found = read_bytes(b"a;b\n1,234;2,345\n3,456;4,567\n", &options);
    assert_eq!(found.channels[0].samples, [1.234, 3.456]);
    options.told.decimal = Some(b'.');
    let found = read_bytes(b"a;b\n1,234;2,345\n3,456;4,567\n", &options);
    assert_eq!(found.channels[0].samples, [1234.0, 3456.0]);
    options = Options::default();
    options.told.delimiter = Some(Delimiter::Byte(b'|'));
    let found = read_bytes(b"t [s]|b [V]\n0|1\n1|2\n", &options);
    check(&found, &[("b", "V", 2)], Some(1.0));
    options = Options {
        time_column: Some("b".to_owned()),
        time_unit: Some("s".to_owned()),
        ..Options::default()
    };
    let found = read_bytes(b"a;b\n1;0\n3;0.5\n", &options);
    check(&found, &[("a", "", 2)], Some(2.0));
}

#[test]
fn tables_below_each_other() {
    let rows = "0,1\n0.5,2\n1,3\n";
    let found = read(&format!("time_s,force_N\n{rows}\ntime_s,force_N\n{rows}"));
    check(&found, &[("force", "N", 3), ("force", "N", 3)], Some(2.0));
    assert_eq!(found.segments.len(), 2);
}

#[test]
fn comments_among_rows_and_columns_by_spaces() {
    let found = read(
        "% Moku:Lab Oscilloscope\n% Acquisition rate: 1.25e5 Hz\n% Time (s), Channel A (V), Channel B (V)\n\
                      0.0, 1.0, 2.0\n8.0e-06, 1.1, 2.1\n# a remark\n1.6e-05, 1.2, 2.2\n",
    );
    check(
        &found,
        &[("Channel A", "V", 3), ("Channel B", "V", 3)],
        Some(1.25e5),
    );
    let found = read(
        "Time [s]   Force [N]   Torque [N m]\n 0.0   1.0   2.0\n 0.5   1.1   2.1\n 1.0   1.2   2.2\n",
    );
    check(
        &found,
        &[("Force", "N", 3), ("Torque", "N m", 3)],
        Some(2.0),
    );
}

#[test]
fn whole_seconds_tell_the_rate_without_bias() {
    let stamp = |row: f64| format!("{}", (row / 100.0).floor());
    let found = read(&format!(
        "Time [s],M [Nm]\n{}",
        rows(400, ",", &[&stamp, &wave])
    ));
    check(&found, &[("M", "Nm", 400)], Some(100.0));
}
