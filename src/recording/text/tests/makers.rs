use super::*;

#[test]
fn lvm_of_two_segments_with_comments() {
    let segment = |start: &str, comment: &str| {
        format!(
            "Channels\t2\t\t\t\nSamples\t3\t3\t\t\nDate\t2024/05/02\t2024/05/02\t\t\n\
             Time\t10:00:0{start}.5\t10:00:0{start}.5\t\t\nY_Unit_Label\tVolts\tN\t\t\n\
             X_Dimension\tTime\tTime\t\t\nX0\t{start}.0\t{start}.0\t\t\nDelta_X\t0.001\t0.001\t\t\n\
             ***End_of_Header***\t\t\t\t\nX_Value\tBridge\tForce\tComment\n\
             \t0.5\t1.5\t{comment}\n\t0.25\t\t\n\t0.125\t2.5\n\n"
        )
    };
    let text = format!(
        "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\n\
         Decimal_Separator\t.\nMulti_Headings\tYes\nX_Columns\tNo\nTime_Pref\tRelative\n\
         Date\t2024/05/02\nTime\t10:00:00\n***End_of_Header***\t\n\t\n{}{}",
        segment("0", "begin"),
        segment("5", "")
    );
    let found = read(&text);
    check(
        &found,
        &[
            ("Bridge", "Volts", 3),
            ("Force", "N", 3),
            ("Bridge", "Volts", 3),
            ("Force", "N", 3),
        ],
        Some(1000.0),
    );
    assert_eq!(found.segments.len(), 2);
    assert_eq!(found.channels[2].axis.start_s, Some(5.0));
    assert_eq!(found.channels[2].segment, Some(1));
    assert_eq!(found.channels[1].holes.len(), 1);
    assert_eq!(found.channels[1].holes[0].line, 24);
    assert!(found.dialect.contains("LabVIEW LVM") && found.dialect.contains("2 segments"));
    assert_eq!(found.lost, None);
}

#[test]
fn lvm_with_a_column_of_times_for_each_channel() {
    let text = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t,\nX_Columns\tMulti\n\
                ***End_of_Header***\t\n\t\nChannels\t2\t\t\t\nSamples\t4\t\t2\t\nY_Unit_Label\tV\t\tN\t\n\
                X_Dimension\tTime\t\tTime\t\nX0\t0,0\t\t0,0\t\nDelta_X\t0,5\t\t1,0\t\n\
                ***End_of_Header***\t\t\t\t\nX_Value\tA\tX_Value\tB\tComment\n\
                0,0\t1,5\t0,0\t10\n0,5\t1,6\t1,0\t11\n1,0\t1,7\n1,5\t1,8\n";
    let found = read(text);
    assert_eq!(found.channels.len(), 2);
    let told = |place: usize| {
        let channel = &found.channels[place];
        (
            channel.name.as_str(),
            channel.samples.len(),
            channel.axis.rate_hz,
        )
    };
    assert_eq!(told(0), ("A", 4, Some(2.0)));
    assert_eq!(told(1), ("B", 2, Some(1.0)));
    assert_eq!(
        found.channels[1].axis.stamps_s.as_ref().unwrap().as_slice(),
        [0.0, 1.0]
    );
}

#[test]
fn lvm_that_ends_early() {
    let text = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\nX_Columns\tNo\n\
                ***End_of_Header***\t\n\t\nChannels\t1\t\nSamples\t100\t\nY_Unit_Label\tV\t\n\
                X_Dimension\tTime\t\nX0\t0.0\t\nDelta_X\t0.01\t\n***End_of_Header***\t\t\n\
                X_Value\tA\tComment\n\t1.0\n\t2.0\n\t3.0\n";
    let found = read(text);
    check(&found, &[("A", "V", 3)], Some(100.0));
    assert_eq!(found.lost.unwrap().code, "samples-missing");
}

