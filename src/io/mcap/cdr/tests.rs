use super::super::path;
use super::super::route::Route;
use super::super::schema::ros2idl;
use super::super::schema::ros2msg::{self, Generation};
use super::super::time::Stamp;
use super::*;

fn schema(text: &str, generation: Generation) -> Arc<Schema> {
    let text = text.replace("---", &"=".repeat(80));
    Arc::new(ros2msg::read("p/msg/M", &text, generation).unwrap())
}

fn decoder(schema: &Arc<Schema>, field: &str, is_ros1: bool) -> CdrDecoder {
    let targets = Targets {
        value: Route::find(schema, &path::parse(field).unwrap()).unwrap(),
        stamp: Stamp::find(schema),
        spacing: None,
    };
    CdrDecoder::new(schema, targets, is_ros1)
}

fn read(schema: &Arc<Schema>, field: &str, message: &[u8]) -> Result<Vec<f64>, Damage> {
    let mut reading = Reading::default();
    decoder(schema, field, false).read(message, &mut reading)?;
    Ok(reading.values)
}

/// A straightforward CDR writer for comparison, one value at a time.
struct Book {
    bytes: Vec<u8>,
    is_big: bool,
    largest: usize,
}

impl Book {
    fn new(kind: u8, largest: usize) -> Self {
        Self {
            bytes: vec![0, kind, 0, 0],
            is_big: kind & 1 == 0,
            largest,
        }
    }

    fn number<const N: usize>(&mut self, little: [u8; N]) -> &mut Self {
        while !(self.bytes.len() - 4).is_multiple_of(N.min(self.largest)) {
            self.bytes.push(0xaa);
        }
        let mut bytes = little;
        if self.is_big {
            bytes.reverse();
        }
        self.bytes.extend_from_slice(&bytes);
        self
    }

    fn text(&mut self, text: &str) -> &mut Self {
        self.number((text.len() as u32 + 1).to_le_bytes());
        self.bytes.extend_from_slice(text.as_bytes());
        self.bytes.push(0);
        self
    }

    fn count(&mut self, count: u32) -> &mut Self {
        self.number(count.to_le_bytes())
    }

    fn float(&mut self, value: f64) -> &mut Self {
        self.number(value.to_le_bytes())
    }
}

const JOINTS: &str = "std_msgs/Header header\nstring[] name\nfloat64[] position\n\
    float64[] velocity\nfloat64[] effort\n---\nMSG: std_msgs/Header\n\
    builtin_interfaces/Time stamp\nstring frame_id";

fn joints(kind: u8, largest: usize, efforts: &[f64]) -> Vec<u8> {
    let mut book = Book::new(kind, largest);
    book.count(7).count(5).text("base");
    book.count(2).text("left").text("motor_joint");
    book.count(0);
    book.count(1).float(-1.0);
    book.count(efforts.len() as u32);
    for effort in efforts {
        book.float(*effort);
    }
    book.bytes
}

#[test]
fn a_joint_state_in_both_byte_orders_and_both_versions() {
    let schema = schema(JOINTS, Generation::Ros2);
    for (kind, largest) in [(0x00, 8), (0x01, 8)] {
        let message = joints(kind, largest, &[0.1, -0.2]);
        assert_eq!(read(&schema, "effort[0]", &message).unwrap(), [0.1]);
        assert_eq!(read(&schema, "effort[-1]", &message).unwrap(), [-0.2]);
        assert_eq!(read(&schema, "effort[:]", &message).unwrap(), [0.1, -0.2]);
        assert_eq!(
            read(&schema, "effort[name=motor_joint]", &message).unwrap(),
            [-0.2]
        );
        assert_eq!(read(&schema, "velocity[0]", &message).unwrap(), [-1.0]);
        let mut reading = Reading::default();
        decoder(&schema, "effort[0]", false)
            .read(&message, &mut reading)
            .unwrap();
        assert_eq!(reading.stamp_ns(), Some(7_000_000_005));
    }
    // Without the sizes before lists of texts, as with some writers of XCDR2.
    for kind in [0x06, 0x07, 0x10, 0x11] {
        let message = joints(kind, 4, &[0.1, -0.2]);
        assert_eq!(
            read(&schema, "effort[1]", &message).unwrap(),
            [-0.2],
            "{kind}"
        );
    }
}

#[test]
fn xcdr2_with_the_size_before_a_list_of_texts() {
    let schema = schema("string[] name\nfloat64[] effort", Generation::Ros2);
    let mut book = Book::new(0x07, 4);
    // The size covers what follows it: a count and two texts with padding.
    book.count(4 + 4 + 2 + 2 + 4 + 3)
        .count(2)
        .text("a")
        .text("bc");
    book.count(1).float(2.5);
    assert_eq!(read(&schema, "effort[0]", &book.bytes).unwrap(), [2.5]);
    assert_eq!(read(&schema, "effort[name=a]", &book.bytes).unwrap(), [2.5]);
}

#[test]
fn padding_follows_the_books() {
    let text = "uint8 a\nfloat64 b\nEmpty e\nint16 c\nPair[2] pairs\nuint8[3] d\nPair[] more\n\
                float32 last\n---\nMSG: p/Empty\n---\nMSG: p/Pair\nuint8 x\nfloat64 y";
    let schema = schema(text, Generation::Ros2);
    let mut book = Book::new(1, 8);
    book.number([1])
        .float(2.0)
        .number([0])
        .number(3_i16.to_le_bytes());
    for pair in 0..2 {
        book.number([pair]).float(f64::from(pair) + 0.5);
    }
    book.number([1]).number([2]).number([3]);
    book.count(3);
    for pair in 0..3 {
        book.number([pair]).float(f64::from(pair) + 0.25);
    }
    book.number(1.5_f32.to_le_bytes());
    for (field, value) in [
        ("b", 2.0),
        ("c", 3.0),
        ("pairs[1].y", 1.5),
        ("d[2]", 3.0),
        ("more[2].y", 2.25),
        ("more[-3].x", 0.0),
        ("last", 1.5),
    ] {
        assert_eq!(
            read(&schema, field, &book.bytes).unwrap(),
            [value],
            "{field}"
        );
    }
    assert_eq!(
        read(&schema, "more[:].y", &book.bytes).unwrap(),
        [0.25, 1.25, 2.25]
    );
}

