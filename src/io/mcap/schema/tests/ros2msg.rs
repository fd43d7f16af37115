use super::*;

fn fields(schema: &Schema, place: usize) -> Vec<(&str, &FieldKind)> {
    let fields = &schema.structs[place].fields;
    fields.iter().map(|f| (f.name.as_str(), &f.kind)).collect()
}

#[test]
fn everything_a_line_may_hold() {
    let text = "# a comment with = and [\n\
        int32 X=123 # constant\n\
        string NAME = \"a # b = c\"\n\
        float64 GAIN=-1.5\n\
        \n\
        float64 plain\n\
        float64 with_default 1.5\n\
        string<=10 short \"=x\"\n\
        string[<=3] words [\"a\", \"b\"]\n\
        uint8[16] fixed\n\
        int16[] list [1, 2] # default\n\
        byte b\n\
        char c 65\n\
        wstring wide";
    let schema = read("p/msg/Everything", text, Generation::Ros2).unwrap();
    let number = |number| FieldKind::Number(number);
    let expected = [
        ("plain", number(Number::F64)),
        ("with_default", number(Number::F64)),
        ("short", FieldKind::Text),
        ("words", FieldKind::list(FieldKind::Text)),
        ("fixed", FieldKind::array(number(Number::U8), 16)),
        ("list", FieldKind::list(number(Number::I16))),
        ("b", number(Number::U8)),
        ("c", number(Number::U8)),
        ("wide", FieldKind::WideText),
    ];
    let expected: Vec<_> = expected.iter().map(|(n, k)| (*n, k)).collect();
    assert_eq!(fields(&schema, 0), expected);
    assert_eq!(schema.root().name, "p/Everything");
}

#[test]
fn types_are_found_by_full_short_and_relative_names() {
    let separator = "=".repeat(80);
    let text = format!(
        "std_msgs/Header header\nInner a\nother/msg/Thing[2] b\nbuiltin_interfaces/Time t\n\
         {separator}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
         {separator}\nMSG: p/Inner\nfloat32 x\n{separator}\nMSG: other/Thing\nint8 y\n"
    );
    let schema = read("p/msg/Outer", &text, Generation::Ros2).unwrap();
    assert_eq!(
        fields(&schema, 0),
        [
            ("header", &FieldKind::Struct(1)),
            ("a", &FieldKind::Struct(2)),
            ("b", &FieldKind::array(FieldKind::Struct(3), 2)),
            ("t", &FieldKind::Struct(4)),
        ]
    );
    assert_eq!(schema.structs[4].fields[1].name, "nanosec");
}

#[test]
fn ros1_has_time_and_signed_bytes_and_a_bare_header() {
    let text = format!(
        "Header header\nbyte b\ntime t\nduration d\n{}\nMSG: std_msgs/Header\nuint32 seq\n\
         time stamp\nstring frame_id",
        "=".repeat(80)
    );
    let schema = read("p/Old", &text, Generation::Ros1).unwrap();
    assert_eq!(schema.root().fields[0].kind, FieldKind::Struct(1));
    assert_eq!(schema.root().fields[1].kind, FieldKind::Number(Number::I8));
    let FieldKind::Struct(duration) = schema.root().fields[3].kind else {
        panic!("a duration is two numbers");
    };
    let seconds = &schema.structs[duration].fields[0].kind;
    assert_eq!(*seconds, FieldKind::Number(Number::I32));
}

#[test]
fn errors_name_the_line() {
    let said = |text: &str| read("p/M", text, Generation::Ros2).unwrap_err().to_string();
    assert_eq!(
        said("float64 x\nNoSuch y"),
        "line 2 of its definition: the type \"NoSuch\" is not defined"
    );
    assert!(said("float64").contains("line 1"));
    assert!(said("float64[x] y").contains("not an array length"));
    assert!(said("p/M again").contains("contains itself"));
    assert!(said(&format!("int8 a\n{}\nfloat64 x", "=".repeat(80))).contains("line 3"));
}
