//! ROS 2 bags of a joint on a torque sensor: a tap, and a run.

use std::f64::consts::TAU;

use super::Way;
use super::stand::{Plant, pulse, recorded, rise};
use crate::mcap_file::{Cdr, McapFile};

const STAND: Plant = Plant {
    natural_hz: 74.0,
    damping_ratio: 0.031,
};
const NOISE_N_M: f64 = 0.004;
const RATE_HZ: f64 = 1000.0;
/// 3 June 2024, 8:00 UTC.
const BEGIN_NS: u64 = 1_717_401_600_000_000_000;

const WRENCH_STAMPED: &str = "std_msgs/Header header\nWrench wrench\n\
    ================================================================================\nMSG: std_msgs/Header\n\
    builtin_interfaces/Time stamp\nstring frame_id\n\
    ================================================================================\nMSG: builtin_interfaces/Time\n\
    int32 sec\nuint32 nanosec\n\
    ================================================================================\nMSG: geometry_msgs/Wrench\n\
    Vector3 force\nVector3 torque\n\
    ================================================================================\nMSG: geometry_msgs/Vector3\n\
    float64 x\nfloat64 y\nfloat64 z\n";

pub(super) fn way() -> Way {
    // A lift: up, hold, down, with the ripple of the gear.
    let run = |t: f64| {
        let level =
            4.0 * rise(t - 0.5, 0.03) - 6.0 * rise(t - 1.5, 0.03) + 2.0 * rise(t - 2.5, 0.03);
        level + 0.4 * rise(t - 0.5, 0.2) * (TAU * 55.0 * t).cos()
    };
    let tap = |t: f64| 9.0 * pulse(t - 0.3, 0.006);
    Way {
        name: "ros2-bag",
        files: vec![
            ("tap.mcap", bag(&tap, 3000, 51)),
            ("run.mcap", bag(&run, 4000, 52)),
        ],
        rate_hz: RATE_HZ,
        applied_n_m: (0..4000).map(|i| run(f64::from(i) / RATE_HZ)).collect(),
    }
}

fn bag(torque: &dyn Fn(f64) -> f64, count: usize, seed: u64) -> Vec<u8> {
    let shown = STAND.shows(torque, RATE_HZ, count);
    let stored = recorded(&shown, NOISE_N_M, 1e-6, seed);
    let mut file = McapFile::new(None, "ros2", "ways");
    let schema = (
        "geometry_msgs/msg/WrenchStamped",
        "ros2msg",
        WRENCH_STAMPED.as_bytes(),
    );
    let sensor = file.channel("/torque_sensor", "cdr", Some(schema));
    for (i, torque) in stored.iter().enumerate() {
        let time_ns = BEGIN_NS + i as u64 * 1_000_000;
        let mut cdr = Cdr::new();
        cdr.stamp(time_ns);
        cdr.text("sensor");
        cdr.align(8);
        for value in [0.0, 0.0, 0.0, 0.0, 0.0, *torque] {
            cdr.f64(value);
        }
        file.message(sensor, i, time_ns, &cdr.0);
    }
    file.finish()
}
