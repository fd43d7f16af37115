use super::super::path;
use super::super::route::Route;
use super::super::schema::{Number, Struct};
use super::super::time::Stamp;
use super::*;

/// message M { Stamp stamp = 1; repeated string name = 2; repeated double effort = 3;
///             repeated Joint joints = 4; sint32 z = 5; optional double o = 6; }
/// message Stamp { int64 seconds = 1; int32 nanos = 2; }  message Joint { string name = 1;
/// float torque = 2; }
fn schema() -> Arc<Schema> {
    let field = |name: &str, number, kind, absent| Field {
        wire: Some(Wire {
            number,
            zigzag: name == "z",
            fixed: false,
            absent,
        }),
        ..Field::new(name, kind)
    };
    let zero = Some(0.0);
    let joint = vec![
        field("name", 1, Kind::Text, zero),
        field("torque", 2, Kind::Number(Number::F32), zero),
    ];
    let stamp = vec![
        field("seconds", 1, Kind::Number(Number::I64), zero),
        field("nanos", 2, Kind::Number(Number::I32), zero),
    ];
    let root = vec![
        field("stamp", 1, Kind::Struct(1), zero),
        field("name", 2, Kind::list(Kind::Text), zero),
        field("effort", 3, Kind::list(Kind::Number(Number::F64)), zero),
        field("joints", 4, Kind::list(Kind::Struct(2)), zero),
        field("z", 5, Kind::Number(Number::I32), zero),
        field("o", 6, Kind::Number(Number::F64), None),
    ];
    let structs = [root, stamp, joint]
        .into_iter()
        .map(|fields| Struct {
            name: String::new(),
            fields,
        })
        .collect();
    Arc::new(Schema { structs, root: 0 })
}

fn read(field: &str, message: &[u8]) -> Result<Reading, Damage> {
    let schema = schema();
    let targets = Targets {
        value: Route::find(&schema, &path::parse(field).unwrap()).unwrap(),
        stamp: Stamp::find(&schema),
        spacing: None,
    };
    let mut reading = Reading::default();
    Decoder::new(&schema, targets).read(message, &mut reading)?;
    Ok(reading)
}

fn message() -> Vec<u8> {
    let mut bytes = b"\x0a\x04\x08\x07\x10\x05\x12\x01a\x12\x01b".to_vec();
    // Two efforts packed, a third one single.
    bytes.extend_from_slice(b"\x1a\x10");
    bytes.extend_from_slice(&1.5_f64.to_le_bytes());
    bytes.extend_from_slice(&(-2.5_f64).to_le_bytes());
    bytes.push(0x19);
    bytes.extend_from_slice(&0.1_f64.to_le_bytes());
    // joints { torque: 4 }, joints { name: "b" torque: 8 }
    bytes.extend_from_slice(b"\x22\x05\x15\0\0\x80\x40\x22\x08\x0a\x01b\x15\0\0\0\x41");
    bytes.extend_from_slice(b"\x28\x03");
    bytes
}

#[test]
fn items_by_place_and_by_name() {
    let bytes = message();
    let value = |field: &str| read(field, &bytes).map(|reading| reading.values);
    assert_eq!(value("effort[0]").unwrap(), [1.5]);
    assert_eq!(value("effort[-1]").unwrap(), [0.1]);
    assert_eq!(value("effort[:]").unwrap(), [1.5, -2.5, 0.1]);
    assert_eq!(value("effort[name=b]").unwrap(), [-2.5]);
    assert_eq!(value("joints[name=b].torque").unwrap(), [8.0]);
    assert_eq!(value("joints[0].torque").unwrap(), [4.0]);
    assert_eq!(value("joints[:].torque").unwrap(), [4.0, 8.0]);
    assert_eq!(value("z").unwrap(), [-2.0]);
    assert_eq!(
        value("effort[name=c]"),
        Err(Damage::NoName {
            name: "c".to_owned(),
            there: vec!["a".to_owned(), "b".to_owned()]
        })
    );
    let index = 3;
    assert_eq!(value("effort[3]"), Err(Damage::NoItem { index, count: 3 }));
}

#[test]
fn what_is_not_set_is_zero_only_where_the_language_says_so() {
    assert_eq!(read("z", b"").unwrap().values, [0.0]);
    assert_eq!(read("o", b""), Err(Damage::Absent));
    assert_eq!(read("z", b"").unwrap().stamp_ns(), None);
    assert_eq!(
        read("z", &message()).unwrap().stamp_ns(),
        Some(7_000_000_005)
    );
    // A message in two parts is both of them together; within it the last one counts.
    let parts = b"\x0a\x02\x08\x07\x0a\x04\x10\x05\x08\x09";
    assert_eq!(read("z", parts).unwrap().stamp_ns(), Some(9_000_000_005));
}

#[test]
fn a_cut_message_is_damage() {
    let bytes = message();
    assert!(read("z", &bytes[..bytes.len() - 1]).is_err());
    assert!(read("z", &bytes[..20]).is_err());
}
