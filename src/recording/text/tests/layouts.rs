//! Layouts of headers that several makers share.

use super::*;

#[test]
fn a_channel_slower_than_its_table() {
    let text: String = (0..40)
        .map(|row| {
            let slow = if row % 4 == 0 {
                wave(f64::from(row))
            } else {
                String::new()
            };
            format!(
                "{:.3},{},{slow}\n",
                f64::from(row) * 0.001,
                wave(f64::from(row))
            )
        })
        .collect();
    let found = read(&format!("time_s,fast_V,slow_N\n{text}"));
    let said: Vec<(&str, usize, Option<f64>)> = found
        .channels
        .iter()
        .map(|c| (c.name.as_str(), c.samples.len(), c.axis.rate_hz))
        .collect();
    assert_eq!(
        said,
        [("fast", 40, Some(1000.0)), ("slow", 10, Some(250.0))]
    );
}

#[test]
fn blocks_of_a_labview_file_with_slower_channels() {
    let head = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\nX_Columns\tOne\n\
                ***End_of_Header***\t\n\t\nChannels\t2\t\t\nSamples\t4\t1\t\nY_Unit_Label\tV\tN\t\n\
                X_Dimension\tTime\tTime\t\nX0\t0.0\t0.0\t\nDelta_X\t0.5\t1.0\t\n\
                ***End_of_Header***\t\t\t\nX_Value\tfast\tslow\tComment\n";
    let rows: String = (0..16)
        .map(|row| {
            let slow = if row % 4 == 0 { "6.25\tsaid" } else { "\t" };
            format!(
                "{:.1}\t{}\t{slow}\n",
                f64::from(row) * 0.5,
                wave(f64::from(row))
            )
        })
        .collect();
    let found = read(&format!("{head}{rows}"));
    assert_eq!(found.channels[0].samples.len(), 16);
    assert_eq!(found.channels[1].samples, [6.25; 4]);
    assert_eq!(found.channels[1].axis.rate_hz, Some(0.5));
}

#[test]
fn names_symbols_and_units_in_rows_of_their_own() {
    let text = "Vernier Format 2\nrun.cmbl 1/5/2010 10:11:12 .\nRun 1\nTime\tForce\nt\tF\ns\tN\n\n\
                0.00\t1.5\n0.02\t1.6\n0.04\t1.7\n";
    check(&read(text), &[("Force", "N", 3)], Some(50.0));
    let text = "Zeit\tKraft\ns\tkN\nSampleRate: 50 Hz\tSampleRate: 50 Hz\n0,00\t1,5\n0,02\t1,6\n0,04\t1,7\n";
    check(&read(text), &[("Kraft", "kN", 3)], Some(50.0));
    // The bracket is part of a name where the unit stands below.
    let text = "Time,average( A )\n(s),(mV)\n0.0,1.5\n0.5,1.6\n1.0,1.7\n";
    check(&read(text), &[("average( A )", "mV", 3)], Some(2.0));
}

#[test]
fn labels_beside_the_names() {
    let head = "Memory Length,3\nSource,CH1\nVertical Units,V\nLabel,\nSampling Period,5.0e-07\n\
                Waveform Data,\n";
    let found = read(&format!("{head}0.5,\n0.6,\n0.7,\n"));
    check(&found, &[("CH1", "V", 3)], Some(2e6));
    let head = "Record Length,Analog:3\nSample Interval,Analog:1.00E-07\nVertical Units,CH1:V,CH2:A\n\
                Horizontal Units,s\nSource,CH1,CH2\nSecond,Volt,Ampere\n";
    let found = read(&format!("{head}0.0,0.5,1\n1e-7,0.6,1\n2e-7,0.7,2\n"));
    check(&found, &[("CH1", "V", 3), ("CH2", "A", 3)], Some(1e7));
    let head =
        "\"Signal\";\"speed\";\"torque\"\n\"Einheit\";\"1/min\";\"Nm\"\n\"Zeit [ms]\";\"\";\"\"\n";
    let found = read(&format!(
        "{head}0,0;100,5;1,5\n0,5;100,6;1,6\n1,0;100,7;1,5\n"
    ));
    check(
        &found,
        &[("speed", "1/min", 3), ("torque", "Nm", 3)],
        Some(2000.0),
    );
}

