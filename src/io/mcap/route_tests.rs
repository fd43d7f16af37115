use super::super::schema::ros2msg::{Generation, read};
use super::*;

fn joints() -> Schema {
    let text = format!(
        "Header header\nstring[] name\nfloat64[] position\nfloat64[] effort\nMotor[] motors\n\
         float32[3] fixed\n{0}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\n{0}\n\
         MSG: p/Motor\nstring id\nfloat64 torque",
        "=".repeat(80)
    );
    read("p/msg/Joints", &text, Generation::Ros2).unwrap()
}

fn find(schema: &Schema, field: &str) -> Result<Route, String> {
    Route::find(schema, &path::parse(field).unwrap())
}

#[test]
fn ways_to_one_number() {
    let schema = joints();
    let route = find(&schema, "effort[-1]").unwrap();
    assert_eq!(route.hops, [Hop::Field(3), Hop::Item(-1)]);
    let route = find(&schema, "effort[name=motor_joint]").unwrap();
    assert_eq!(route.hops, [Hop::Field(3), Hop::Called]);
    let lookup = route.lookup.unwrap();
    assert_eq!(lookup.hops, [Hop::Field(1), Hop::All]);
    assert_eq!(lookup.name, "motor_joint");
    let route = find(&schema, "motors[id=left].torque").unwrap();
    assert_eq!(route.hops, [Hop::Field(4), Hop::Called, Hop::Field(1)]);
    let lookup = route.lookup.unwrap();
    assert_eq!(lookup.hops, [Hop::Field(4), Hop::All, Hop::Field(0)]);
    assert_eq!(route.types, ["p/Joints", "p/Motor"]);
    assert!(find(&schema, "effort[:]").unwrap().is_whole_list());
    assert_eq!(find(&schema, "fixed[2]").unwrap().number, Number::F32);
}

#[test]
fn a_miss_lists_what_is_there_and_what_was_meant() {
    let schema = joints();
    let said = |field: &str| find(&schema, field).unwrap_err();
    let text = said("efort[0]");
    assert!(text.contains("(did you mean \"effort\"?)"), "{text}");
    assert!(text.contains("effort[] (float64)"), "{text}");
    assert!(said("effort").contains("effort[0]"));
    assert!(said("name[0]").contains("is text"));
    assert!(said("header").contains("is not one number"));
    assert!(said("fixed[3]").contains("has 3 items"));
    assert!(said("effort.x").contains("is a list"));
    assert!(said("header[0]").contains("is not a list"));
    assert!(said("effort[joint=a]").contains("no texts \"joint\""));
    let text = said("motors[0].torq");
    let listed = text.split("there are: ").nth(1).unwrap();
    assert!(listed.starts_with("motors[].torque"), "{text}");
}

#[test]
fn a_bare_topic_is_its_only_number() {
    let only = |text: &str| Route::find(&read("p/M", text, Generation::Ros2).unwrap(), &[]);
    let stamped = "builtin_interfaces/Time stamp\nstring unit\nfloat64 data";
    assert_eq!(only(stamped).unwrap().text, "data");
    assert_eq!(only("float32[8] data").unwrap().text, "data[:]");
    assert!(
        only("float64 x\nfloat64 y")
            .unwrap_err()
            .contains("--field")
    );
    assert!(only("string s").unwrap_err().contains("no number"));
}
