//! Cases not covered by samples: `tests/recordings` has a file of every dialect, with the expected
//! result.

use proptest::prelude::*;

use crate::failure::Failure;
use crate::io::Reading;
use crate::recording::{HoleKind, Recording};

fn read(text: &str) -> Result<Recording, Failure> {
    super::read("sample", text.as_bytes().to_vec(), &Reading::default())
}

#[test]
fn what_has_one_table_of_samples_streams() {
    let held = |text: &str| {
        let bytes = Box::new(std::io::Cursor::new(text.as_bytes().to_vec()));
        let file = super::TextFile::open("sample", bytes, &Reading::default()).unwrap();
        file.held_whole
    };
    for text in [
        "time_s,bridge_V\n0,0.5\n0.1,0.6\n0.2,0.7\n",
        "\u{feff}Time [s];Torque [N m]\r\n0,0;1,5\r\n0,1;1,6\r\n",
        "time_s,bridge_V\r\r\n0,0.5\r\r\n0.1,0.6\r\r\n",
        "Time;Force [N]\n12:00:00;1\n12:00:01;2\n",
        "t1 [s],a [V],t2 [s],b [V]\n0,1,0,2\n1,2,1,3\n",
        "time_s,load_N\n0,\"1,234.5\"\n1,\"2,345.5\"\n",
    ] {
        assert_eq!(held(text), None, "{text}");
    }
    for text in [
        "X,CH1,Start,Increment,\nSequence,Volt,-1,0.5,\n0,1,\n1,2,\n",
        "time_s,a_V\n0,1\n1,2\n\ntime_s,a_V\n0,1\n1,2\n",
        "Time;ms;Force [N]\n12:00:00;0;1\n12:00:00;500;2\n12:00:01;0;2\n12:00:01;500;2\n",
    ] {
        assert!(held(text).is_some(), "{text}");
    }
}

#[test]
fn holes_are_kept_with_their_lines() {
    let found = read("t [s],a [V],b [V]\n0,1,2\n1,,4\n2,error,6\n\n3,7,NaN\n4,8\n5,9\n").unwrap();
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
fn rows_of_wild_lengths_do_not_fill_the_memory() {
    let wide = "1,".repeat(8000) + "1\n";
    let text = format!("{wide}{wide}{}{wide}", "1\n".repeat(2_000));
    let failure = read(&text).unwrap_err().to_string();
    assert!(failure.contains("longer than the rows before"), "{failure}");
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
    /// Whatever is changed, removed or inserted, reading ends with a recording or a message.
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
        let read = super::read("sample", bytes, &Reading::default());
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
