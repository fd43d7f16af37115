use super::super::testing::{File, chunks, drain, float64, open, options};
use super::super::time::TimeChoice;
use super::*;
use mcap::Compression;

const FLOAT64: (&str, &[u8]) = ("std_msgs/msg/Float64", b"float64 data");

fn read(bytes: &[u8], topic: &str, field: &str) -> (Vec<i64>, Vec<f64>, SignalSummary) {
    let mut reader = open(bytes, (topic, field), &TimeOptions::default()).unwrap();
    let (times, values) = drain(&mut reader);
    (times, values, reader.finish())
}

fn numbers(options: mcap::WriteOptions, count: u64) -> Vec<u8> {
    let mut file = File::new(options);
    file.channel(3, "/x", "cdr+ros2msg", FLOAT64);
    file.channel(4, "/y", "cdr+ros2msg", FLOAT64);
    for place in 0..count {
        file.message(3, 1000 + place, &float64(place as f64 + 0.1));
        file.message(4, 1000 + place, &float64(-1.0));
    }
    file.finish()
}

#[test]
fn every_compression_and_none_and_no_chunks() {
    let all = [
        options(None),
        options(Some(Compression::Zstd)),
        options(Some(Compression::Lz4)),
        options(None).use_chunks(false),
        options(Some(Compression::Zstd)).emit_summary_records(false),
    ];
    for options in all {
        let (times, values, summary) = read(&numbers(options.clone(), 5000), "/x", "data");
        assert_eq!(times, (1000..6000).collect::<Vec<_>>(), "{options:?}");
        assert!(values.iter().enumerate().all(|(i, v)| *v == i as f64 + 0.1));
        assert_eq!((summary.messages, summary.samples), (5000, 5000));
        assert!(!summary.is_lossy && summary.warnings.is_empty());
    }
}

#[test]
fn a_cut_anywhere_gives_what_is_whole_and_is_said() {
    for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
        let whole = numbers(options(compression), 300);
        let mut last = 0;
        for end in (whole.len() / 2..whole.len() - 1).step_by(97) {
            let (_, values, summary) = read(&whole[..end], "/x", "data");
            assert!(summary.is_lossy, "{end}");
            assert_eq!(summary.warnings[0].code, "mcap-truncated");
            assert!(values.iter().enumerate().all(|(i, v)| *v == i as f64 + 0.1));
            assert!(values.len() >= last, "{end}");
            last = values.len();
        }
        assert_eq!(last, 300);
    }
}

#[test]
fn a_cut_chunk_without_compression_is_used_to_the_last_whole_message() {
    let whole = numbers(options(None).chunk_size(None), 300);
    let lengths: Vec<_> = [0.25, 0.5]
        .map(|share| (whole.len() as f64 * share) as usize)
        .map(|end| read(&whole[..end], "/x", "data").1.len())
        .into();
    assert!(
        lengths[0] > 40 && lengths[1] > lengths[0] + 40,
        "{lengths:?}"
    );
}

#[test]
fn a_damaged_chunk_is_left_out_and_the_others_are_used() {
    for compression in [None, Some(Compression::Zstd)] {
        let mut bytes = numbers(options(compression), 1000);
        let third = chunks(&bytes)[2];
        bytes[third + 150] ^= 0x55;
        let (times, values, summary) = read(&bytes, "/x", "data");
        assert!(summary.is_lossy);
        assert_eq!(summary.warnings[0].code, "mcap-damaged-chunk");
        assert!(
            values.len() > 800 && values.len() < 1000,
            "{}",
            values.len()
        );
        let is_right = |(time, value): (&i64, &f64)| *value == (*time - 1000) as f64 + 0.1;
        assert!(times.iter().zip(&values).all(is_right));
    }
}

