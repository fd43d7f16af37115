//! LabVIEW TDMS files, written here by code independent of the reader: byte orders, layouts of raw data, metadata that
//! refer to previous ones, DAQmx scalers, and truncated or inconsistent data. Those of npTDMS are in `recordings`.

use serde_json::Value;

use crate::util::{Folder, table};

/// Raw data index: type, count, and for text the number of bytes.
const NO_DATA: u32 = u32::MAX;
const AS_BEFORE: u32 = 0;
/// Bits of the table of contents.
const METADATA: u32 = 2;
const NEW_LIST: u32 = 4;
const RAW: u32 = 8;
const INTERLEAVED: u32 = 32;
const BIG: u32 = 64;
const DAQMX: u32 = 128;

/// Bytes in a given order.
struct Out {
    bytes: Vec<u8>,
    is_big: bool,
}

impl Out {
    fn new(is_big: bool) -> Self {
        let bytes = Vec::new();
        Self { bytes, is_big }
    }

    fn raw(&mut self, little: &[u8]) -> &mut Self {
        match self.is_big {
            true => self.bytes.extend(little.iter().rev()),
            false => self.bytes.extend(little),
        }
        self
    }

    fn u32(&mut self, value: u32) -> &mut Self {
        self.raw(&value.to_le_bytes())
    }

    fn u64(&mut self, value: u64) -> &mut Self {
        self.raw(&value.to_le_bytes())
    }

    fn text(&mut self, text: &str) -> &mut Self {
        self.u32(text.len() as u32);
        self.bytes.extend(text.bytes());
        self
    }

    /// Path and index of an object; `0` and `u32::MAX` instead of an index of values.
    fn object(&mut self, path: &str, index: Result<(u32, u64), u32>) -> &mut Self {
        self.text(path);
        match index {
            Ok((kind, count)) => self.u32(20).u32(kind).u32(1).u64(count),
            Err(none) => self.u32(none),
        }
    }

    fn number(&mut self, key: &str, value: f64) -> &mut Self {
        self.text(key).u32(10).raw(&value.to_le_bytes())
    }

    fn word(&mut self, key: &str, value: &str) -> &mut Self {
        self.text(key).u32(0x20).text(value)
    }

    fn time(&mut self, key: &str, seconds: i64, fraction: u64) -> &mut Self {
        self.text(key).u32(0x44).stamp(seconds, fraction)
    }

    /// Seconds since 1904 and units of 2⁻⁶⁴ s.
    fn stamp(&mut self, seconds: i64, fraction: u64) -> &mut Self {
        self.raw(&(i128::from(seconds) << 64 | i128::from(fraction)).to_le_bytes())
    }
}

/// A segment of metadata and raw data; `open` leaves its length unknown.
fn segment(contents: u32, version: u32, metadata: &Out, data: &[u8], open: bool) -> Vec<u8> {
    let mut lead_in = Out::new(contents & BIG != 0);
    let length = (metadata.bytes.len() + data.len()) as u64;
    lead_in
        .u32(version)
        .u64(if open { u64::MAX } else { length })
        .u64(metadata.bytes.len() as u64);
    [
        b"TDSm",
        &contents.to_le_bytes()[..],
        &lead_in.bytes,
        &metadata.bytes,
        data,
    ]
    .concat()
}

fn values(folder: &Folder, channel: &str) -> Vec<f64> {
    let ran = folder.run(&["extract", "a.tdms", "--rate", "10", "--channel", channel]);
    assert!(matches!(ran.code, 0 | 3), "{}", ran.stderr);
    table(&ran.stdout).1.iter().map(|row| row[1]).collect()
}

/// A type of the format, and its storage of a number.
type Kind = (u32, fn(f64) -> Vec<u8>);

const TYPES: [Kind; 13] = [
    (1, |v| (v as i8).to_le_bytes().to_vec()),
    (2, |v| (v as i16).to_le_bytes().to_vec()),
    (3, |v| (v as i32).to_le_bytes().to_vec()),
    (4, |v| (v as i64).to_le_bytes().to_vec()),
    (5, |v| (v as u8).to_le_bytes().to_vec()),
    (6, |v| (v as u16).to_le_bytes().to_vec()),
    (7, |v| (v as u32).to_le_bytes().to_vec()),
    (8, |v| (v as u64).to_le_bytes().to_vec()),
    (9, |v| (v as f32).to_le_bytes().to_vec()),
    (10, |v| v.to_le_bytes().to_vec()),
    (0x19, |v| (v as f32).to_le_bytes().to_vec()),
    (0x1a, |v| v.to_le_bytes().to_vec()),
    (0x21, |v| vec![u8::from(v > 0.0)]),
];