#[test]
fn lecroy_segments() {
    let rows = rows(
        6,
        ",",
        &[&|row| format!("{:e}", -2e-6 + (row % 3.0) * 1e-6), &wave],
    );
    let text = format!(
        "LECROYHDO6104,1234,Waveform\r\nSegments,2,SegmentSize,3\r\nSegment,TrigTime,TimeSinceSegment1\r\n\
         #1,26-Mar-2026 14:34:31,0                 \r\n#2,26-Mar-2026 14:34:31,0.001\r\nTime,Ampl\r\n{rows}"
    );
    let found = read(&text);
    check(&found, &[("Ampl", "", 3), ("Ampl", "", 3)], Some(1e6));
    assert_eq!(found.segments[1].start_s, Some(0.001));
    let cut = read(&text[..text.len() - 30]);
    assert!(cut.lost.is_some());
}

#[test]
fn tektronix_keys_beside_the_samples() {
    let text = "Record Length,6.000000e+00,,-0.00050,0.02,\nSample Interval,1.000000e-04,,-0.00040,0.04,\n\
                Trigger Point,5.0e+00,,-0.00030,0.06,\nSource,CH1,,-0.00020,0.08,\n\
                Vertical Units,V,,-0.00010,0.1,\nHorizontal Units,s,,0.00000,0.12,\n";
    let found = read(text);
    check(&found, &[("CH1", "V", 6)], Some(1e4));
    let axis = &found.channels[0].axis;
    assert_eq!(
        (axis.start_s, axis.header_rate_hz),
        (Some(-0.0005), Some(1e4))
    );
    let text = "\"Record Length\",3,\"Points\",-1.0e-9,0.5\n\"Sample Interval\",1e-9,s,0.0,0.25\n\
                \"Trigger Point\",1,\"Samples\",1.0e-9,0.125\n";
    check(&read(text), &[("voltage", "", 3)], Some(1e9));
}

#[test]
fn tektronix_with_a_head() {
    let rows = rows(
        5,
        ",",
        &[&|row| format!("{:e}", -1e-4 + row * 4e-8), &wave, &wave],
    );
    let text = format!(
        "Model,MSO4034\nFirmware Version,2.48\n\nPoint Format,Y,\nHorizontal Units,S,\nHorizontal Scale,4e-05,\n\
         ,\nSample Interval,4e-08,\nFilter Frequency,1.5e+08\nRecord Length,5\nGating,0.0% to 100.0%\n\
         Probe Attenuation,10,1\nVertical Units,V,A\nVertical Offset,0,0\nVertical Scale,1,0.5\n,\n,\n\
         Label,,\nTIME,CH1,CH2\n{rows}"
    );
    let found = read(&text);
    check(&found, &[("CH1", "V", 5), ("CH2", "A", 5)], Some(2.5e7));
    assert!(found.dialect.contains("Tektronix"), "{}", found.dialect);
}

#[test]
fn rigol_start_and_increment() {
    let text = "X,CH1,CH2,Start,Increment,\r\nSequence,Volt,Volt,-3.500000e-03,5.000000e-06,\r\n\
                0,2.4e-02,8e-03,\r\n1,8e-03,-1.6e-02,\r\n2,2.4e-02,8e-03,\r\n";
    let found = read(text);
    check(&found, &[("CH1", "Volt", 3), ("CH2", "Volt", 3)], Some(2e5));
    assert_eq!(found.channels[0].axis.start_s, Some(-0.0035));
    // Bare values and the rest in the first line.
    let text =
        "CH1V,CH2V,t0 =-5.000000e-05, tInc = 1.000000e-09,\n1.2,0.5,,\n1.3,0.5,,\n1.4,0.6,,\n";
    let found = read(text);
    check(&found, &[("CH1", "V", 3), ("CH2", "V", 3)], Some(1e9));
    assert_eq!(found.channels[0].axis.start_s, Some(-5e-5));
    let text = "Time(s),CH1V,t0 =-5.000000e-05, tInc = 1.000000e-06,\n\
                -5.000000e-05,1.2,,\n-4.900000e-05,1.3,,\n-4.800000e-05,1.4,,\n";
    check(&read(text), &[("CH1", "V", 3)], Some(1e6));
}