#[test]
fn channels_of_a_damaged_first_chunk_are_known_from_the_end_of_the_file() {
    let mut bytes = numbers(options(Some(Compression::Zstd)), 1000);
    let first = chunks(&bytes)[0];
    bytes[first + 150] ^= 0x55;
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), &bytes).unwrap();
    let input = Input::File(file.path().to_owned());
    let choice = |topic: &str| FieldChoice {
        topic: Some(topic.to_owned()),
        ..FieldChoice::default()
    };
    let options = TimeOptions::default();
    let mut reader = SignalReader::open(&input, &choice("/x"), &options).unwrap();
    let (_, values) = drain(&mut reader);
    assert!(values.len() > 500 && values.len() < 1000);
    let summary = reader.finish();
    assert!(summary.is_lossy && summary.warnings[0].code == "mcap-damaged-chunk");
    // The same in one pass with others: nothing is output twice.
    let choices = [choice("/y"), choice("/z"), choice("/x")];
    let mut counts = [0; 3];
    let results = read_fields(&input, &choices, &options, |place, times, values| {
        assert_eq!(times.len(), values.len());
        counts[place] += values.len();
    });
    let results = results.unwrap();
    assert_eq!(counts, [values.len(), 0, values.len()]);
    let samples = |place: usize| results[place].as_ref().unwrap().1.samples;
    assert_eq!(
        (samples(0), samples(2)),
        (counts[0] as u64, counts[2] as u64)
    );
    let said = results[1].as_ref().unwrap_err().to_string();
    assert!(said.contains("no topic \"/z\""), "{said}");
}

#[test]
fn several_fields_in_one_pass_are_those_read_one_by_one() {
    let mut file = File::new(options(Some(Compression::Lz4)));
    file.channel(1, "/x", "json+", ("", b""));
    file.channel(2, "/y", "cdr+ros2msg", FLOAT64);
    for place in 0..30_000_u64 {
        let time = if place % 7 == 0 { place + 3 } else { place };
        let text = format!("{{\"a\": [{place}, 2], \"b\": {}}}", place * 2);
        file.message(1, time, text.as_bytes());
        file.message(2, place, &float64(-1.0));
    }
    let bytes = file.finish();
    let fields = [("/x", "b"), ("/y", "data"), ("/x", "a[0]"), ("/x", "c")];
    let choice = |(topic, field): &(&str, &str)| FieldChoice {
        topic: Some((*topic).to_owned()),
        field: Some((*field).to_owned()),
        signal: None,
    };
    let choices: Vec<_> = fields.iter().map(choice).collect();
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), &bytes).unwrap();
    let input = Input::File(file.path().to_owned());
    let mut together = vec![(Vec::new(), Vec::new()); fields.len()];
    let options = TimeOptions::default();
    let results = read_fields(&input, &choices, &options, |place, times, values| {
        together[place].0.extend_from_slice(times);
        together[place].1.extend_from_slice(values);
    });
    let results = results.unwrap();
    for (place, (topic, field)) in fields[..3].iter().enumerate() {
        let (times, values, mut summary) = read(&bytes, topic, field);
        assert!((times, values) == together[place], "{topic} {field}");
        let (selected, found) = results[place].as_ref().unwrap();
        assert_eq!(
            (selected.topic.as_str(), selected.field.as_str()),
            (*topic, *field)
        );
        summary.warnings.clone_from(&found.warnings);
        assert_eq!(summary, *found);
    }
    assert!(results[3].is_err());
}

#[test]
fn the_first_block_is_long_enough_to_tell_a_rate_from() {
    let bytes = numbers(options(None), 80_000);
    let mut reader = open(&bytes, ("/x", "data"), &TimeOptions::default()).unwrap();
    let (mut times, mut values) = (Vec::new(), Vec::new());
    assert!(reader.next(&mut times, &mut values).unwrap());
    assert_eq!((times.len(), values.len()), (BATCH, BATCH));
}

#[test]
fn the_end_of_a_signal_follows_from_the_summary() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let input = Input::File(file.path().to_owned());
    let end = |bytes: &[u8]| {
        std::fs::write(file.path(), bytes).unwrap();
        let choice = FieldChoice {
            topic: Some("/x".to_owned()),
            ..FieldChoice::default()
        };
        let reader = SignalReader::open(&input, &choice, &TimeOptions::default());
        reader.unwrap().end()
    };
    let (last_ns, messages) = (1999, 1000);
    for compression in [None, Some(Compression::Zstd)] {
        let bytes = numbers(options(compression), 1000);
        assert_eq!(end(&bytes), Some(SignalEnd { last_ns, messages }));
        assert_eq!(end(&bytes[..bytes.len() - 100]), None);
    }
    assert_eq!(end(&numbers(options(None).use_chunks(false), 1000)), None);
}

