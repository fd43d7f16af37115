//! Layouts of exports in which something stands where another maker writes something else.

use super::*;

#[test]
fn lecroy_says_when_its_only_segment_began() {
    let head = "LECROYHDO9404,30152,Waveform\nSegments,1,SegmentSize,6\n\
                Segment,TrigTime,TimeSinceSegment1\n#1,28-Dec-2020 13:34:10,0     \nTime,Ampl\n";
    let body = rows(6, ",", &[&step(1e-3, 3), &wave]);
    let text = format!("{head}{body}");
    let with_comma = text.replace(',', ";").replace('.', ",");
    let marks = [",", ";", "\t", " "].map(|mark| text.replace(',', mark));
    for text in marks.iter().chain([&with_comma]) {
        let found = read(text);
        check(&found, &[("Ampl", "", 6)], Some(1000.0));
        let start = found.channels[0].axis.start_text.as_deref();
        assert_eq!(start, Some("28-Dec-2020 13:34:10"), "{text}");
    }
    // Two arrays over one time, under the line of the triggers.
    let head = head.replace("Time,Ampl", "Time,Ampl,Ampl");
    let found = read(&format!(
        "{head}{}",
        rows(6, ",", &[&step(1e-3, 3), &wave, &wave])
    ));
    check(&found, &[("Ampl", "", 6), ("Ampl", "", 6)], Some(1000.0));
}

#[test]
fn dates_in_english_words() {
    let head = "Name\tscope\nStarttime of export\t132959733843760000\tMonday, 2 May 2022\t15:56:24.376\n\n\
                Name\tfast\nSampleTime[ms]\t1\n\n";
    let found = read(&format!("{head}{}", rows(6, "\t", &[&step(1.0, 0), &wave])));
    let start = found.channels[0].axis.start_text.as_deref();
    assert_eq!(start, Some("Monday, 2 May 2022 15:56:24.376"));
    let ticks = |row: f64| format!("{}", 132_959_733_843_760_000_i64 + row as i64 * 10_000);
    let found = read(&format!("{head}{}", rows(6, "\t", &[&ticks, &wave])));
    check(&found, &[("fast", "", 6)], Some(1000.0));
    let start = found.channels[0].axis.start_text.as_deref();
    assert_eq!(start, Some("Monday, 2 May 2022 15:56:24.376"));
    let head = "Date:\tWednesday, May 12, 2021\nTime:\t10:11:12\nSampling rate [Hz]:\t1000\n\
                Time\tFx\ns\tN\n";
    let found = read(&format!(
        "{head}{}",
        rows(6, "\t", &[&step(1e-3, 3), &wave])
    ));
    let start = found.channels[0].axis.start_text.as_deref();
    assert_eq!(start, Some("Wednesday, May 12, 2021 10:11:12"));
}

#[test]
fn values_for_each_channel_in_one_cell() {
    let head = "Record Length,Analog:5\nSample Interval,CH1:1.0E-03 CH2:1.0E-03\n\
                Vertical Units,CH1:V CH2:A\nHorizontal Units,S\nModel Number,SDS2000\nSource,CH1,CH2\n";
    let body = rows(5, ",", &[&step(1e-3, 3), &wave, &wave]);
    let found = read(&format!("{head}Second,Volt,Ampere\n{body}"));
    check(
        &found,
        &[("CH1", "Volt", 5), ("CH2", "Ampere", 5)],
        Some(1000.0),
    );
    assert_eq!(found.channels[0].axis.assumed, None);
    let found = read(&format!("{head}{body}"));
    check(&found, &[("CH1", "V", 5), ("CH2", "A", 5)], Some(1000.0));
    // Nothing but the line above the data says the units.
    let head = "Source,CH1,CH2\nSample Interval,1e-3,1e-3\nSecond,Volt,Volt\n";
    let found = read(&format!("{head}{body}"));
    check(
        &found,
        &[("CH1", "Volt", 5), ("CH2", "Volt", 5)],
        Some(1000.0),
    );
}