#[test]
fn keysight_and_agilent() {
    let rows = rows(
        4,
        ",",
        &[&|row| format!("{:.4E}", -1e-3 + row * 1e-5), &wave, &wave],
    );
    let found = read(&format!("x-axis,1,2\nsecond,Volt,Volt\n{rows}"));
    check(&found, &[("1", "Volt", 4), ("2", "Volt", 4)], Some(1e5));
    let text = "Type:,raw\nPoints:,3\nCount:,1\nXInc:,5.0E-11\nXOrg:,-2.5e-06\nXRef:,0\nXUnits:,second\n\
                YUnits:,Volt\nData:\n0.5\n0.25\n0.75\n";
    let found = read(text);
    assert_eq!(found.channels.len(), 1);
    assert_eq!(found.channels[0].axis.rate_hz, Some(2e10));
    assert_eq!(found.channels[0].axis.start_s, Some(-2.5e-6));
    assert_eq!(found.channels[0].unit_text.as_deref(), Some("Volt"));
}

#[test]
fn rohde_und_schwarz() {
    let rows = rows(
        4,
        ",",
        &[&|row| format!("{:E}", -1.2e-5 + row * 2e-8), &wave, &wave],
    );
    let found = read(&format!("in s,C1 in V,C2 in A\n{rows}"));
    check(&found, &[("C1", "V", 4), ("C2", "A", 4)], Some(5e7));
    let text = "XStart:-5E-05:\nXStop:5E-05:\nResolution:1E-06:\nRecordLength:5:\n0.5\n0.25\n0.5\n0.75\n0.5\n";
    let found = read(text);
    assert_eq!(found.channels[0].samples.len(), 5);
    assert_eq!(found.channels[0].axis.rate_hz, Some(1e6));
    assert_eq!(found.channels[0].axis.start_s, Some(-5e-5));
}

#[test]
fn siglent_and_gw_instek() {
    let rows = rows(
        4,
        ",",
        &[&|row| format!("{:.10}", -7e-4 + row * 2e-8), &wave],
    );
    let text = format!(
        "Record Length,Analog:4\nSample Interval,0.0000000200\nVertical Units,V\nVertical Scale,CH1:1.00\n\
         Vertical Offset,0.0\nHorizontal Units,s\nHorizontal Scale,0.0001\nModel Number,SDS1104X-E\n\
         Serial Number,SDS1\nSoftware Version,1.1\nSource,CH1\nSecond,Volt\n{rows}"
    );
    let found = read(&text);
    assert_eq!(found.channels.len(), 1);
    assert_eq!(found.channels[0].unit_text.as_deref(), Some("V"));
    assert!((found.channels[0].axis.rate_hz.unwrap() / 5e7 - 1.0).abs() < 1e-9);
    let text = "Format,1.0B,\nMemory Length,4,\nIntpDistance,0,\nTrigger Address,2,\nSource,CH1,\n\
                Vertical Units,V,\nHorizontal Units,S,\nHorizontal Mode,Main,\nSampling Period,4e-09,\n\
                Time,10-May-19 10:54:07,\nMode,Fast,\nWaveform Data,\n0.5,\n0.25,\n-0.5,\n0.75,\n";
    check(&read(text), &[("CH1", "V", 4)], Some(2.5e8));
}

#[test]
fn yokogawa() {
    let text = "\"Model\",\"DL850\"\n\"BlockNumber\",1\n\"TraceName\",\"CH1\",\"Torque\"\n\"BlockSize\",4,4\n\
                \"VUnit\",\"V\",\"N m\"\n\"SampleRate\",1.000000E+05,1.000000E+05\n\
                \"HResolution\",1.000000E-05,1.000000E-05\n\"HOffset\",-5.0E-02,-5.0E-02\n\"HUnit\",\"s\",\"s\"\n\
                \"Date\",\"2012/05/10\",\"2012/05/10\"\n\"Time\",\"10:00:00.00\",\"10:00:00.00\"\n\n\
                ,1.5E-02,2.5E+01\n,1.6E-02,2.6E+01\n,1.7E-02,2.7E+01\n,1.8E-02,2.8E+01\n";
    let found = read(text);
    check(&found, &[("CH1", "V", 4), ("Torque", "N m", 4)], Some(1e5));
    assert_eq!(found.channels[0].axis.start_s, Some(-0.05));
    assert_eq!(
        found.channels[0].axis.start_text.as_deref(),
        Some("2012/05/10 10:00:00.00")
    );
}