/// A number as stored by a type.
fn as_stored(kind: u32, value: f64) -> f64 {
    match kind {
        5..=8 => value.max(0.0),
        0x21 => f64::from(u8::from(value > 0.0)),
        _ => value,
    }
}

#[test]
fn numbers_of_every_type_order_and_layout_are_read() {
    let folder = Folder::new();
    let of = |i: usize| i as f64 - 20.0;
    for (version, is_big, is_interleaved) in [
        (4712, false, false),
        (4713, false, true),
        (4713, true, false),
        (4712, true, true),
    ] {
        let mut metadata = Out::new(is_big);
        metadata.u32(TYPES.len() as u32);
        for (kind, _) in TYPES {
            metadata
                .object(&format!("/'g'/'k{kind:x}'"), Ok((kind, 10)))
                .u32(0);
        }
        // Four chunks of ten samples each in one segment.
        let mut data = Out::new(is_big);
        for chunk in 0..4 {
            let cells: Vec<(usize, usize)> = match is_interleaved {
                true => (0..10)
                    .flat_map(|i| (0..TYPES.len()).map(move |k| (i, k)))
                    .collect(),
                false => (0..TYPES.len())
                    .flat_map(|k| (0..10).map(move |i| (i, k)))
                    .collect(),
            };
            for (i, k) in cells {
                data.raw(&TYPES[k].1(of(10 * chunk + i)));
            }
        }
        let layout = if is_interleaved { INTERLEAVED } else { 0 };
        let contents = METADATA | NEW_LIST | RAW | layout | if is_big { BIG } else { 0 };
        folder.write(
            "a.tdms",
            segment(contents, version, &metadata, &data.bytes, false),
        );
        for (kind, _) in TYPES {
            let wanted: Vec<f64> = (0..40).map(|i| as_stored(kind, of(i))).collect();
            let case = format!("{kind:#x} {version} {is_big} {is_interleaved}");
            assert_eq!(values(&folder, &format!("g/k{kind:x}")), wanted, "{case}");
        }
    }
    let mut newer = segment(METADATA, 4714, Out::new(false).u32(0), &[], false);
    folder.write("a.tdms", &newer);
    folder
        .run(&["inspect", "a.tdms"])
        .says(1, &["4714", "4712 or 4713"]);
    newer.truncate(20);
    folder.write("a.tdms", &newer);
    folder
        .run(&["inspect", "a.tdms"])
        .says(1, &["lead-in of segment 1"]);
}

/// Two channels in the first segment; then no metadata, one channel with another count, a third channel in addition,
/// and a new list.
fn segments() -> Vec<Vec<u8>> {
    let doubles =
        |values: &[f64]| -> Vec<u8> { values.iter().flat_map(|v| v.to_le_bytes()).collect() };
    let mut first = Out::new(false);
    first
        .u32(4)
        .object("/", Err(NO_DATA))
        .u32(1)
        .word("name", "test 7");
    first.object("/'g'", Err(NO_DATA)).u32(0);
    first.object("/'g'/'a'", Ok((10, 2))).u32(4);
    first
        .word("unit_string", "N m")
        .number("wf_increment", 1e-3);
    first
        .number("wf_start_offset", 0.25)
        .time("wf_start_time", 3_790_000_000, 1 << 63);
    first.object("/'g'/'b'", Ok((10, 1))).u32(2);
    first
        .number("wf_increment", 2e-3)
        .time("wf_start_time", 3_790_000_001, 0);
    let mut other = Out::new(false);
    other.u32(1).object("/'g'/'a'", Ok((10, 3))).u32(0);
    let mut third = Out::new(false);
    third.u32(2).object("/'g'/'b'", Err(NO_DATA)).u32(0);
    third.object("/'g'/'it''s'", Ok((10, 1))).u32(0);
    let mut anew = Out::new(false);
    anew.u32(2).object("/'g'/'b'", Err(AS_BEFORE)).u32(0);
    anew.object("/'g'/'a'", Err(AS_BEFORE)).u32(1);
    // The time of the next waveform, which follows without a pause.
    anew.time("wf_start_time", 3_790_000_000, (1 << 63) + (1 << 57));
    let of = |contents, metadata: &Out, data: &[f64]| {
        segment(contents, 4713, metadata, &doubles(data), false)
    };
    vec![
        of(
            METADATA | NEW_LIST | RAW,
            &first,
            &[1.0, 2.0, -1.0, 3.0, 4.0, -2.0],
        ),
        of(RAW, &Out::new(false), &[5.0, 6.0, -3.0]),
        of(METADATA | RAW, &other, &[7.0, 8.0, 9.0, -4.0]),
        of(METADATA | RAW, &third, &[10.0, 11.0, 12.0, 0.5]),
        of(METADATA | NEW_LIST | RAW, &anew, &[-5.0, 13.0, 14.0, 15.0]),
    ]
}