#[test]
fn rows_between_units_and_data() {
    let body = rows(
        5,
        "\t",
        &[&comma(step(0.02, 2)), &comma(wave), &comma(wave)],
    );
    let units = "Zeit  1 - Standardmessrate\tKraft\tWeg\ns\tkN\tmm\n";
    for between in [
        "Double\tDouble\tDouble\n",
        "SampleRate: 50 Hz\tSampleRate: 50 Hz\tSampleRate: 50 Hz\nMX840\tMX840\tMX840\n",
        "MX840 (SN 1)\tMX840 (SN 1)\tMX840 (SN 2)\nKanal 1\tKanal 2\tKanal 3\n",
    ] {
        let found = read(&format!("{units}{between}{body}"));
        check(&found, &[("Kraft", "kN", 5), ("Weg", "mm", 5)], Some(50.0));
    }
}

#[test]
fn alarms_beside_the_channels() {
    let head = "Number,Date&Time,ms,CH1,CH2,Alarm1-10,Alarm11-20,AlarmOut\n\
                NO.,Time,ms,V,degC,A1234567890,A1234567890,A1234\n";
    let body: String = (0..6)
        .map(|row| {
            let (seconds, ms) = (12 + row / 2, row % 2 * 500);
            format!(
                "{},2021-05-12 10:11:{seconds},{ms},+0.5,+25.0,LLLL,LLHL,LL\n",
                row + 1
            )
        })
        .collect();
    let found = read(&format!("{head}{body}"));
    check(&found, &[("CH1", "V", 6), ("CH2", "degC", 6)], Some(2.0));
    // The same states without any time are a list.
    let settings = "Ch,Gain,Filter,Coupling,Mode,Range\n1,10,On,DC,Diff,5\n2,10,On,AC,Diff,5\n\
                    3,20,Off,DC,Diff,5\n";
    assert!(failure(settings).contains("settings"));
}

#[test]
fn units_of_loggers_and_of_remarks() {
    let text = "Scan,Time,101 (C),102 (VDC)\n1,4/21/2026 13:39:54:460,25.0,1.5\n\
                2,4/21/2026 13:39:54:960,25.1,1.6\n3,4/21/2026 13:39:55:460,25.2,1.7\n";
    check(
        &read(text),
        &[("101", "C", 3), ("102", "VDC", 3)],
        Some(2.0),
    );
    let text = "Time,Analog 1,Analog 2\nms,Motor speed [r/min],Torque [%]\n0.0,1.5,2.5\n0.5,1.6,2.5\n1.0,1.7,2.5\n";
    check(
        &read(text),
        &[
            ("Analog 1: Motor speed", "r/min", 3),
            ("Analog 2: Torque", "%", 3),
        ],
        Some(2000.0),
    );
}

#[test]
fn numbers_in_place_of_time() {
    let text = "MIN=1\t-1\nMAX=10\t1\nSCALE=1\t1\nDEC=0\t3\nDEF=\"Nummer\" n\t\"Spannung\" U / V\n\
                1\t0,5\n2\t0,25\n3\t0,5\n4\t0,75\n";
    check(&read(text), &[("Spannung U", "V", 4)], None);
    let text = "Store No.,Date,Time,Millisecond,U-E1\n1,2021/05/12,10:11:12,0,1.5\n\
                2,2021/05/12,10:11:12,500,1.6\n3,2021/05/12,10:11:13,0,1.7\n4,2021/05/12,10:11:13,500,1.7\n";
    check(&read(text), &[("U-E1", "", 4)], Some(2.0));
}

#[test]
fn the_time_from_row_to_row() {
    let types = "INTERVAL[us],INDEX,SHORT[DEC.0],FLOAT[1.6]\nINTERVAL,INDEX,D100,D102\n";
    let body: String = (0..6)
        .map(|row| {
            format!(
                "{},{},{},0.5\n",
                if row == 0 { 0 } else { 500 },
                row + 1,
                row * 7
            )
        })
        .collect();
    let found = read(&format!("[LOGGING],CPU_1,2,3,4\n{types}{body}"));
    check(&found, &[("D100", "", 6), ("D102", "", 6)], Some(2000.0));
    // Beside the date and time of each row it says nothing new.
    let types = "DATETIME[YYYY/MM/DD hh:mm:ss.s],INTERVAL[ns],INDEX,TRIGGER[*],SHORT[DEC.0]\n\
                 TIME,INTERVAL,INDEX,TRIGGER,Speed\n";
    let body: String = (0..6)
        .map(|row| {
            format!(
                "2021/05/12 10:11:12.{row},100000000,{},,{}\n",
                row + 1,
                row * 7
            )
        })
        .collect();
    let found = read(&format!("[LOGGING],CPU_1,2,3,4\n{types}{body}"));
    check(&found, &[("Speed", "", 6)], Some(10.0));
    // An interval that changes from row to row is a signal.
    let found = read("t [s],interval [ms]\n0,800\n1,812\n2,795\n3,803\n");
    check(&found, &[("interval", "ms", 4)], Some(1.0));
}