#[test]
fn messages_out_of_order_are_sorted_and_counted() {
    let mut file = File::new(options(None));
    file.channel(1, "/x", "cdr+ros2msg", FLOAT64);
    for time in [5, 3, 4, 9, 7] {
        file.message(1, time, &float64(time as f64));
    }
    let (times, values, summary) = read(&file.finish(), "x", "");
    assert_eq!(times, [3, 4, 5, 7, 9]);
    assert_eq!(values, [3.0, 4.0, 5.0, 7.0, 9.0]);
    assert_eq!((summary.out_of_order, summary.is_lossy), (3, false));
    assert_eq!(summary.warnings[0].code, "mcap-out-of-order");
}

#[test]
fn channels_of_a_topic_are_one_signal_unless_they_differ() {
    let mut file = File::new(options(None));
    file.channel(1, "/x", "cdr+ros2msg", FLOAT64);
    file.channel(2, "/x", "cdr+ros2msg", FLOAT64);
    file.message(1, 1, &float64(1.0));
    file.message(1, 2, &float64(2.0));
    file.message(2, 3, &float64(3.0));
    let (_, values, _) = read(&file.finish(), "/x", "data");
    assert_eq!(values, [1.0, 2.0, 3.0]);

    let mut file = File::new(options(None));
    file.channel(1, "/x", "cdr+ros2msg", FLOAT64);
    file.channel(2, "/x", "json+", ("", b""));
    file.message(1, 1, &float64(1.0));
    file.message(2, 2, b"{}");
    let bytes = file.finish();
    let said = open(&bytes, ("/x", ""), &TimeOptions::default());
    let said = said.err().unwrap().to_string();
    assert!(said.contains("channels of different types"), "{said}");
}

#[test]
fn two_publishers_on_a_topic_are_no_signal() {
    let mut file = File::new(options(None));
    file.channel(1, "/x", "cdr+ros2msg", FLOAT64);
    file.channel(2, "/x", "cdr+ros2msg", FLOAT64);
    file.channel(3, "/y", "cdr+ros2msg", FLOAT64);
    for time in 1..6_u64 {
        file.message(1 + (time % 2) as u16, time, &float64(time as f64));
        file.message(3, time, &float64(-1.0));
    }
    let bytes = file.finish();
    let read = |topic| -> Result<(), Failure> {
        let mut reader = open(&bytes, (topic, "data"), &TimeOptions::default())?;
        while reader.next(&mut Vec::new(), &mut Vec::new())? {}
        Ok(())
    };
    let said = read("/x").unwrap_err().to_string();
    assert!(
        said.contains("its channels 1 and 2 have interleaved messages"),
        "{said}"
    );
    read("/y").unwrap();
}

#[test]
fn the_time_is_the_messages_own_if_it_has_one_that_is_set() {
    let text = b"builtin_interfaces/Time stamp\nfloat64 data";
    let stamped = |seconds: u32| {
        let mut data = vec![0, 1, 0, 0];
        data.extend_from_slice(&seconds.to_le_bytes());
        data.extend_from_slice(&5_u32.to_le_bytes());
        data.extend_from_slice(&1.5_f64.to_le_bytes());
        data
    };
    let first = |seconds: u32, time: Option<TimeChoice>| {
        let mut file = File::new(options(None));
        file.channel(1, "/x", "cdr+ros2msg", ("p/msg/M", text));
        let mut data = stamped(seconds);
        if seconds == 0 {
            data[8] = 0;
        }
        file.message(1, 8_000_000_000, &data);
        let bytes = file.finish();
        let options = TimeOptions {
            time,
            spacing: None,
        };
        let mut reader = open(&bytes, ("/x", ""), &options).unwrap();
        (drain(&mut reader).0[0], reader.selected().time.choice)
    };
    assert_eq!(first(7, None), (7_000_000_005, TimeChoice::Header));
    assert_eq!(first(0, None), (8_000_000_000, TimeChoice::Log));
    let publish = Some(TimeChoice::Publish);
    assert_eq!(first(7, publish), (7_999_999_999, TimeChoice::Publish));
}