#[test]
fn metadata_refer_to_those_before() {
    let folder = Folder::new();
    folder.write("a.tdms", segments().concat());
    let counted: Vec<f64> = (1..=15).map(f64::from).collect();
    assert_eq!(values(&folder, "g/a"), counted);
    assert_eq!(values(&folder, "g/b"), [-1.0, -2.0, -3.0, -4.0, -5.0]);
    let report = folder.json(&["inspect", "a.tdms", "--json"]);
    let third = &report["channels"][2];
    assert_eq!(
        (&third["name"], &third["samples"]),
        (&"g/it's".into(), &1.into())
    );
    let (a, b) = (&report["channels"][0], &report["channels"][1]);
    assert_eq!(report["format"], "tdms");
    assert_eq!(report["dialect"], "LabVIEW TDMS 2.0, 5 segments");
    assert_eq!(report["details"][0]["value"], "test 7");
    assert_eq!((&a["unit"], &a["rate_hz"]), (&"N m".into(), &1000.0.into()));
    assert_eq!((&a["start"], &b["start"]), (&0.25.into(), &0.5.into()));
    assert_eq!(b["rate_hz"], 500.0);
    // 20 h 46 min 40.5 s after midnight, and a quarter of a second.
    assert_eq!(a["start_time"], "2024-02-05T17:46:40.750000000Z");
    let refused = folder.run(&[
        "identify",
        "response",
        "a.tdms",
        "--applied",
        "g/a",
        "--measured",
        "g/b",
    ]);
    refused.says(1, &["1000 Hz", "500 Hz"]);
}

/// Each prefix of a file gives its complete part, with code 3, or is rejected; never a sample too many.
#[test]
fn what_is_whole_of_a_cut_file_is_read() {
    let folder = Folder::new();
    let parts = segments();
    let whole = parts.concat();
    let (mut most, mut lossy) = (0, 0);
    for end in (10..whole.len()).step_by(7) {
        folder.write("a.tdms", &whole[..end]);
        let words = ["extract", "a.tdms", "--rate", "10", "--channel", "g/a"];
        let ran = folder.run(&words);
        let mut ends = 0;
        let is_between = parts.iter().any(|part| {
            ends += part.len();
            ends == end
        });
        if ran.code == 1 {
            assert!(most == 0, "{end}: {}", ran.stderr);
            continue;
        }
        ran.says(if is_between { 0 } else { 3 }, &[]);
        lossy += usize::from(ran.code == 3 && ran.stderr.contains("file-cut"));
        let read: Vec<f64> = table(&ran.stdout).1.iter().map(|row| row[1]).collect();
        assert!(read.len() >= most && read.len() <= 15, "{end}");
        assert!(
            read.iter().zip(1..).all(|(v, k)| *v == f64::from(k)),
            "{end}"
        );
        most = read.len();
    }
    assert!(most >= 12 && lossy > 50, "{most} {lossy}");
}