#[test]
fn a_row_that_numbers_the_columns() {
    let head = "\"Time\",\"Torque\",\"Speed\"\n\"s\",\"Nm\",\"rpm\"\n\"1\",\"2\",\"3\"\n\n";
    let body = rows(5, ",", &[&step(0.05, 2), &wave, &wave]);
    let found = read(&format!("{head}{body}"));
    check(
        &found,
        &[("Torque", "Nm", 5), ("Speed", "rpm", 5)],
        Some(20.0),
    );
    let quoted = body
        .lines()
        .map(|line| format!("\"{}\"\n", line.replace(',', "\",\"")));
    let found = read(&format!("{head}{}", quoted.collect::<String>()));
    check(
        &found,
        &[("Torque", "Nm", 5), ("Speed", "rpm", 5)],
        Some(20.0),
    );
    // The same as a row of data.
    let found = read("n,a,b\n1,2,3\n2,5,6\n3,8,4\n");
    check(&found, &[("a", "", 3), ("b", "", 3)], None);
}

#[test]
fn lists_after_the_end_of_the_data() {
    let head = "Name\tscope\nStartRecord\t128783093223690000\tDonnerstag, 5. Februar 2009\t13:08:42\n\n\
                Name\tfast\tName\tslow\nPort\t801\tPort\t801\nSampleTime[ms]\t1\tSampleTime[ms]\t2\n";
    let body = "0\t1,5\t0\t5\n1\t1,6\t2\t6\n2\t1,7\n3\t1,8\nEOF\n";
    let events = "\nTriggerevents\nName\tTime\nTG1\t132959733843760000\n1\t2\t3\t4\n5\t6\t7\t8\n";
    let found = read(&format!("{head}{body}{events}"));
    let told: Vec<_> = found
        .channels
        .iter()
        .map(|c| (c.name.as_str(), c.samples.len(), c.axis.rate_hz))
        .collect();
    assert_eq!(told, [("fast", 4, Some(1000.0)), ("slow", 2, Some(500.0))]);
    assert!(found.dialect.contains("TwinCAT"), "{}", found.dialect);
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
}

#[test]
fn labview_without_the_header_of_the_file() {
    let text = "Channels\t3\t\t\t\nSamples\t3\t3\t3\t\nDate\t2024/05/02\t2024/05/02\t2024/05/02\t\n\
                Time\t10:00:00.5\t10:00:00.5\t10:00:00.5\t\nY_Unit_Label\tVolts\t\tN\t\n\
                X_Dimension\tTime\tTime\tTime\t\nX0\t0.0\t0.0\t0.0\t\nDelta_X\t0.001\t0.001\t0.001\t\n\
                ***End_of_Header***\t\t\t\t\nX_Value\tA\tB\tC\tComment\n0.0\t1\t2\t3\n0.001\t2\t3\t4\n0.002\t3\t4\t5\n";
    let found = read(text);
    // A channel without a unit does not shift those of the others.
    check(
        &found,
        &[("A", "Volts", 3), ("B", "", 3), ("C", "N", 3)],
        Some(1000.0),
    );
    assert!(found.dialect.contains("LVM"), "{}", found.dialect);
}

