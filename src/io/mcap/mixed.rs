//! Topics whose messages mix the numbers of several signals.

use super::decode::MessageType;
use super::path::{self, PathPart, Slice};
use super::record::RawMessage;
use super::route::{self, Route};
use super::schema::FieldKind;

/// Number, first and last log time of the messages of each channel of a topic.
#[derive(Debug, Default)]
pub(super) struct Publishers(Vec<(u16, u64, u64)>);

impl Publishers {
    /// Records a message; returns two channels with interleaved messages.
    pub(super) fn note(&mut self, message: &RawMessage) -> Result<(), [u16; 2]> {
        let (id, at) = (message.channel_id, message.log_time_ns);
        let all = &mut self.0;
        let place = all.iter().position(|one| one.0 == id).unwrap_or_else(|| {
            all.push((id, at, at));
            all.len() - 1
        });
        all[place].1 = all[place].1.min(at);
        all[place].2 = all[place].2.max(at);
        let (_, first, last) = all[place];
        // A restarted recorder declares its channels again, one after the other.
        let others = all.iter().filter(|one| one.0 != id);
        let mut between = others.filter(|(_, start, end)| first < *end && *start < last);
        between.next().map_or(Ok(()), |other| Err([other.0, id]))
    }
}

/// Text about interleaved messages of two channels of a topic.
pub(super) fn two_publishers([one, other]: [u16; 2]) -> String {
    format!(
        "its channels {one} and {other} have interleaved messages: two nodes publish on it, and their samples are not \
         one signal; record only one of them, or split the file by channel"
    )
}

/// Detects messages that alternate between two frames, as when one node publishes two sensors.
///
/// # Errors
/// A sentence with their names.
pub(super) fn one_frame<'a>(
    of: &MessageType,
    number: &Route,
    messages: impl Iterator<Item = &'a [u8]>,
) -> Result<(), String> {
    let named = [&["header", "frame_id"][..], &["frame_id"]];
    let ways = named
        .iter()
        .filter_map(|names| route::way(&of.schema, names));
    let mut ways = ways.filter(|(_, kind)| **kind == FieldKind::Text);
    let Some((way, _)) = ways.next() else {
        return Ok(());
    };
    let frame = |message| of.texts(number, &way, message)?.pop();
    let frames: Vec<String> = messages.filter_map(frame).collect();
    // One that does not recur is a renamed frame.
    let between = |place: usize| {
        let before = frames[..place].iter().rposition(|f| *f == frames[place])?;
        frames.get(before + 1).filter(|f| **f != frames[place])
    };
    match (0..frames.len()).find_map(|place| Some([&frames[place], between(place)?])) {
        None => Ok(()),
        Some([one, other]) => Err(format!(
            "its messages alternate between the frames \"{one}\" and \"{other}\": two sensors share it, and their \
             samples are not one signal; publish each on a separate topic, or split the file by frame_id"
        )),
    }
}

/// Detects a request for all items of a list that is a table of several rows and columns, according to its `layout`
/// (`std_msgs/Float64MultiArray`): taken in order, the channels of a recorder would become samples of one.
///
/// # Errors
/// A sentence on how to select a row or a column.
pub(super) fn one_row(of: &MessageType, route: &Route, message: &[u8]) -> Result<(), String> {
    let mut parts = path::parse(&route.text)?;
    let is_all = parts.pop() == Some(PathPart::Slice(Slice::ALL));
    let (true, Some(PathPart::Name(list))) = (is_all, parts.pop()) else {
        return Ok(());
    };
    let sizes = [&parts[..], &path::parse("layout.dim[:].size")?].concat();
    let Ok(sizes) = Route::find(&of.schema, &sizes) else {
        return Ok(());
    };
    let sizes = of.values(&sizes, message).unwrap_or_default();
    let long: Vec<f64> = sizes.into_iter().filter(|size| *size > 1.0).collect();
    let [_, .., columns] = long[..] else {
        return Ok(());
    };
    let shape: Vec<String> = long.iter().map(f64::to_string).collect();
    parts.push(PathPart::Name(list));
    let list = path::text(&parts);
    Err(format!(
        "by its layout, \"{list}\" is a table of {} numbers, the last of these sizes running fastest, and its items are not \
         samples of one signal; choose a column, the first one as --field '{list}[0::{columns}]', or a row, the first one as \
         --field '{list}[0:{columns}]'",
        shape.join(" × ")
    ))
}

#[cfg(test)]
mod tests {
    use super::super::TimeOptions;
    use super::super::testing::{File, drain, open, options};
    use crate::failure::Failure;

    const FRAMED: (&str, &[u8]) = (
        "p/msg/M",
        b"std_msgs/Header header\nfloat64 data\n\
          ================================================================================\n\
          MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id",
    );

