//! Third-party MCAP files. The expected values were read with the Python packages
//! `mcap-ros2-support` and `mcap-ros1-support`.

use std::path::Path;

use libtest_mimic::Failed;
use torqcomp::io::Input;
use torqcomp::io::mcap::{
    FieldChoice, Inventory, SignalReader, SignalSummary, TimeChoice, TimeOptions, Writer,
};

use super::check;

fn scan(folder: &Path, name: &str) -> Result<Inventory, Failed> {
    let place = Input::File(folder.join("mcap").join(name));
    Ok(Inventory::scan(&place)?)
}

fn read(
    folder: &Path,
    name: &str,
    topic: &str,
    field: &str,
) -> Result<(Vec<i64>, Vec<f64>, SignalSummary), Failed> {
    let selection = FieldChoice {
        topic: Some(topic.to_owned()),
        field: Some(field.to_owned()),
        signal: None,
    };
    let place = Input::File(folder.join("mcap").join(name));
    let mut source = SignalReader::open(&place, &selection, &TimeOptions::default())?;
    let (mut all_times, mut all_values) = (Vec::new(), Vec::new());
    let (mut times, mut values) = (Vec::new(), Vec::new());
    while source.next(&mut times, &mut values)? {
        all_times.append(&mut times);
        all_values.append(&mut values);
    }
    Ok((all_times, all_values, source.finish()))
}

/// 94 channels of standard ROS 2 messages, two messages each, no statistics.
pub fn ros2_bag(folder: &Path) -> Result<(), Failed> {
    let name = "rosbags_rs_test_bag.mcap";
    let inventory = scan(folder, name)?;
    let counts = (inventory.channels.len(), inventory.messages);
    check(counts == (94, 188), format_args!("{counts:?}"))?;
    check(!inventory.is_lossy, "nothing is lost")?;
    let unread = inventory.channels.iter().filter(|c| c.unreadable.is_some());
    check(unread.count() == 0, "every channel can be read")?;
    let cases: [(&str, &str, &[f64]); 6] = [
        (
            "/test/geometry_msgs/wrench_stamped",
            "wrench.torque.z",
            &[0.3, 0.3],
        ),
        ("/test/sensor_msgs/joint_state", "effort[-1]", &[3.0, 3.0]),
        ("/test/sensor_msgs/imu", "orientation.w", &[1.0, 1.0]),
        (
            "/test/std_msgs/float64",
            "",
            &[271_828.0 / 1e5, 271_828.0 / 1e5],
        ),
        ("/test/std_msgs/int64", "data", &[-1e10, -1e10]),
        (
            "/test/sensor_msgs/point_cloud",
            "channels[0].values[0]",
            &[100.0, 100.0],
        ),
    ];
    for (topic, field, expected) in cases {
        let (_, values, summary) = read(folder, name, topic, field)?;
        check(
            values == expected,
            format_args!("{topic} {field}: {values:?}"),
        )?;
        check(!summary.is_lossy, format_args!("{topic}: nothing is lost"))?;
    }
    let (times, ..) = read(folder, name, "/test/sensor_msgs/joint_state", "effort[0]")?;
    let stamps = [1_749_315_324_955_078_144, 1_749_315_325_013_567_488];
    check(
        times == stamps,
        format_args!("stamps of the header: {times:?}"),
    )
}

/// ROS 1 in 413 chunks without compression.
pub fn ros1_file(folder: &Path) -> Result<(), Failed> {
    let inventory = scan(folder, "uncompressed.mcap")?;
    let counts: Vec<_> = inventory
        .channels
        .iter()
        .map(|channel| (channel.topic.as_str(), channel.messages))
        .collect();
    let expected = [("/diagnostics", 52), ("/tf", 774)];
    check(counts == expected, format_args!("{counts:?}"))?;
    check(inventory.chunks[0].chunks == 413, "413 chunks")?;
    let field = "transforms[0].transform.translation.x";
    let (times, values, _) = read(folder, "uncompressed.mcap", "/tf", field)?;
    check(times.len() == 774 && times.is_sorted(), times.len())?;
    check(values[0] == 3.835, values[0])
}

/// The recorder was stopped before it could close its only chunk.
pub fn open_chunk(folder: &Path) -> Result<(), Failed> {
    let inventory = scan(folder, "chunk_not_closed.mcap")?;
    check(
        inventory.is_lossy && !inventory.is_closed,
        "the loss is said",
    )?;
    check(inventory.library == "mcap-rs-0.23.3", &inventory.library)?;
    let warning = &inventory.warnings[0];
    check(warning.code == "mcap-truncated", &warning.message)?;
    check(warning.message.contains("byte 39"), &warning.message)
}

/// A copy contains everything, and the torque in addition.
pub fn copied(folder: &Path) -> Result<(), Failed> {
    use torqcomp::io::mcap::decode::Encoding;
    use torqcomp::io::mcap::writer::Added;
    for (name, encoding) in [
        ("rosbags_rs_test_bag.mcap", Encoding::Cdr),
        ("uncompressed.mcap", Encoding::Ros1),
    ] {
        let before = scan(folder, name)?;
        let added = Added {
            topic: "/torqcomp/compensated_torque".to_owned(),
            name: "torque".to_owned(),
            encoding,
        };
        let place = Input::File(folder.join("mcap").join(name));
        let mut writer = Writer::copying(&place, Vec::new(), name, &added)?;
        check(!before.is_lossy, "nothing is lost")?;
        let start = before
            .first_log_ns
            .and_then(|t| i64::try_from(t).ok())
            .unwrap_or(0);
        for sample in 0..1000 {
            let time = start + sample * 1000;
            writer.add(time, time, sample as f64 * 0.1)?;
        }
        let bytes = writer.finish(&Default::default())?;
        let out = tempfile::tempdir()?;
        std::fs::create_dir(out.path().join("mcap"))?;
        std::fs::write(out.path().join("mcap/out.mcap"), bytes)?;
        let after = scan(out.path(), "out.mcap")?;
        check(after.messages == before.messages + 1000, after.messages)?;
        let (channels, chunks) = (after.channels.len(), after.chunks[0].chunks);
        check(channels == before.channels.len() + 1, channels)?;
        check(chunks == before.chunks[0].chunks + 1, chunks)?;
        let (times, values, _) = read(
            out.path(),
            "out.mcap",
            "/torqcomp/compensated_torque",
            "effort[0]",
        )?;
        check(times[0] == start && values[999] == 999.0 * 0.1, values[999])?;
    }
    Ok(())
}

/// Log and publish time, if requested.
pub fn times(folder: &Path) -> Result<(), Failed> {
    let name = "rosbags_rs_test_bag.mcap";
    let selection = FieldChoice {
        signal: Some("/test/std_msgs/float64.data".to_owned()),
        ..FieldChoice::default()
    };
    let options = TimeOptions {
        time: Some(TimeChoice::Log),
        spacing: None,
    };
    let place = Input::File(folder.join("mcap").join(name));
    let mut source = SignalReader::open(&place, &selection, &options)?;
    let (mut times, mut values) = (Vec::new(), Vec::new());
    source.next(&mut times, &mut values)?;
    let gap = times[1] - times[0];
    check(gap == 9_400_000_000, format_args!("{times:?}"))?;
    let options = TimeOptions {
        time: Some(TimeChoice::Header),
        spacing: None,
    };
    let said = SignalReader::open(&place, &selection, &options).err();
    let said = said.map(|failure| failure.to_string()).unwrap_or_default();
    check(said.contains("no time stamp"), said)
}