#[test]
fn an_empty_list_of_doubles_is_its_count_alone() {
    let schema = schema("float64[] list\nuint8 last", Generation::Ros2);
    assert_eq!(
        read(&schema, "last", &[0, 1, 0, 0, 0, 0, 0, 0, 9]).unwrap(),
        [9.0]
    );
}

#[test]
fn wide_text_of_either_width() {
    let schema = schema("wstring w\nfloat64 x", Generation::Ros2);
    for width in [2, 4] {
        let mut book = Book::new(1, 8);
        book.count(3);
        book.bytes.resize(book.bytes.len() + 3 * width, 65);
        book.float(1.25);
        assert_eq!(read(&schema, "x", &book.bytes).unwrap(), [1.25], "{width}");
    }
}

#[test]
fn every_kind_of_number() {
    let text = "bool a\nbyte b\nchar c\nint8 d\nuint8 e\nint16 f\nuint16 g\nint32 h\nuint32 i\n\
                int64 j\nuint64 k\nfloat32 l\nfloat64 m";
    let schema = schema(text, Generation::Ros2);
    for kind in [0, 1] {
        let mut book = Book::new(kind, 8);
        book.number([1])
            .number([200])
            .number([201])
            .number([0xff])
            .number([255]);
        book.number((-2_i16).to_le_bytes())
            .number(65_535_u16.to_le_bytes());
        book.number((-3_i32).to_le_bytes())
            .number(u32::MAX.to_le_bytes());
        book.number((-4_i64).to_le_bytes())
            .number(u64::MAX.to_le_bytes());
        book.number(0.5_f32.to_le_bytes()).float(0.1);
        let expected = [
            1.0,
            200.0,
            201.0,
            -1.0,
            255.0,
            -2.0,
            65_535.0,
            -3.0,
            4_294_967_295.0,
            -4.0,
            18_446_744_073_709_551_615.0,
            0.5,
            0.1,
        ];
        for (field, value) in "abcdefghijklm".chars().zip(expected) {
            let found = read(&schema, &field.to_string(), &book.bytes).unwrap();
            assert_eq!(found, [value], "{field}");
        }
    }
}

#[test]
fn ros1_has_no_padding_and_no_encapsulation() {
    let text = "Header header\nuint8 a\nfloat64[] b\ntime t\n---\nMSG: std_msgs/Header\nuint32 seq\n\
                time stamp\nstring frame_id";
    let schema = schema(text, Generation::Ros1);
    let mut message = Vec::new();
    for word in [1_u32, 7, 5, 2] {
        message.extend_from_slice(&word.to_le_bytes());
    }
    message.extend_from_slice(b"hi\x03\x01\0\0\0");
    message.extend_from_slice(&0.1_f64.to_le_bytes());
    let mut reading = Reading::default();
    let mut decoder = decoder(&schema, "b[0]", true);
    decoder.read(&message, &mut reading).unwrap();
    assert_eq!(
        (reading.values.as_slice(), reading.stamp_ns()),
        (&[0.1][..], Some(7_000_000_005))
    );
}

#[test]
fn lists_of_lists_and_tables() {
    let text = "struct M { sequence<sequence<double>> rows; long grid[2][3]; };";
    let schema = Arc::new(ros2idl::read("p/msg/M", text).unwrap());
    let mut book = Book::new(1, 8);
    book.count(2)
        .count(1)
        .float(1.0)
        .count(2)
        .float(2.0)
        .float(3.0);
    for value in 0..6_i32 {
        book.number(value.to_le_bytes());
    }
    assert_eq!(read(&schema, "rows[1][1]", &book.bytes).unwrap(), [3.0]);
    assert_eq!(read(&schema, "rows[-2][0]", &book.bytes).unwrap(), [1.0]);
    assert_eq!(read(&schema, "grid[1][2]", &book.bytes).unwrap(), [5.0]);
    assert_eq!(
        read(&schema, "grid[1][:]", &book.bytes).unwrap(),
        [3.0, 4.0, 5.0]
    );
}

#[test]
fn damage_is_an_error() {
    let schema = schema(JOINTS, Generation::Ros2);
    let message = joints(1, 8, &[0.1]);
    for end in 0..message.len() {
        assert!(
            read(&schema, "effort[0]", &message[..end]).is_err(),
            "{end}"
        );
    }
    let huge = schema_of_list();
    let said = read(&huge, "list[:]", &[0, 1, 0, 0, 255, 255, 255, 255]);
    assert_eq!(said, Err(Damage::Short));
    let said = read(&schema, "effort[1]", &message);
    assert_eq!(said, Err(Damage::NoItem { index: 1, count: 1 }));
    let said = read(&schema, "effort[name=nobody]", &message);
    assert_eq!(
        said,
        Err(Damage::NoName {
            name: "nobody".to_owned(),
            there: vec!["left".to_owned(), "motor_joint".to_owned()]
        })
    );
    assert_eq!(
        read(&schema, "effort[0]", &[0, 3, 0, 0]),
        Err(Damage::Encapsulation(3))
    );
}

fn schema_of_list() -> Arc<Schema> {
    schema("float64[] list", Generation::Ros2)
}