#[test]
fn loggers_beyond_their_range() {
    let head = "\"Model\",\"GL980\"\n\"Trigger Time\",\"'2026/06/01 17:01:39\"\n\n\"Data\"\n\
                \"NO.\",\"Time\",\"us\",\"CH1\",\"CH2\",\"CH3\",\"Logic1-4\",\"Alarm1-10\",\"AlarmOut\"\n\
                \"\",\"\",\"\",\"V\",\"V\",\"degC\",\"\",\"\",\"\"\n";
    let body: String = (0..6)
        .map(|row| {
            let beyond = if row == 3 { "+++++++" } else { "+0.512" };
            format!(
                "{},2026/06/01 17:01:39,{},+1.234,{beyond},BURNOUT,LLLL,LLLLLLLLLL,LLLL\n",
                row + 1,
                row * 100_000
            )
        })
        .collect();
    let found = read(&format!("{head}{body}"));
    let three = [("CH1", "V", 6), ("CH2", "V", 6), ("CH3", "degC", 6)];
    check(&found, &three, Some(10.0));
    assert_eq!(found.channels[1].holes.len(), 1);
    assert_eq!(found.channels[2].holes.len(), 6);
    let start = found.channels[0].axis.start_text.as_deref();
    assert_eq!(start, Some("2026/06/01 17:01:39"));
}

#[test]
fn dates_of_spreadsheets_and_in_french() {
    let body: String = (0..8)
        .map(|row| {
            format!(
                "{};2{row},5\n",
                format!("{:.12}", 46_296.375 + f64::from(row) * 10.0 / 86_400.0).replace('.', ",")
            )
        })
        .collect();
    let found = read(&format!("Date/Time;T enceinte\n;°C\n{body}"));
    check(&found, &[("T enceinte", "°C", 8)], Some(0.1));
    let text = "Heure;T;H\n;°C;%\n10:00:00;20,5;40\n10:00:10;20,6;41\n10:00:20;20,7;42\n";
    check(&read(text), &[("T", "°C", 3), ("H", "%", 3)], Some(0.1));
    let text = "Instrument,nanodac\n\nDate/Time,Four Z1,Messages\n,degC,\n01/10/2026 09:00:00,25.1,\n\
                01/10/2026 09:00:01,25.2,Alarm 1 on\n01/10/2026 09:00:02,25.3,\n";
    check(&read(text), &[("Four Z1", "degC", 3)], Some(1.0));
}

#[test]
fn channels_that_have_numbers_for_names() {
    let body = rows(5, ",", &[&step(1e-3, 3), &wave, &wave]);
    let found = read(&format!("Time (s),1 (V),2 (A)\n{body}"));
    check(&found, &[("1", "V", 5), ("2", "A", 5)], Some(1000.0));
    let head = "\"Model\",\"GX20\"\n\"Scan interval\",\"500ms\"\n\"Ch\",\"0001\",\"0002\"\n\
                \"Tag\",\"Torque\",\"Temp\"\n\"Unit\",\"Nm\",\"C\"\n";
    let body: String = (0..6)
        .map(|row| {
            format!(
                "2021/05/12 10:11:1{}.{},1.5,20.{row}\n",
                row / 2,
                row % 2 * 5
            )
        })
        .collect();
    let found = read(&format!("{head}{body}"));
    check(&found, &[("Torque", "Nm", 6), ("Temp", "C", 6)], Some(2.0));
}

#[test]
fn acqknowledge_with_the_number_of_samples_below_the_headings() {
    let head = "run.acq\n0.5 msec/sample\n2 channels\nTorque\nN-m\nSpeed\nrpm\n";
    let two = rows(40, "\t", &[&wave, &wave]);
    let found = read(&format!("{head}CH1\tCH2\t\n40\t40\t\n{two}"));
    check(&found, &[("CH1", "", 40), ("CH2", "", 40)], Some(2000.0));
    assert_eq!(found.channels[0].samples[0], -0.5);
    assert_eq!(found.warnings[0].code, "lines-skipped");
    assert!(
        found.warnings[0]
            .message
            .starts_with("line 9 says how many rows follow, 40")
    );
    let minutes = step(0.5 / 6e4, 10);
    let three = rows(40, "\t", &[&minutes, &wave, &wave]);
    let found = read(&format!("{head}min\tCH1\tCH2\t\n\t40\t40\t\n{three}"));
    assert_eq!(found.channels.len(), 2);
    let axis = &found.channels[0].axis;
    assert_eq!((axis.rate_hz, axis.start_s), (Some(2000.0), Some(0.0)));
    // Another number is a sample.
    let found = read(&format!("CH1\tCH2\n41\t41\n{two}"));
    check(&found, &[("CH1", "", 41), ("CH2", "", 41)], None);
}