    /// Header, `frame_id` of one letter, value.
    fn framed(nanoseconds: u32, frame: u8, value: f64) -> Vec<u8> {
        let mut data = vec![0, 1, 0, 0];
        data.extend_from_slice(&7_u32.to_le_bytes());
        data.extend_from_slice(&nanoseconds.to_le_bytes());
        data.extend_from_slice(&2_u32.to_le_bytes());
        data.extend_from_slice(&[frame, 0, 0, 0]);
        data.extend_from_slice(&value.to_le_bytes());
        data
    }

    #[test]
    fn two_frames_by_turns_are_no_signal_and_one_that_is_renamed_is() {
        let said = |frames: &[u8]| {
            let mut file = File::new(options(None));
            file.channel(1, "/ft", "cdr+ros2msg", FRAMED);
            for (i, frame) in (0..).zip(frames) {
                file.message(1, u64::from(i) + 1, &framed(i, *frame, 0.5));
            }
            let mut reader = open(&file.finish(), ("/ft", "data"), &TimeOptions::default())?;
            reader.next(&mut Vec::new(), &mut Vec::new())
        };
        let mixed = said(b"lrlrlr").unwrap_err().to_string();
        assert!(mixed.contains("frames \"l\" and \"r\""), "{mixed}");
        assert!(said(b"lllrrr").unwrap());
        assert!(said(b"lll").unwrap());
    }

    /// `std_msgs/Float64MultiArray`: sizes of its layout, and its numbers.
    fn array(sizes: &[u32], numbers: &[f64]) -> Vec<u8> {
        let mut data = vec![0, 1, 0, 0];
        data.extend_from_slice(&(sizes.len() as u32).to_le_bytes());
        for size in sizes {
            data.extend_from_slice(&2_u32.to_le_bytes());
            data.extend_from_slice(b"a\0\0\0");
            data.extend_from_slice(&size.to_le_bytes());
            data.extend_from_slice(&0_u32.to_le_bytes());
        }
        data.extend_from_slice(&0_u32.to_le_bytes());
        data.extend_from_slice(&(numbers.len() as u32).to_le_bytes());
        while data.len() % 8 != 4 {
            data.push(0);
        }
        numbers
            .iter()
            .for_each(|x| data.extend_from_slice(&x.to_le_bytes()));
        data
    }

    const ARRAY: (&str, &[u8]) = (
        "std_msgs/msg/Float64MultiArray",
        b"std_msgs/MultiArrayLayout layout\nfloat64[] data\n\
          ================================================================================\n\
          MSG: std_msgs/MultiArrayLayout\nstd_msgs/MultiArrayDimension[] dim\nuint32 data_offset\n\
          ================================================================================\n\
          MSG: std_msgs/MultiArrayDimension\nstring label\nuint32 size\nuint32 stride",
    );

    #[test]
    fn a_table_in_a_message_is_asked_for_its_column_or_row() {
        let table = |sizes: &[u32]| {
            let mut file = File::new(options(None));
            file.channel(1, "/daq", "cdr+ros2msg", ARRAY);
            for i in 0..4_u32 {
                let first = f64::from(6 * i);
                let numbers: Vec<f64> = (0..6).map(|k| first + f64::from(k)).collect();
                file.message(1, 6000 * (u64::from(i) + 1), &array(sizes, &numbers));
            }
            file.finish()
        };
        let read = |sizes: &[u32], field: &str| {
            let mut reader = open(&table(sizes), ("/daq", field), &TimeOptions::default())?;
            Ok::<_, Failure>(drain(&mut reader))
        };
        let said = read(&[2, 3], "data[:]").unwrap_err().to_string();
        assert!(
            said.contains("2 × 3") && said.contains("data[0::3]"),
            "{said}"
        );
        let (times, values) = read(&[2, 3], "data[1::3]").unwrap();
        assert_eq!(values, [1.0, 4.0, 7.0, 10.0, 13.0, 16.0, 19.0, 22.0]);
        assert_eq!(times[..3], [6000, 9000, 12_000]);
        let (times, values) = read(&[2, 3], "data[3:6]").unwrap();
        assert_eq!(values[..4], [3.0, 4.0, 5.0, 9.0]);
        assert_eq!(times[..3], [6000, 8000, 10_000]);
        for sizes in [&[6_u32][..], &[6, 1], &[1, 6], &[]] {
            assert_eq!(read(sizes, "data[:]").unwrap().1.len(), 24);
        }
        let nothing = open(&table(&[]), ("/daq", "data[6::2]"), &TimeOptions::default());
        let mut reader = nothing.unwrap();
        assert!(drain(&mut reader).1.is_empty());
        let summary = reader.finish();
        assert!(summary.warnings[0].message.contains("the list has 6"));
    }
}
