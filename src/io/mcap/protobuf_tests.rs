use std::sync::Arc;

use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet};

use super::super::decode::{Damage, Decoder, Encoding, Reading, Targets};
use super::super::path;
use super::super::route::Route;
use super::super::schema::{Schema, protobuf};
use super::super::time::Stamp;

/// message M { Stamp stamp = 1; repeated string name = 2; repeated double effort = 3;
///             repeated Joint joints = 4; sint32 z = 5; optional double o = 6; }
/// message Stamp { int64 seconds = 1; int32 nanos = 2; }  message Joint { string name = 1;
/// float torque = 2; }
fn schema() -> Arc<Schema> {
    let joint = [("name", Type::String), ("torque", Type::Float)];
    let stamp = [("seconds", Type::Int64), ("nanos", Type::Int32)];
    let mut root = message_type(
        "M",
        &[
            ("stamp", Type::Message),
            ("name", Type::String),
            ("effort", Type::Double),
            ("joints", Type::Message),
            ("z", Type::Sint32),
            ("o", Type::Double),
        ],
    );
    root.field[0].type_name = Some("Stamp".to_owned());
    root.field[3].type_name = Some("Joint".to_owned());
    for field in &mut root.field[1..4] {
        field.label = Some(Label::Repeated as i32);
    }
    root.field[5].proto3_optional = Some(true);
    root.field[5].oneof_index = Some(0);
    root.oneof_decl.push(prost_types::OneofDescriptorProto {
        name: Some("_o".to_owned()),
        options: None,
    });
    let types = vec![
        root,
        message_type("Stamp", &stamp),
        message_type("Joint", &joint),
    ];
    Arc::new(definition("M", types, "proto3"))
}

fn message_type(name: &str, fields: &[(&str, Type)]) -> DescriptorProto {
    let field = |(place, (name, kind)): (usize, &(&str, Type))| FieldDescriptorProto {
        name: Some((*name).to_owned()),
        number: Some(place as i32 + 1),
        r#type: Some(*kind as i32),
        label: Some(Label::Optional as i32),
        ..Default::default()
    };
    DescriptorProto {
        name: Some(name.to_owned()),
        field: fields.iter().enumerate().map(field).collect(),
        ..Default::default()
    }
}

fn definition(name: &str, types: Vec<DescriptorProto>, syntax: &str) -> Schema {
    let file = FileDescriptorProto {
        message_type: types,
        syntax: Some(syntax.to_owned()),
        ..Default::default()
    };
    let set = FileDescriptorSet { file: vec![file] };
    protobuf::read(name, &set.encode_to_vec()).unwrap()
}

fn read(field: &str, message: &[u8]) -> Result<Reading, Damage> {
    read_as(&schema(), field, message)
}

fn read_as(schema: &Arc<Schema>, field: &str, message: &[u8]) -> Result<Reading, Damage> {
    let targets = Targets {
        value: Route::find(schema, &path::parse(field).unwrap()).unwrap(),
        stamp: Stamp::find(schema),
        spacing: None,
    };
    let mut reading = Reading::default();
    Decoder::new(Encoding::Protobuf, schema, targets).read(message, &mut reading)?;
    Ok(reading)
}

fn message() -> Vec<u8> {
    let mut bytes = b"\x0a\x04\x08\x07\x10\x05\x12\x01a\x12\x01b".to_vec();
    // Two packed efforts, a third single one.
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
    // A message in two parts is their union; within it the last value counts.
    let parts = b"\x0a\x02\x08\x07\x0a\x04\x10\x05\x08\x09";
    assert_eq!(read("z", parts).unwrap().stamp_ns(), Some(9_000_000_005));
}

#[test]
fn a_cut_message_is_damage() {
    let bytes = message();
    assert!(read("z", &bytes[..bytes.len() - 1]).is_err());
    assert!(read("z", &bytes[..20]).is_err());
}

#[test]
fn before_proto3_only_a_stated_default_counts() {
    let mut told = message_type("M", &[("told", Type::Double), ("plain", Type::Double)]);
    told.field[0].default_value = Some("2.5".to_owned());
    let schema = Arc::new(definition("M", vec![told], "proto2"));
    assert_eq!(read_as(&schema, "told", b"").unwrap().values, [2.5]);
    assert_eq!(read_as(&schema, "plain", b""), Err(Damage::Absent));
}

#[test]
fn entries_of_a_map_keep_their_order() {
    let mut entry = message_type("VEntry", &[("key", Type::String), ("value", Type::Double)]);
    entry.options = Some(prost_types::MessageOptions {
        map_entry: Some(true),
        ..Default::default()
    });
    let mut root = message_type("M", &[("v", Type::Message)]);
    root.field[0].type_name = Some("VEntry".to_owned());
    root.field[0].label = Some(Label::Repeated as i32);
    root.nested_type.push(entry);
    let schema = Arc::new(definition("M", vec![root], "proto3"));
    let mut message = Vec::new();
    for (key, value) in [(b'z', 1.0_f64), (b'a', 2.0), (b'm', 3.0)] {
        message.extend_from_slice(&[0x0a, 12, 0x0a, 1, key, 0x11]);
        message.extend_from_slice(&value.to_le_bytes());
    }
    let values = |field: &str| read_as(&schema, field, &message).unwrap().values;
    assert_eq!(values("v[:].value"), [1.0, 2.0, 3.0]);
    assert_eq!(values("v[key=m].value"), [3.0]);
}
