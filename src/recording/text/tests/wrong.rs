use proptest::prelude::*;

use super::*;

#[test]
fn what_is_no_recording_is_refused() {
    for (text, part) in [
        ("", "empty"),
        ("\n\n", "empty"),
        ("hello\nworld\n", "no table"),
        ("[section]\nkey=value\nother=5\n", "no table"),
        ("time_s\n0\n1\n2\n", "no column besides the time"),
    ] {
        let message = failure(text);
        assert!(message.contains(part), "{text:?}: {message}");
    }
    let row = |name: &str| {
        format!("\"0.1\",\"{name}\",\"AC\",0,\"mV\",0.574,\"mV/MU\",49.99,200.0,\"OFF\",1,\"Hz\"\n")
    };
    let text = format!(
        "Maker,CSV Save File,V2.5\n\nSection,2 Channels\nLocation,Name,Coupling,Mute,Units,Gain,Units,Sens,Full,LP,Bypass,Units\n{}{}{}",
        row("SG_1"),
        row("SG_2"),
        row("SG_3")
    );
    assert!(failure(&text).contains("settings"), "{}", failure(&text));
}

#[test]
fn rows_of_wild_lengths_do_not_fill_the_memory() {
    let wide = "1,".repeat(8000) + "1\n";
    let text = format!("{wide}{wide}{}{wide}", "1\n".repeat(2_000));
    assert!(failure(&text).contains("longer than the rows before"));
}

const SAMPLES: [&str; 6] = [
    "LabVIEW Measurement\t\nSeparator\tTab\nX_Columns\tMulti\n***End_of_Header***\t\nChannels\t2\t\t\n\
     Samples\t2\t\t2\nX0\t0\t\t0\nDelta_X\t1\t\t1\n***End_of_Header***\nX_Value\tA\tX_Value\tB\tComment\n0\t1\t0\t2\n1\t2\t1\t3\n",
    "LECROYX,1,Waveform\nSegments,2,SegmentSize,2\nSegment,TrigTime,TimeSinceSegment1\n#1,26-Mar-2026 14:34:31,0\n#2,26-Mar-2026 14:34:31,1\nTime,Ampl\n0,1\n1,2\n0,1\n1,2\n",
    "Record Length,3,,0.0,1.0,\nSample Interval,1,,1.0,2.0\n,,,2.0,3.0\n",
    "X,CH1,Start,Increment,\nSequence,Volt,-1,0.5,\n0,1,\n1,2,\n",
    "Name\tx\tName\ty\tz\nSampleTime[ms]\t1\tSampleTime[ms]\t2\t2\nUnit\tV\tUnit\tA\tA\n\n0\t1\t0\t2\t3\n1\t2\t2\t3\t4\n2\t3\n",
    "# Abtastrate: 1 kHz\nDatum;Uhrzeit;Kraft [N];\"Weg, ges.\"\n01.02.2024;12:00:00,5;\"1.234,5\";2\n01.02.2024;12:00:01,5;NaN;3\n",
];

proptest! {
    /// Whatever is changed, left out or put in, reading ends with a recording or a message.
    #[test]
    fn nothing_makes_it_panic(
        sample in 0..SAMPLES.len(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..4_u8), 0..12),
        cut in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let mut bytes = SAMPLES[sample].as_bytes().to_vec();
        for (place, byte, how) in edits {
            let at = place.index(bytes.len());
            match how {
                0 => bytes[at] = byte,
                1 => { bytes.remove(at); }
                2 => bytes.insert(at, b"\n\t;,\"9-.:e#\0"[usize::from(byte) % 12]),
                _ => {
                    let end = (at + usize::from(byte)).min(bytes.len());
                    let part = bytes[at..end].to_vec();
                    bytes.splice(at..at, part);
                }
            }
            if bytes.is_empty() {
                break;
            }
        }
        if is_cut && !bytes.is_empty() {
            bytes.truncate(cut.index(bytes.len()));
        }
        let read = super::super::read("sample", bytes, &Options::default());
        if let Ok(recording) = read {
            for channel in &recording.channels {
                let finite = channel.samples.iter().filter(|value| value.is_finite()).count();
                prop_assert_eq!(finite + channel.holes.len(), channel.samples.len());
                if let Some(hz) = channel.axis.rate_hz {
                    prop_assert!(hz > 0.0 && hz.is_finite());
                }
            }
        }
    }
}

#[test]
fn sums_and_means_below_the_samples() {
    let samples = rows(40, ";", &[&comma(step(0.5, 1)), &comma(wave)]);
    for below in [
        "\nMittelwert;2,001\nMaximum;2,06\nMinimum;1,94\n",
        "Min;1,94\nMax;2,06\nMittel;2,00\n",
        ";2,06\n;1,94\n;2,00\n",
    ] {
        let found = read(&format!("Zeit [s];M [Nm]\n{samples}{below}"));
        check(&found, &[("M", "Nm", 40)], Some(2.0));
        let said = &found.warnings[0];
        assert_eq!(said.code, "lines-skipped", "{below}");
        assert!(said.message.starts_with("3 row(s)"), "{}", said.message);
        // The headings, 40 rows, and perhaps an empty line.
        let line = if below.starts_with('\n') { 43 } else { 42 };
        assert!(
            said.message.ends_with(&format!("line {line}")),
            "{}",
            said.message
        );
        assert!(found.channels[0].holes.is_empty());
    }
    // Stamps now and then only.
    let now_and_then = |row: f64| {
        if row % 4.0 == 0.0 {
            format!("{row}")
        } else {
            String::new()
        }
    };
    let found = read(&format!(
        "Zeit [s];M [Nm]\n{}",
        rows(40, ";", &[&now_and_then, &comma(wave)])
    ));
    assert_eq!(found.channels[0].samples.len(), 40);
}

#[test]
fn variables_in_turn_are_refused() {
    let list: String = (0..20)
        .flat_map(|second| {
            [("Torque", 2), ("Speed", 100)].map(|(name, value)| {
                format!("\"{name}\";\"10.03.2015 14:10:{second:02}\";{value},5;1\n")
            })
        })
        .collect();
    let message = failure(&format!("VarName;TimeString;VarValue;Validity\n{list}"));
    assert!(
        message.starts_with("line 2: the rows name 2 variables in turn, first \"Torque\""),
        "{message}"
    );
    // The states of a switch are none.
    let states: String = (0..20)
        .map(|second| {
            format!(
                "\"{}\";\"10.03.2015 14:10:{second:02}\";2,5;1\n",
                if second < 9 { "on" } else { "off" }
            )
        })
        .collect();
    let found = read(&format!("State;TimeString;M;n\n{states}"));
    assert_eq!(found.channels[0].samples.len(), 20);
}