#[test]
fn a_file_that_was_not_closed_gives_what_is_whole() {
    let folder = Folder::new();
    for is_interleaved in [false, true] {
        let mut metadata = Out::new(false);
        metadata.u32(2);
        metadata.object("/'g'/'a'", Ok((6, 4))).u32(0);
        metadata.object("/'g'/'b'", Ok((6, 4))).u32(0);
        let data: Vec<u8> = (0..21_u16).flat_map(u16::to_le_bytes).collect();
        let layout = if is_interleaved { INTERLEAVED } else { 0 };
        let contents = METADATA | NEW_LIST | RAW | layout;
        folder.write("a.tdms", segment(contents, 4713, &metadata, &data, true));
        let ran = folder.run(&["extract", "a.tdms", "--rate", "10", "--channel", "g/a"]);
        ran.says(3, &["file-cut", "segment 1, which was not closed"]);
        let wanted = match is_interleaved {
            true => vec![0, 2, 4, 6, 8, 10, 12, 14, 16, 18],
            false => vec![0, 1, 2, 3, 8, 9, 10, 11, 16, 17, 18, 19],
        };
        let wanted: Vec<f64> = wanted.into_iter().map(f64::from).collect();
        assert_eq!(values(&folder, "g/a"), wanted);
        // A last chunk with fewer samples, in a closed segment, is complete.
        folder.write(
            "a.tdms",
            segment(contents, 4713, &metadata, &data[..24], false),
        );
        let wanted = if is_interleaved {
            [8.0, 10.0]
        } else {
            [8.0, 9.0]
        };
        assert_eq!(values(&folder, "g/a")[4..], wanted);
        assert_eq!(values(&folder, "g/b").len(), 6);
    }
}

#[test]
fn damage_behind_whole_segments_leaves_them() {
    let folder = Folder::new();
    let mut whole = segments().concat();
    let second = segments()[0].len();
    whole[second] = b'x';
    folder.write("a.tdms", &whole);
    let ran = folder.run(&["extract", "a.tdms", "--channel", "g/a"]);
    ran.says(3, &["segment-damaged", "segment 2", "does not begin with"]);
    assert_eq!(table(&ran.stdout).1.len(), 4);
    // Claimed lengths reserve nothing.
    let mut metadata = Out::new(false);
    metadata
        .u32(1)
        .object("/'g'/'a'", Ok((10, u64::MAX / 8)))
        .u32(0);
    folder.write("a.tdms", segment(14, 4713, &metadata, &[0; 24], true));
    assert_eq!(values(&folder, "g/a"), [0.0; 3]);
    for path in [u32::MAX, 1 << 30] {
        let mut metadata = Out::new(false);
        metadata.u32(u32::MAX).u32(path);
        folder.write("a.tdms", segment(14, 4713, &metadata, &[0; 24], true));
        folder
            .run(&["inspect", "a.tdms"])
            .says(1, &["exceed their declared length"]);
    }
    let mut metadata = Out::new(false);
    metadata.u32(1).object("/'g'/'a'", Ok((0x0b, 3))).u32(0);
    folder.write("a.tdms", segment(14, 4713, &metadata, &[0; 30], false));
    folder
        .run(&["inspect", "a.tdms"])
        .says(1, &["extended precision", "DBL"]);
}

#[test]
fn stamps_are_the_times_of_their_group() {
    let folder = Folder::new();
    for is_big in [false, true] {
        let mut metadata = Out::new(is_big);
        metadata.u32(2);
        metadata.object("/'g'/'at'", Ok((0x44, 50))).u32(0);
        metadata.object("/'g'/'a'", Ok((9, 50))).u32(0);
        let mut data = Out::new(is_big);
        // Steps of 1/128 s.
        for i in 0..50_u64 {
            data.stamp(3_790_000_000 + (i / 128) as i64, (i % 128) << 57);
        }
        for i in 0..50 {
            data.raw(&(i as f32).to_le_bytes());
        }
        let contents = METADATA | NEW_LIST | RAW | if is_big { BIG } else { 0 };
        folder.write(
            "a.tdms",
            segment(contents, 4713, &metadata, &data.bytes, false),
        );
        let report = folder.json(&["inspect", "a.tdms", "--json"]);
        let channels = report["channels"].as_array().unwrap();
        assert_eq!(
            (channels.len(), &channels[0]["rate_hz"]),
            (1, &128.0.into())
        );
        assert_eq!(channels[0]["start_time"], "2024-02-05T17:46:40.000000000Z");
        let part = [
            "extract",
            "a.tdms",
            "--range",
            "2024-02-05T17:46:40.25Z..2024-02-05T17:46:40.3Z",
        ];
        let ran = folder.run(&part);
        assert_eq!(table(&ran.stdout).1[0], [0.25, 32.0], "{}", ran.stderr);
    }
}

