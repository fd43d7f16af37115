use super::*;

const JOINT: &str = r#"
================================================================================
IDL: p/msg/Joint
// generated from rosidl_adapter
#include "builtin_interfaces/msg/Time.idl"
module p {
  module msg {
    module Joint_Constants {
      @verbatim (language="comment", text="a ( b")
      const uint8 COUNT = 3;
      const string WORD = "x;y";
    };
    typedef double double__9[9];
    typedef sequence<double, 4> few;
    enum Mode { OFF, ON };
    @verbatim (language="comment", text="say \"this\"")
    struct Joint {
      builtin_interfaces::msg::Time stamp;
      @unit (value="N m")
      double effort;
      p::msg::double__9 matrix;
      few some;
      sequence<string<10>> names;
      unsigned long long big, more[2];
      long grid[2][Joint_Constants::COUNT];
      Mode mode;
      Nothing nothing;
      boolean ok; octet raw; wstring w;
    };
    struct Nothing { uint8 structure_needs_at_least_one_member; };
  };
};
================================================================================
IDL: builtin_interfaces/msg/Time
module builtin_interfaces { module msg { struct Time { int32 sec; uint32 nanosec; }; }; };
"#;

#[test]
fn a_definition_with_everything() {
    let schema = read("p/msg/Joint", JOINT).unwrap();
    let root = schema.root();
    let number = |number| FieldKind::Number(number);
    let expected = [
        ("stamp", FieldKind::Struct(2)),
        ("effort", number(Number::F64)),
        ("matrix", FieldKind::array(number(Number::F64), 9)),
        ("some", FieldKind::list(number(Number::F64))),
        ("names", FieldKind::list(FieldKind::Text)),
        ("big", number(Number::U64)),
        ("more", FieldKind::array(number(Number::U64), 2)),
        (
            "grid",
            FieldKind::array(FieldKind::array(number(Number::I32), 3), 2),
        ),
        ("mode", number(Number::U32)),
        ("nothing", FieldKind::Struct(1)),
        ("ok", number(Number::Bool)),
        ("raw", number(Number::U8)),
        ("w", FieldKind::WideText),
    ];
    let found: Vec<_> = root
        .fields
        .iter()
        .map(|f| (f.name.as_str(), f.kind.clone()))
        .collect();
    assert_eq!(found, expected);
    assert_eq!(root.fields[1].unit.as_deref(), Some("N m"));
    assert!(schema.structs[1].fields.is_empty());
}

#[test]
fn errors_name_the_line() {
    let said = |text: &str| read("p/msg/M", text).unwrap_err().to_string();
    assert!(said("module p { module msg {\nstruct M { Foo x; }; }; };").contains("line 2"));
    assert!(said("module p {").contains("not closed"));
    assert!(said("union U { };").contains("\"union\" is not supported"));
    assert!(said("struct M { M again; };").contains("contains itself"));
    assert!(said("typedef A B; typedef B A; struct M { A x; };").contains("circular"));
    assert!(said("struct Other { double x; };").contains("not defined"));
    assert!(said("struct M { long double x; };").contains("long double"));
    assert!(said("struct M { double x[0x]; };").contains("not a length"));
    let deep = "sequence<".repeat(100_000);
    assert!(said(&format!("struct M {{ {deep}")).contains("nested too deeply"));
}