#[test]
fn columns_that_count() {
    let rows = rows(12, ",", &[&|i| format!("{i}"), &step(0.001, 4), &wave]);
    check(
        &read(&format!(",time (s),torque\n{rows}")),
        &[("torque", "", 12)],
        Some(1000.0),
    );
    // No headings, but the head gives the rate that the second column has.
    let found = read(&format!("X-axis delta: 0.001\nY-axis unit: V\n\n{rows}"));
    check(&found, &[("column 3", "V", 12)], Some(1000.0));
    assert!(found.channels[0].axis.assumed.is_none());
}

#[test]
fn a_key_with_spaces_around_its_colon_heads_no_column() {
    let head = "Channel : CH1 \nFrequency :  F=1.000kHz \nTime interval :  1.00000uS \n\n index  CH1_Voltage(mV)\n";
    let found = read(&format!("{head}0  0.5\n1  0.6\n2  0.7\n3  0.5\n"));
    check(&found, &[("CH1_Voltage", "mV", 4)], Some(1e6));
}

#[test]
fn exponents_of_fortran() {
    let text = "time_s torque_Nm\n0.0D+00 1.5D+00\n5.0D-01 1.6D+00\n1.0D+00 1.7D+00\n";
    check(&read(text), &[("torque", "N m", 3)], Some(2.0));
}

#[test]
fn a_list_of_results_is_no_recording() {
    let said = failure(
        "Channel,Mean,Std,Min,Max\nTorque,1.2,0.1,0.9,1.5\nSpeed,9,1,8,10\nTemp,20,0.1,19,21\n",
    );
    assert!(said.contains("list of results"), "{said}");
}

#[test]
fn headings_that_begin_with_time_are_better_than_labels() {
    let head = "Source,Scope 9314\nSample Interval,1e-8,s\nVertical Unit,V\nTime (s),Ampl (V)\n";
    let found = read(&format!("{head}0e-8,0.5\n1e-8,0.6\n2e-8,0.7\n"));
    check(&found, &[("Ampl", "V", 3)], Some(1e8));
    let head = "NR_PT,3\nXUNIT,\"s\"\nXINCR,4.0e-9\nYUNIT,\"V\"\n\n";
    let rows = rows(8, ",", &[&|i| format!("{:e}", i * 4e-9), &wave]);
    let found = read(&format!("{head}{rows}"));
    check(&found, &[("column 2", "V", 8)], Some(2.5e8));
}

#[test]
fn units_with_gaps_and_lists_of_channels() {
    let found = read("time,torque,state,count\ns,Nm,,\n0.0,1.5,1,5\n0.1,1.6,1,6\n0.2,1.7,0,9\n");
    check(
        &found,
        &[("torque", "Nm", 3), ("state", "", 3), ("count", "", 3)],
        Some(10.0),
    );
    let head = "Channel\tDatatype\tUnit\tLength\tIncrement\nForce\tDT_DOUBLE\tN\t3\t0.001\n\
                Accel\tDT_DOUBLE\tg\t3\t0.001\n\nForce\tAccel\n";
    let found = read(&format!("{head}1.5\t2.5\n1.6\t2.6\n1.7\t2.7\n"));
    check(
        &found,
        &[("Force", "N", 3), ("Accel", "g", 3)],
        Some(1000.0),
    );
}

#[test]
fn stamps_in_whole_milliseconds() {
    let stamp = |row: f64| format!("{}", (row * 3.3).round());
    let found = read(&format!("t_ms,u_V\n{}", rows(400, ",", &[&stamp, &wave])));
    let rate_hz = found.channels[0].axis.rate_hz.unwrap();
    assert!((rate_hz * 3.3e-3 - 1.0).abs() < 1e-4, "{rate_hz}");
}