/// A DAQmx index: count, scalers of type, buffer, offset and identifier, and widths of the buffers.
fn daqmx(out: &mut Out, path: &str, is_digital: bool, scalers: &[[u32; 4]], widths: &[u32]) {
    out.text(path).u32(if is_digital { 0x126a } else { 0x1269 });
    out.u32(u32::MAX).u32(1).u64(4).u32(scalers.len() as u32);
    for [kind, buffer, offset, id] in scalers {
        out.u32(*kind).u32(*buffer).u32(*offset);
        match is_digital {
            true => out.bytes.push(0),
            false => {
                out.u32(0);
            }
        }
        out.u32(*id);
    }
    out.u32(widths.len() as u32);
    for width in widths {
        out.u32(*width);
    }
}

#[test]
fn daqmx_scalers_lie_in_rows_of_buffers() {
    let folder = Folder::new();
    let mut metadata = Out::new(false);
    metadata.u32(3);
    daqmx(&mut metadata, "/'g'/'a'", false, &[[3, 0, 0, 0]], &[6, 4]);
    metadata.u32(5).text("NI_Number_Of_Scales").u32(7).u32(2);
    metadata.word("NI_Scale[1]_Scale_Type", "Linear");
    metadata.number("NI_Scale[1]_Linear_Slope", 0.5);
    metadata.number("NI_Scale[1]_Linear_Y_Intercept", 3.0);
    metadata
        .text("NI_Scale[1]_Linear_Input_Source")
        .u32(7)
        .u32(0);
    daqmx(&mut metadata, "/'g'/'b'", false, &[[5, 1, 0, 0]], &[6, 4]);
    metadata.u32(0);
    daqmx(
        &mut metadata,
        "/'g'/'c'",
        true,
        &[[4, 0, 16 + 3, 0]],
        &[6, 4],
    );
    metadata.u32(0);
    let mut data = Vec::new();
    for _ in 0..2 {
        for i in 0..4_i16 {
            data.extend((-i).to_le_bytes());
            data.extend((i32::from(i) << 2).to_le_bytes());
        }
        (0..4_i32).for_each(|i| data.extend((100_000 * i).to_le_bytes()));
    }
    let contents = METADATA | NEW_LIST | RAW | INTERLEAVED | DAQMX;
    folder.write("a.tdms", segment(contents, 4713, &metadata, &data, false));
    let twice = |of: [f64; 4]| [of, of].concat();
    assert_eq!(values(&folder, "g/a"), twice([3.0, 2.5, 2.0, 1.5]));
    assert_eq!(values(&folder, "g/b"), twice([0.0, 1e5, 2e5, 3e5]));
    assert_eq!(values(&folder, "g/c"), twice([0.0, 0.0, 1.0, 1.0]));
    // A scaler beyond its row.
    let mut metadata = Out::new(false);
    metadata.u32(1);
    daqmx(&mut metadata, "/'g'/'a'", false, &[[5, 0, 4, 0]], &[6]);
    metadata.u32(0);
    folder.write("a.tdms", segment(contents, 4713, &metadata, &data, false));
    folder
        .run(&["inspect", "a.tdms"])
        .says(1, &["DAQmx scaler"]);
}

/// Text properties of a channel, numeric ones, and the expected message.
type Case<'a> = (&'a [(&'a str, &'a str)], &'a [(&'a str, f64)], &'a str);

