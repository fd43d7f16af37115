//! Variants of layouts as exports of the same makers differ.

use super::*;

/// Rows of time and waves; the steps are of so much.
fn with_time(count: usize, separator: &str, step_size: f64, waves: usize) -> String {
    let time = step(step_size, 4);
    let mut columns: Vec<&dyn Fn(f64) -> String> = vec![&time];
    columns.extend(std::iter::repeat_n(&wave as &dyn Fn(f64) -> String, waves));
    rows(count, separator, &columns)
}

/// Rows that begin with their number, from 1.
fn counted(count: usize, separator: &str) -> String {
    let number = |row: f64| format!("{}", row + 1.0);
    rows(count, separator, &[&number, &wave, &wave])
}

#[test]
fn graphtec_repeats_headings_among_the_units() {
    let head = "Vendor,GRAPHTEC Corporation\nModel,GL980\nSampling interval,100ms\n\
                AMP settings\nCH,Signal name,Amp,Input,Range,Filter,Span,,Unit\n\
                CH3,supply,M,DC,50V,Off,25,-25,V\nCH4,current,M,DC,50mV,Off,10,-10,A\nData\n\
                Number,Date,Time,us,CH3,CH4\nNO.,Date,Time,us,V,A\n";
    let rows: String = (0..5)
        .map(|row| {
            let value = 14.0 + f64::from(row) * 0.25;
            let us = row * 100_000;
            format!("{},2026/03/11,17:01:59,{us:06},+{value:.3},-0.5\n", row + 1)
        })
        .collect();
    let found = read(&format!("{head}{rows}"));
    check(&found, &[("CH3", "V", 5), ("CH4", "A", 5)], Some(10.0));
    // In another language, with columns of alarms.
    let head = "番号,日付/時間,ms,CH1,CH2,Alarm1-10,AlarmOut\n\
                NO.,Time,ms,\"mV\",\"V\",\"A1234567890\",\"AO1234\"\n";
    let rows: String = (0..5)
        .map(|row| {
            format!(
                "{},2026-09-24 09:09:5{},{},+0.5,+1.5,\"LLLLLLLLLL\",\"LLLL\"\n",
                row + 1,
                4 + row / 5,
                200 * row % 1000
            )
        })
        .collect();
    let found = read(&format!("{head}{rows}"));
    check(&found, &[("CH1", "mV", 5), ("CH2", "V", 5)], Some(5.0));
}

#[test]
fn whole_numbers_with_a_comma_at_the_end_of_each_line() {
    let head = "Memory Length,4\nTrigger Level,0.00E+00\nSource,CH1\nProbe,10X\nVertical Units,V\n\
                Horizontal Units,s\nSampling Period,1.00E-06\nFirmware,V1.13\nTime, \nMode,Fast\n\
                Waveform Data,\n";
    let found = read(&format!("{head}-23,\n-23,\n34,\n35,\n"));
    // Steps of the screen, and no scale to turn them into volts.
    check(&found, &[("CH1", "", 4)], Some(1e6));
    assert_eq!(found.channels[0].samples, [-23.0, -23.0, 34.0, 35.0]);
    assert_eq!(found.warnings[0].code, "screen-steps");
}

#[test]
fn gw_instek_in_steps_of_the_screen() {
    let head = |probe: &str, position: &str| {
        format!(
            "Memory Length,4\nSource,CH1\nProbe,{probe}\nVertical Units,V\nVertical Scale,2.00E+00\n\
             Vertical Position,{position}\nHorizontal Units,s\nSampling Period,1.00E-06\nMode,Fast\n\
             Waveform Data,\n25,\n-50,\n1,\n0,\n"
        )
    };
    let found = read(&head("1X", "0.00E+00"));
    check(&found, &[("CH1", "V", 4)], Some(1e6));
    assert_eq!(found.channels[0].samples, [2.0, -4.0, 0.08, 0.0]);
    assert_eq!(found.warnings[0].code, "screen-steps");
    for text in [head("10X", "0.00E+00"), head("1X", "1.50E+00")] {
        let found = read(&text);
        check(&found, &[("CH1", "", 4)], Some(1e6));
        assert_eq!(found.channels[0].samples[0], 25.0);
    }
    // An older one, without modes and probes.
    let older = head("1X", "0.00E+00")
        .replace("Probe,1X\n", "")
        .replace("Mode,Fast\n", "");
    let found = read(&older);
    check(&found, &[("CH1", "V", 4)], Some(1e6));
    assert_eq!(found.channels[0].samples, [2.0, -4.0, 0.08, 0.0]);
    // Two channels, their keys again above each, an empty column after each.
    let head = "Format,1.0B,Format,1.0B,\nMemory Length,4,Memory Length,4,\nSource,CH1,Source,CH2,\n\
                Vertical Units,V,Vertical Units,A,\nProbe Ratio,1.0,Probe Ratio,1.0,\n\
                Vertical Scale,5.0E+00,Vertical Scale,1.0E-01,\n\
                Vertical Position,0.0,Vertical Position,0.0,\nHorizontal Units,S,Horizontal Units,S,\n\
                Sampling Period,5.0E-05,Sampling Period,5.0E-05,\nMode,Fast,Mode,Fast,\n\
                Waveform Data,,Waveform Data,,\n";
    let found = read(&format!("{head}25,,5,\n-25,,10,\n0,,15,\n5,,-25,\n"));
    check(&found, &[("CH1", "V", 4), ("CH2", "A", 4)], Some(2e4));
    assert_eq!(found.channels[0].samples, [5.0, -5.0, 0.0, 1.0]);
    assert!((found.channels[1].samples[3] + 0.1).abs() < 1e-15);
}

