use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{FieldDescriptorProto, FileDescriptorProto};

use super::*;

fn field(name: &str, number: i32, kind: Type, type_name: Option<&str>) -> FieldDescriptorProto {
    FieldDescriptorProto {
        name: Some(name.to_owned()),
        number: Some(number),
        r#type: Some(kind as i32),
        type_name: type_name.map(str::to_owned),
        label: Some(Label::Optional as i32),
        ..Default::default()
    }
}

fn set(fields: Vec<FieldDescriptorProto>, syntax: &str) -> Vec<u8> {
    let inner = DescriptorProto {
        name: Some("Inner".to_owned()),
        field: vec![field("z", 1, Type::Sint32, None)],
        ..Default::default()
    };
    let message = DescriptorProto {
        name: Some("Outer".to_owned()),
        field: fields,
        nested_type: vec![inner],
        ..Default::default()
    };
    let file = FileDescriptorProto {
        package: Some("p.q".to_owned()),
        message_type: vec![message],
        syntax: Some(syntax.to_owned()),
        ..Default::default()
    };
    FileDescriptorSet { file: vec![file] }.encode_to_vec()
}

#[test]
fn names_are_found_in_full_and_by_scope() {
    for name in [".p.q.Outer.Inner", "Inner", "Outer.Inner", "q.Outer.Inner"] {
        let mut list = field("many", 3, Type::Float, None);
        list.label = Some(Label::Repeated as i32);
        let fields = vec![field("a", 2, Type::Message, Some(name)), list];
        let schema = read("p.q.Outer", &set(fields, "proto3")).unwrap();
        assert_eq!(schema.root().fields[0].kind, FieldKind::Struct(1), "{name}");
        assert_eq!(schema.structs[1].name, "p.q.Outer.Inner", "{name}");
        assert_eq!(
            schema.structs[1].fields[0].kind,
            FieldKind::Number(Number::I32)
        );
        let many = &schema.root().fields[1].kind;
        assert_eq!(*many, FieldKind::list(FieldKind::Number(Number::F32)));
    }
}

#[test]
fn a_type_may_contain_itself() {
    let fields = vec![field("again", 1, Type::Message, Some(".p.q.Outer"))];
    let schema = read("p.q.Outer", &set(fields, "proto3")).unwrap();
    assert_eq!(schema.root().fields[0].kind, FieldKind::Struct(0));
}

#[test]
fn what_is_missing_is_said() {
    let bytes = set(vec![field("a", 2, Type::Message, Some(".No"))], "proto2");
    let said = read("p.q.Outer", &bytes).unwrap_err().to_string();
    assert!(said.contains("No"), "{said}");
    assert!(read("p.Nope", &bytes).is_err());
    assert!(read("p.q.Outer", b"\xff\xff").is_err());
}