#[test]
fn scales_that_are_not_known_or_whole_are_named() {
    let folder = Folder::new();
    let of = |scales: &[(&str, &str)], numbers: &[(&str, f64)]| {
        let mut metadata = Out::new(false);
        metadata.u32(2).object("/'g'/'a'", Ok((10, 3)));
        metadata.u32((scales.len() + numbers.len()) as u32);
        for (key, text) in scales {
            metadata.word(key, text);
        }
        for (key, value) in numbers {
            metadata.number(key, *value);
        }
        metadata.object("/'g'/'b'", Ok((10, 3))).u32(0);
        segment(14, 4713, &metadata, &[0; 48], false)
    };
    let count = ("NI_Number_Of_Scales", 1.0);
    let cases: [Case; 5] = [
        (
            &[("NI_Scale[0]_Scale_Type", "Rosette")],
            &[count],
            "\"Rosette\"",
        ),
        (
            &[("NI_Scale[0]_Scale_Type", "Linear")],
            &[count],
            "lacks Linear_Y_Intercept",
        ),
        (
            &[],
            &[("NI_Number_Of_Scales", 4e9)],
            "declared, but missing",
        ),
        (&[], &[count], "scale 0 has no type"),
        (
            &[("NI_Scale[0]_Scale_Type", "AdvancedAPI")],
            &[count, ("NI_Scale[0]_AdvancedAPI_Input_Source", 0.0)],
            "takes its input from scale 0",
        ),
    ];
    for (scales, numbers, said) in cases {
        folder.write("a.tdms", of(scales, numbers));
        let report = folder.json(&["inspect", "a.tdms", "--json"]);
        assert_eq!(report["channels"][0]["name"], "g/b");
        let warnings = report["warnings"].as_array().unwrap();
        let left_out = warnings.iter().find(|w| w["code"] == "left-out").unwrap();
        let message = left_out["message"].as_str().unwrap();
        assert!(
            message.contains("\"g/a\"") && message.contains(said),
            "{message}"
        );
    }
}

#[test]
fn a_start_that_changes_and_another_dimension_are_told() {
    let folder = Folder::new();
    let codes = |report: &Value| -> Vec<String> {
        let warnings = report["warnings"].as_array().unwrap();
        warnings
            .iter()
            .map(|w| w["code"].as_str().unwrap().to_owned())
            .collect()
    };
    let of = |step: f64, seconds: i64, unit: &str| {
        let mut metadata = Out::new(false);
        metadata.u32(1).object("/'g'/'a'", Ok((5, 40))).u32(3);
        metadata
            .number("wf_increment", step)
            .word("wf_xunit_string", unit);
        metadata.time("wf_start_time", seconds, 0);
        segment(14, 4713, &metadata, &[0, 1, 2, 3, 4].repeat(8), false)
    };
    for (second, unit, code, rate) in [
        (of(0.1, 3_790_000_004, "s"), "s", None, Some(10.0)),
        (
            of(0.1, 3_790_000_009, "s"),
            "s",
            Some("restarted"),
            Some(10.0),
        ),
        (of(0.2, 3_790_000_004, "s"), "s", Some("no-time-axis"), None),
        (of(0.1, 3_790_000_000, "ms"), "ms", None, Some(10_000.0)),
        (
            of(0.1, 3_790_000_004, "Hz"),
            "Hz",
            Some("no-time-axis"),
            None,
        ),
    ] {
        folder.write("a.tdms", [of(0.1, 3_790_000_000, unit), second].concat());
        let report = folder.json(&["inspect", "a.tdms", "--json"]);
        let said = codes(&report);
        let told = ["restarted", "no-time-axis"]
            .into_iter()
            .find(|code| said.iter().any(|s| s == code));
        assert_eq!(told, code, "{report}");
        assert_eq!(report["channels"][0]["rate_hz"].as_f64(), rate, "{report}");
    }
}

/// A channel of times contradicts the step that LabVIEW states for channels without one.
#[test]
fn times_beside_another_increment_are_used_and_said() {
    let folder = Folder::new();
    let mut metadata = Out::new(false);
    metadata.u32(2);
    let time = metadata.object("/'g'/'Time'", Ok((10, 50))).u32(1);
    time.word("unit_string", "s");
    let record = metadata.object("/'g'/'a'", Ok((10, 50))).u32(1);
    record.number("wf_increment", 1.0);
    let times = (0..50).map(|i| f64::from(i) * 1e-4);
    let data = times
        .chain((0..50).map(f64::from))
        .flat_map(f64::to_le_bytes);
    let data: Vec<u8> = data.collect();
    folder.write("a.tdms", segment(14, 4713, &metadata, &data, false));
    for verb in ["inspect", "extract"] {
        let ran = folder.run(&[verb, "a.tdms"]);
        let said = format!("{}{}", ran.stdout, ran.stderr);
        assert!(said.contains("rate-contradicts-stamps"), "{verb}: {said}");
    }
    let report = folder.json(&["inspect", "a.tdms", "--json"]);
    assert_eq!(report["channels"][0]["rate_hz"].as_f64(), Some(10_000.0));
}