#[test]
fn headings_whose_first_word_can_be_a_key() {
    let level = |row: f64| format!("{:.3}", 50.0 + (row * 2.3).sin());
    let body = rows(9, ",", &[&level, &wave]);
    for (heading, first, second) in [
        (
            "Frequency (Hz),Torque (Nm)",
            ("Frequency", "Hz", 9),
            ("Torque", "Nm", 9),
        ),
        ("Start,Stop", ("Start", "", 9), ("Stop", "", 9)),
        ("Delta,Torque", ("Delta", "", 9), ("Torque", "", 9)),
        (
            "Rate (Nm/s),Torque (Nm)",
            ("Rate", "Nm/s", 9),
            ("Torque", "Nm", 9),
        ),
    ] {
        check(&read(&format!("{heading}\n{body}")), &[first, second], None);
    }
    // These are keys.
    for key in ["Sample rate,50 Hz", "Sample rate (Hz),50"] {
        let found = read(&format!("{key}\n{body}"));
        check(
            &found,
            &[("column 1", "", 9), ("column 2", "", 9)],
            Some(50.0),
        );
    }
}

/// Name, unit, number of samples, rate and segment of a channel.
type Told<'a> = (&'a str, &'a str, usize, Option<f64>, Option<usize>);

fn told(found: &Recording) -> Vec<Told<'_>> {
    let all = found.channels.iter();
    all.map(|c| {
        let unit = c.unit_text.as_deref().unwrap_or("");
        (
            c.name.as_str(),
            unit,
            c.samples.len(),
            c.axis.rate_hz,
            c.segment,
        )
    })
    .collect()
}

#[test]
fn time_that_begins_anew_after_a_comment_or_an_empty_line() {
    let run = |count| rows(count, " ", &[&step(0.5, 1), &wave]);
    let head = "# time[s] torque[Nm]\n";
    for between in ["\n\n", "\n# run 2\n"] {
        let found = read(&format!(
            "{head}{}{between}{}{between}{}",
            run(40),
            run(30),
            run(20)
        ));
        let wanted = [
            ("torque", "Nm", 40, Some(2.0), Some(0)),
            ("torque", "Nm", 30, Some(2.0), Some(1)),
            ("torque", "Nm", 20, Some(2.0), Some(2)),
        ];
        assert_eq!(told(&found), wanted);
        assert_eq!(found.channels[2].axis.start_s, Some(0.0));
        assert_eq!(found.segments.len(), 3);
    }
    // A remark among the rows ends nothing.
    let more = rows(
        30,
        " ",
        &[&|row| format!("{:.1}", (row + 40.0) * 0.5), &wave],
    );
    let found = read(&format!("{head}{}# gear 2\n{more}", run(40)));
    assert_eq!(told(&found), [("torque", "Nm", 70, Some(2.0), None)]);
}

#[test]
fn blocks_of_one_channel_each_below_each_other() {
    let block = |name: &str, unit: &str, hz: usize, count: usize| {
        let samples = rows(count, "", &[&wave]);
        format!("Channel: {name}\nUnit: {unit}\nSample rate: {hz} Hz\nSamples: {count}\n{samples}")
    };
    let first = block("Torque", "Nm", 1000, 30);
    let found = read(&format!(
        "Recorder X\n{first}{}",
        block("Speed", "rpm", 100, 10)
    ));
    let wanted = [
        ("Torque", "Nm", 30, Some(1000.0), Some(0)),
        ("Speed", "rpm", 10, Some(100.0), Some(1)),
    ];
    assert_eq!(told(&found), wanted);
    let message = failure(&format!("{first}Channel: Speed\nUnit: rpm\n"));
    assert!(
        message.starts_with("line 35: a block of its own begins here"),
        "{message}"
    );
}

#[test]
fn values_in_the_line_below_their_keys() {
    let head = "*STARTTIME\n2009-07-23 12:51:42\n*RATE\n500 Hz\n*DATA\nTorque;Speed\n";
    let found = read(&format!("{head}{}", rows(9, ";", &[&wave, &wave])));
    check(&found, &[("Torque", "", 9), ("Speed", "", 9)], Some(500.0));
    let start = found.channels[0].axis.start_text.as_deref();
    assert_eq!(start, Some("2009-07-23 12:51:42"));
}