#[test]
fn messages_without_the_item_or_unreadable_are_counted_apart() {
    let mut file = File::new(options(None));
    file.channel(1, "/x", "cdr+ros2msg", ("p/msg/M", b"float64[] data"));
    let list = |values: &[f64]| {
        let mut data = vec![0, 1, 0, 0];
        data.extend_from_slice(&(values.len() as u32).to_le_bytes());
        data.extend_from_slice(&[0; 4]);
        values
            .iter()
            .for_each(|value| data.extend_from_slice(&value.to_le_bytes()));
        data
    };
    file.message(1, 1, &list(&[1.0, 2.0]));
    file.message(1, 2, &list(&[1.0]));
    file.message(1, 3, &list(&[1.0, 2.0])[..14]);
    let (_, values, summary) = read(&file.finish(), "/x", "data[1]");
    assert_eq!(values, [2.0]);
    assert_eq!((summary.without_item, summary.unreadable), (1, 1));
    assert!(summary.is_lossy);
    let codes: Vec<_> = summary.warnings.iter().map(|w| w.code).collect();
    assert_eq!(codes, ["mcap-unreadable", "mcap-without-item"]);
}

#[test]
fn an_item_asked_for_by_its_place_is_followed_by_its_name() {
    let mut file = File::new(options(None));
    file.channel(1, "/joints", "json+", ("", b""));
    let messages = [
        r#"{"name": ["arm", "hand"], "effort": [1, 7]}"#,
        r#"{"name": ["hand", "arm"], "effort": [8, 2]}"#,
        r#"{"name": ["wheel"], "effort": [9]}"#,
        r#"{"name": ["arm", "hand"], "effort": [3, 9]}"#,
    ];
    for (time, text) in messages.iter().enumerate() {
        file.message(1, time as u64, text.as_bytes());
    }
    let bytes = file.finish();
    let said = |field| {
        let (_, values, summary) = read(&bytes, "/joints", field);
        let codes: Vec<_> = summary.warnings.iter().map(|w| w.code).collect();
        (values, codes, summary.without_item)
    };
    let moved = vec!["mcap-without-item", "mcap-items-move"];
    assert_eq!(said("effort[0]"), (vec![1.0, 2.0, 3.0], moved.clone(), 1));
    assert_eq!(said("effort[1]"), (vec![7.0, 8.0, 9.0], moved, 1));
    let asked = (vec![1.0, 2.0, 3.0], vec!["mcap-without-item"], 1);
    assert_eq!(said("effort[name=arm]"), asked);
}

#[test]
fn items_with_names_are_asked_for_instead_of_taken_for_samples() {
    let mut file = File::new(options(None));
    file.channel(1, "/joints", "json+", ("", b""));
    let text = br#"{"name": ["arm", "hand"], "effort": [1, 7]}"#;
    file.message(1, 0, text);
    let said = open(&file.finish(), ("/joints", ""), &TimeOptions::default());
    let said = said.err().unwrap().to_string();
    assert!(
        said.contains("--field 'effort[name=arm]', --field 'effort[name=hand]'"),
        "{said}"
    );
}

#[test]
fn whole_lists_have_times_between_messages() {
    let mut file = File::new(options(None));
    file.channel(1, "/x", "json+", ("", b""));
    for (time, text) in [(0, "[1, 2, 3, 4]"), (1000, "[5, 6]"), (1500, "[7, 8]")] {
        file.message(1, time, format!("{{\"data\": {text}}}").as_bytes());
    }
    let (times, values, _) = read(&file.finish(), "/x", "data[:]");
    assert_eq!(times, [0, 250, 500, 750, 1000, 1250, 1500, 1750]);
    assert_eq!(values, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]);
}

#[test]
fn a_miss_says_what_is_there() {
    let bytes = numbers(options(None), 3);
    let said = |topic: &str, field: &str| {
        let source = open(&bytes, (topic, field), &TimeOptions::default());
        source.err().unwrap().to_string()
    };
    assert!(said("/z", "").contains("/x (std_msgs/msg/Float64), /y"));
    assert!(said("/x", "dat").contains("did you mean \"data\"?"));
    let not = open(b"time,v", ("/x", ""), &TimeOptions::default());
    assert!(not.err().unwrap().to_string().contains("not an MCAP file"));
}