#[test]
fn tektronix_beside_logic_and_with_rounded_stamps() {
    let head = "Model,MDO3014\n\nWaveform Type,ANALOG,,Waveform Type,DIGITAL,,\n\
                Horizontal Units,s,,Horizontal Units,s,,\nSample Interval,4e-09,,Sample Interval,4e-09,,\n\
                Vertical Units,V,,Vertical Units,V,V,V\n,,,,,,\n,,,,,,\nLabel,PCLK,,Label,FV,LV,D9\n\
                TIME,CH1,,TIME,D11,D10,D9\n";
    let both: String = (0..5)
        .map(|row| {
            let time = f64::from(row) * 4e-9;
            format!("{time:e},0.{row},,{time:e},0,1,0\n")
        })
        .collect();
    let found = read(&format!("{head}{both}"));
    let logic = [("FV", "V", 5), ("LV", "V", 5), ("D9", "V", 5)];
    check(
        &found,
        &[&[("PCLK", "V", 5)], logic.as_slice()].concat(),
        Some(2.5e8),
    );
    let head = "Model,DPO2002B\n\nHorizontal Units,S,,,\nSample Interval,0.5,,,\nVertical Units,V,,A,\n\
                Label,,,,\nTIME,CH1,CH1 Peak Detect,CH2,CH2 Peak Detect\n";
    let found = read(&format!("{head}{}", with_time(4, ",", 0.5, 4)));
    let peaks = [
        ("CH1", "V", 4),
        ("CH1 Peak Detect", "V", 4),
        ("CH2", "A", 4),
        ("CH2 Peak Detect", "A", 4),
    ];
    check(&found, &peaks, Some(2.0));
    // 0.32 µs, written to 0.1 µs: the head knows better.
    let head = "Model,MSO2012\nHorizontal Units,S,\nSample Interval,3.2e-07,\nVertical Units,V,\n\
                Label,,\nTIME,CH1,CH1 Peak Detect\n";
    let stamp = |row: f64| format!("{:.5e}", -1.35133e-2 + (row * 3.2).round() * 1e-7);
    let body = rows(19, ",", &[&stamp, &wave, &wave]);
    let found = read(&format!("{head}{body}"));
    assert_eq!(found.channels[0].axis.rate_hz, Some(3_125_000.0));
}

#[test]
fn cassy_with_spaces() {
    let head = "MIN=0\t-1\t-5\nMAX=10\t1\t5\nSCALE=1\t0,5\t5\nDEC=1\t3\t4\n";
    let rows = "0\t-0,131\t2,58\n0,1\t-0,162\t2,75\n0,2\t-0,176\t2,9\n";
    let names = "\"Zeit\" t / s\t\"Drehmoment\" M / Nm\t\"Spannung\" U_B1 / V";
    for mark in ["DEF= ", "DEF = "] {
        let found = read(&format!("{head}{mark}{names}\n{rows}"));
        check(
            &found,
            &[("Drehmoment M", "Nm", 3), ("Spannung U_B1", "V", 3)],
            Some(10.0),
        );
        assert!(found.dialect.contains("CASSY"), "{mark}");
    }
    let text = format!("{head}DEF={names}\n{rows}").replace('\t', " ");
    check(
        &read(&text),
        &[("Drehmoment M", "Nm", 3), ("Spannung U_B1", "V", 3)],
        Some(10.0),
    );
}

#[test]
fn cassy_with_a_cell_each_for_name_symbol_and_unit() {
    let head = "\"Zeit\";\"t\";\"s\";\"Drehmoment\";\"M\";\"Nm\"\n";
    let found = read(&format!("{head}0;-0,131\n0,1;-0,162\n0,2;-0,176\n"));
    check(&found, &[("Drehmoment M", "Nm", 3)], Some(10.0));
}

#[test]
fn owon_with_what_was_measured_above() {
    let head = "Channel :,CH1,CH2\nFrequency :,F=0.999KHz,F=?\nPK-PK :,Vp=3.2V,Vp=1.0V\n\
                Probe attenuation :,X10,X1\nTime interval :,0.01000mS,0.01000mS\n\n\
                index,CH1_Voltage(mV),CH2_Voltage(mV)\n";
    let two = [("CH1_Voltage", "mV", 6), ("CH2_Voltage", "mV", 6)];
    let found = read(&format!("{head}{}", counted(6, ",")));
    check(&found, &two, Some(1e5));
    let head = "Unit:(mV)\n\tCH1\tCH2\nFrequency:\tF=1.000KHz\tF=1.000KHz\n\
                Period:\tT=1.000mS\tT=?\nTime interval:\t0.10000uS\t0.10000uS\n";
    let named = [("CH1", "mV", 6), ("CH2", "mV", 6)];
    let found = read(&format!("{head}{}", counted(6, "\t")));
    check(&found, &named, Some(1e7));
    // The frequency of the signal is not the rate.
    let head = "Units:(mV)\n,CH1,CH2\nFrequency,1.000KHz,?\nPeriod,1.000mS,?\nVpp,3.2V,1V\n\
                Sample Period,1uS,1uS\n";
    let found = read(&format!("{head}{}", counted(6, ",")));
    check(&found, &named, Some(1e6));
}