#[test]
fn picoscope() {
    let rows = rows(
        4,
        "\t",
        &[&|row| format!("{:.8}", -52.5 + row * 0.5), &wave, &|row| {
            if row == 2.0 {
                "\u{221e}".to_owned()
            } else {
                wave(row)
            }
        }],
    );
    let found = read(&format!(
        "Time\tChannel A\tChannel B\n(ms)\t(V)\t(mV)\n\n{rows}"
    ));
    check(
        &found,
        &[("Channel A", "V", 4), ("Channel B", "mV", 4)],
        Some(2000.0),
    );
    assert_eq!(found.channels[1].holes.len(), 1);
    assert!((found.channels[0].axis.start_s.unwrap() + 0.0525).abs() < 1e-12);
}

#[test]
fn cassy() {
    let text = "\u{feff}MIN=0\t-1\t-5\r\r\nMAX=10\t1\t5\r\r\nSCALE=1\t0,5\t5\r\r\nDEC=1\t3\t4\r\r\n\
                DEF=\"Zeit\" t / s\t\"Drehmoment\" M / Nm\t\"Spannung\" U_B1 / V\r\r\n\
                0\t-0,131\t2,58\r\r\n0,1\t-0,162\t2,75\r\r\n0,2\t-0,176\t2,9\r\r\n";
    let found = read(text);
    check(
        &found,
        &[("Drehmoment M", "Nm", 3), ("Spannung U_B1", "V", 3)],
        Some(10.0),
    );
    assert!(found.dialect.contains("CASSY") && found.dialect.contains("CR CR LF"));
}

#[test]
fn ni_elvis_signal_express_and_diadem() {
    let text = "\u{feff}Timestamp,2020-03-16 17:04:51,Timestamp,2020-03-16 17:04:51\r\nInterval,0.0005,Interval,0.001\r\n\
                Channel name,\"Force\",Channel name,\"Input 1\"\r\nUnit,\"N\",Unit,\"V\"\r\n\
                0,-0.12,0,-3.2\r\n0.0005,-0.13,0.001,-3.3\r\n0.001,-0.14,,\r\n0.0015,-0.15,,\r\n";
    let found = read(text);
    let told: Vec<_> = found
        .channels
        .iter()
        .map(|c| (c.name.as_str(), c.samples.len(), c.axis.rate_hz))
        .collect();
    assert_eq!(
        told,
        [("Force", 4, Some(2000.0)), ("Input 1", 2, Some(1000.0))]
    );
    let text = "channel names:\nVoltage - Dev1_ai0\tVoltage - Dev1_ai1\nstart times:\n\
                07/05/2013 11:03:39.123\t07/05/2013 11:03:39.123\ndt:\n0.001000\t0.001000\ndata:\n\
                0.12\t0.5\n0.13\t0.6\n0.14\t0.7\n";
    check(
        &read(text),
        &[("Voltage - Dev1_ai0", "", 3), ("Voltage - Dev1_ai1", "", 3)],
        Some(1000.0),
    );
    let text = "waveform\t[0]\t[1]\nt0\t10/10/2003 10:33:09.000000 AM\t10/10/2003 10:33:09.000000 AM\n\
                delta t\t0.001000\t0.001000\n\ntime[0]\tY[0]\tY[1]\n\
                10/10/2003 10:33:09.000000 AM\t1.5\t2.5\n10/10/2003 10:33:09.001000 AM\t1.6\t2.6\n\
                10/10/2003 10:33:09.002000 AM\t1.7\t2.7\n";
    let found = read(text);
    assert_eq!(found.channels.len(), 2);
    assert_eq!(found.channels[0].axis.rate_hz, Some(1000.0));
}

#[test]
fn twincat_groups() {
    let text = "Name\tscope\nFile\tx.csv\nStarttime of export\t132959733843760000\tMontag, 2. Mai 2022\t15:56:24.376\n\n\
                Name\tfast\tName\tslow\tother\nSampleTime[ms]\t0,5\tSampleTime[ms]\t1\t1\n\
                Unit\t(None)\tUnit\tV (Voltage)\t(None)\n\n\
                0\t1\t0\t10\t7\n0,5\t2\t1\t11\t8\n1\t3\n1,5\t4\nEOF\n";
    let found = read(text);
    let told: Vec<_> = found
        .channels
        .iter()
        .map(|c| {
            (
                c.name.as_str(),
                c.unit.is_some(),
                c.samples.len(),
                c.axis.rate_hz,
            )
        })
        .collect();
    assert_eq!(
        told,
        [
            ("fast", false, 4, Some(2000.0)),
            ("slow", true, 2, Some(1000.0)),
            ("other", false, 2, Some(1000.0))
        ]
    );
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    assert_eq!(
        found.channels[0].axis.start_text.as_deref(),
        Some("Montag, 2. Mai 2022 15:56:24.376")
    );
}

