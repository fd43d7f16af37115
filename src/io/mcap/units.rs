//! Units of numbers in messages.

use std::collections::BTreeMap;

use super::route::Route;

/// A unit and its origin.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnitFound {
    /// The unit as text.
    pub unit: String,
    /// Its origin, for messages.
    pub from: String,
}

/// Units of standard ROS messages, from their definitions (REP 103): type, field, unit.
const STANDARD: &[(&str, &str, &str)] = &[
    ("sensor_msgs/JointState", "position", "rad"),
    ("sensor_msgs/JointState", "velocity", "rad/s"),
    ("sensor_msgs/JointState", "effort", "N m"),
    ("geometry_msgs/Wrench", "force", "N"),
    ("geometry_msgs/Wrench", "torque", "N m"),
    ("geometry_msgs/Accel", "linear", "m/s^2"),
    ("geometry_msgs/Accel", "angular", "rad/s^2"),
    ("geometry_msgs/Twist", "linear", "m/s"),
    ("geometry_msgs/Twist", "angular", "rad/s"),
    ("geometry_msgs/Pose", "position", "m"),
    ("geometry_msgs/Transform", "translation", "m"),
    ("sensor_msgs/Imu", "angular_velocity", "rad/s"),
    ("sensor_msgs/Imu", "linear_acceleration", "m/s^2"),
    ("sensor_msgs/BatteryState", "voltage", "V"),
    ("sensor_msgs/BatteryState", "current", "A"),
    ("sensor_msgs/Temperature", "temperature", "°C"),
    ("sensor_msgs/FluidPressure", "fluid_pressure", "Pa"),
    ("sensor_msgs/Range", "range", "m"),
    ("trajectory_msgs/JointTrajectoryPoint", "positions", "rad"),
    (
        "trajectory_msgs/JointTrajectoryPoint",
        "velocities",
        "rad/s",
    ),
    (
        "trajectory_msgs/JointTrajectoryPoint",
        "accelerations",
        "rad/s^2",
    ),
    ("trajectory_msgs/JointTrajectoryPoint", "effort", "N m"),
];

/// Unit of a number: from the definition, from the channel's metadata (`unit` or `units`, or
/// `unit.FIELD` for one field), or from the standard message. The effort of a prismatic joint would
/// be in N; as the definition does not distinguish, a revolute joint is assumed and the assumption
/// reported.
pub fn find(route: &Route, metadata: &BTreeMap<String, String>) -> Option<UnitFound> {
    let found = |unit: &str, from: String| {
        (!unit.is_empty()).then(|| UnitFound {
            unit: unit.to_owned(),
            from,
        })
    };
    if let Some(unit) = &route.unit {
        return found(unit, "the message's definition".to_owned());
    }
    let plain = route.fields.join(".");
    let keys = [
        format!("unit.{}", route.text),
        format!("unit.{plain}"),
        "unit".to_owned(),
        "units".to_owned(),
    ];
    for key in &keys {
        if let Some(unit) = metadata.get(key) {
            return found(unit, format!("the channel's metadata \"{key}\""));
        }
    }
    // The innermost type with a unit is the closest to the number.
    for (place, name) in route.types.iter().enumerate().rev() {
        let field = route.fields.get(place).map(String::as_str);
        let standard = STANDARD
            .iter()
            .find(|(kind, known, _)| kind == name && Some(*known) == field);
        if let Some((kind, _, unit)) = standard {
            return found(unit, format!("the definition of {kind}"));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::super::path;
    use super::super::schema::ros2msg::{Generation, read};
    use super::*;

    fn unit(name: &str, text: &str, field: &str, pairs: &[(&str, &str)]) -> Option<String> {
        let text = text.replace("---", &"=".repeat(80));
        let schema = read(name, &text, Generation::Ros2).unwrap();
        let route = Route::find(&schema, &path::parse(field).unwrap()).unwrap();
        let pairs = pairs
            .iter()
            .map(|(k, v)| ((*k).to_owned(), (*v).to_owned()));
        find(&route, &pairs.collect()).map(|found| found.unit)
    }

    #[test]
    fn standard_messages_have_units() {
        let joint = "string[] name\nfloat64[] effort";
        let name = "sensor_msgs/msg/JointState";
        assert_eq!(unit(name, joint, "effort[0]", &[]).as_deref(), Some("N m"));
        let wrench = "Wrench wrench\n---\nMSG: geometry_msgs/Wrench\nVector3 force\nVector3 torque\
                      \n---\nMSG: geometry_msgs/Vector3\nfloat64 z";
        let name = "geometry_msgs/msg/WrenchStamped";
        assert_eq!(
            unit(name, wrench, "wrench.torque.z", &[]).as_deref(),
            Some("N m")
        );
        assert_eq!(
            unit(name, wrench, "wrench.force.z", &[]).as_deref(),
            Some("N")
        );
        assert_eq!(unit("std_msgs/Float64", "float64 data", "data", &[]), None);
    }

    #[test]
    fn metadata_come_before_what_is_usual() {
        let joint = "string[] name\nfloat64[] effort\nfloat64[] velocity";
        let name = "sensor_msgs/msg/JointState";
        let pairs = [("unit.effort", "lbf ft"), ("units", "V")];
        assert_eq!(
            unit(name, joint, "effort[0]", &pairs).as_deref(),
            Some("lbf ft")
        );
        assert_eq!(
            unit(name, joint, "velocity[0]", &pairs).as_deref(),
            Some("V")
        );
    }
}