#[test]
fn twincat_with_names_only_and_with_switches() {
    let head = "Name\tproject\nFile\tx.csv\nStarttime of export\t132959733843760000\tMonday, 2 May 2022\t15:56:24.376\n\
                Endtime of export\t132959733853760000\tMonday, 2 May 2022\t15:56:25.376\n\n";
    let found = read(&format!(
        "{head}Name\tfast\n\n{}",
        with_time(9, "\t", 0.5, 1)
    ));
    check(&found, &[("fast", "", 9)], Some(2000.0));
    let switch = |row: f64| if row > 3.0 { "True" } else { "False" }.to_owned();
    let rows = rows(9, "\t", &[&step(1.0, 0), &wave, &step(1.0, 0), &switch]);
    let names = "Name\tfast\tName\tswitch\nData-Type\tREAL64\tData-Type\tBIT\n\
                 SampleTime[ms]\t1\tSampleTime[ms]\t1\n\n";
    let found = read(&format!("{head}{names}{rows}"));
    check(&found, &[("fast", "", 9)], Some(1000.0));
}

#[test]
fn a_text_in_the_first_row_only() {
    let head = "TIME,INDEX,TRIGGER,Speed,Torque\n";
    let rows: String = (0..8)
        .map(|row| {
            let mark = if row == 0 { "*" } else { "" };
            format!(
                "2021/05/12 10:11:12.{row},{},{mark},{},1.5\n",
                row + 1,
                row * 7
            )
        })
        .collect();
    let found = read(&format!("{head}{rows}"));
    check(&found, &[("Speed", "", 8), ("Torque", "", 8)], Some(10.0));
}

#[test]
fn the_same_time_before_each_channel() {
    let time = step(1e-3, 6);
    let none = |_: f64| String::new();
    let columns: [&dyn Fn(f64) -> String; 5] = [&time, &wave, &none, &time, &wave];
    let found = read(&rows(10, ",", &columns));
    check(
        &found,
        &[("column 2", "", 10), ("column 5", "", 10)],
        Some(1000.0),
    );
}

#[test]
fn labview_blocks_whose_time_begins_anew() {
    let head = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t,\nX_Columns\tOne\n\
                ***End_of_Header***\t\n\t\nChannels\t1\t\nSamples\t2\t\nY_Unit_Label\tVolts\t\n\
                X_Dimension\tTime\t\nX0\t0,0E+0\t\nDelta_X\t1,0E-5\t\n***End_of_Header***\t\t\n\
                X_Value\tU\tComment\n";
    let text = format!("{head}{}", "0,000000\t12,8\n1,000000E-5\t-1,5\n".repeat(9));
    let found = read(&text);
    check(&found, &[("U", "Volts", 18)], Some(1e5));
}

#[test]
fn labview_over_frequency() {
    let head = |columns: &str| {
        format!(
            "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\nX_Columns\t{columns}\n\
             ***End_of_Header***\t\n\t\nChannels\t1\t\nSamples\t9\t\nY_Unit_Label\tV\t\n\
             X_Dimension\tFrequency\t\nX0\t0.0\t\nDelta_X\t2.5\t\n***End_of_Header***\t\t\n\
             X_Value\tU\tComment\n"
        )
    };
    let found = read(&format!("{}{}", head("One"), with_time(9, "\t", 2.5, 1)));
    check(&found, &[("Frequency", "", 9), ("U", "V", 9)], None);
    assert_eq!(found.channels[0].samples[2], 5.0);
    assert_eq!(found.channels[1].axis.header_rate_hz, None);
    assert_eq!(found.warnings[0].code, "no-time-axis");
    let none = |_: f64| String::new();
    let found = read(&format!("{}{}", head("No"), rows(9, "\t", &[&none, &wave])));
    check(&found, &[("U", "V", 9)], None);
}

#[test]
fn siglent_with_the_unit_of_the_picture() {
    let head = "Record Length,Analog:9\nSample Interval,CH1:0.0000020000000\nVertical Units,CH1:V,,,\n\
                Horizontal Units,us,,,\nHorizontal Scale,20000.0,,,\nModel Number,SDS1202X-E,,,\n\
                Source,CH1\nSecond,Volt\n";
    let time = |row: f64| format!(" {:.11}", row * 2e-6);
    let found = read(&format!("{head}{}", rows(9, ",", &[&time, &wave])));
    check(&found, &[("CH1", "V", 9)], Some(5e5));
}