#[test]
fn mitsubishi() {
    let rows = rows(4, ",", &[&step(0.666_666, 6), &wave, &wave]);
    let text = format!(
        "Axis1\r\nNumber of sampling data,4\r\nSampling time interval(ms),0.667\r\n\
         Time,Analog 1,Digital 1\r\nms,Torque,INP\r\n{rows}\r\n"
    );
    let found = read(&text);
    check(
        &found,
        &[("Analog 1: Torque", "", 4), ("Digital 1: INP", "", 4)],
        Some(1500.0015),
    );
    assert!((found.channels[0].axis.header_rate_hz.unwrap() - 1499.250_374).abs() < 1e-6);
}

#[test]
fn kistler_catman_and_abb() {
    let rows_tab = |columns: usize| {
        let mut all: Vec<&dyn Fn(f64) -> String> = vec![];
        let time = step(0.001, 3);
        all.push(&time);
        all.extend(std::iter::repeat_n(
            &wave as &dyn Fn(f64) -> String,
            columns,
        ));
        rows(5, "\t", &all)
    };
    let text = format!(
        "Kistler DynoWare 3.2.5.0\nFile name:\tC:\\data\\test.dwd\nTest date:\t12.05.2021\n\
         Sampling rate [Hz]:\t1000.000000\nMeasuring time [s]:\t5.0\nNumber of samples:\t5\n\
         Cycle No.:\t1\nTime\tFx\tMz\ns\tN\tNm\n{}",
        rows_tab(2)
    );
    let found = read(&text);
    check(&found, &[("Fx", "N", 5), ("Mz", "Nm", 5)], Some(1000.0));
    assert_eq!(found.channels[0].axis.header_rate_hz, Some(1000.0));
    let text = format!(
        "HBM_CATMAN_DATAFILE\nT0 = 05.05.2014 15:24:43\nChannels: 2\n\n\
         Time  1 - default sample rate [s]\tMX840_CH_1 [N]\tMX840_CH_2 [mV/V]\n{}",
        rows_tab(2).replace('.', ",")
    );
    let found = read(&text);
    check(
        &found,
        &[("MX840_CH_1", "N", 5), ("MX840_CH_2", "mV/V", 5)],
        Some(1000.0),
    );
    assert_eq!(
        found.channels[0].axis.start_text.as_deref(),
        Some("05.05.2014 15:24:43")
    );
    let text = "Time [s]\t163.05 NAIO-03 ch1 torq.(P:00A305h)\t\n0.000\t 10.432\t\n0.001\t  9.625\t\n0.002\t 9.1\t\n";
    check(
        &read(text),
        &[("163.05 NAIO-03 ch1 torq.(P:00A305h)", "", 3)],
        Some(1000.0),
    );
}

#[test]
fn campbell() {
    let text = "\"TOA5\",\"Station\",\"CR1000\",\"E1234\",\"CR1000.Std.32\",\"CPU:x.CR1\",\"12345\",\"Fast\"\n\
                \"TIMESTAMP\",\"RECORD\",\"Batt_V\",\"Strain\"\n\"TS\",\"RN\",\"Volts\",\"microstrain\"\n\
                \"\",\"\",\"Avg\",\"Smp\"\n\"2012-08-10 10:00:00\",0,12.5,\"NAN\"\n\
                \"2012-08-10 10:00:00.05\",1,12.4,5.5\n\"2012-08-10 10:00:00.1\",2,12.3,5.25\n\
                \"2012-08-10 10:00:00.15\",3,12.2,5\n";
    let found = read(text);
    check(
        &found,
        &[("Batt_V", "Volts", 4), ("Strain", "microstrain", 4)],
        Some(20.0),
    );
    assert_eq!(found.channels[1].holes.len(), 1);
    assert_eq!(
        found.channels[0].axis.start_text.as_deref(),
        Some("2012-08-10 10:00:00")
    );
}
