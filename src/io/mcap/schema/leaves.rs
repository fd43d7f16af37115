//! The numbers in a message: what a user can choose from.

use super::{DEEPEST, Field, FieldKind, Number, Schema};

/// Most leaves that are listed.
pub const MOST: usize = 1000;

/// A number, or a list of numbers, in a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Leaf {
    /// Path as a user writes it, lists with `[]`, arrays with `[3]`.
    pub path: String,
    /// Kind of number.
    pub number: Number,
    /// Unit as the definition states it.
    pub unit: Option<String>,
    /// Whether it is part of a time stamp.
    pub is_stamp: bool,
    /// Whether there are several of it in a message.
    pub is_many: bool,
}

impl Leaf {
    /// The path to its first item.
    pub fn first_item(&self) -> String {
        self.with_items("[0]")
    }

    /// The path with a choice of items in place of each list's length.
    pub fn with_items(&self, item: &str) -> String {
        let mut pieces = self.path.split('[');
        let mut path = pieces.next().unwrap_or("").to_owned();
        for piece in pieces {
            let behind = piece.split_once(']').map_or("", |(_, behind)| behind);
            path.push_str(item);
            path.push_str(behind);
        }
        path
    }
}

/// The numbers in a message, in order, and whether there are more than [`MOST`].
pub fn leaves(schema: &Schema) -> (Vec<Leaf>, bool) {
    let mut walk = LeafWalk {
        schema,
        above: Vec::new(),
        found: Vec::new(),
        visits: 0,
    };
    let is_whole = walk.types(schema.root, "");
    (walk.found, !is_whole)
}

/// Whether a type is a time stamp: two whole numbers, of seconds and of nanoseconds.
pub fn is_stamp(schema: &Schema, index: usize) -> bool {
    let fields = &schema.structs[index].fields;
    let [seconds, nanoseconds] = &fields[..] else {
        return false;
    };
    is_seconds(&seconds.name)
        && is_nanoseconds(&nanoseconds.name)
        && [seconds, nanoseconds]
            .iter()
            .all(|field| matches!(field.kind, FieldKind::Number(_)))
}

/// Names of a stamp's seconds.
pub fn is_seconds(name: &str) -> bool {
    ["sec", "secs", "seconds"].contains(&name)
}

/// Names of a stamp's nanoseconds.
pub fn is_nanoseconds(name: &str) -> bool {
    ["nanosec", "nsec", "nsecs", "nanos", "nanoseconds"].contains(&name)
}

struct LeafWalk<'a> {
    schema: &'a Schema,
    above: Vec<usize>,
    found: Vec<Leaf>,
    visits: usize,
}

impl LeafWalk<'_> {
    /// False if there were too many.
    fn types(&mut self, index: usize, prefix: &str) -> bool {
        // A type of protobuf may contain itself: its inside is listed once.
        if self.above.contains(&index) || self.above.len() > DEEPEST {
            return true;
        }
        self.visits += 1;
        if self.visits > 10 * MOST {
            return false;
        }
        self.above.push(index);
        let in_stamp = is_stamp(self.schema, index);
        for field in &self.schema.structs[index].fields {
            let path = format!("{prefix}{}", field.name);
            if !self.field(field, path, in_stamp) {
                return false;
            }
        }
        self.above.pop();
        true
    }

    fn field(&mut self, field: &Field, mut path: String, is_stamp: bool) -> bool {
        let mut kind = &field.kind;
        while let FieldKind::Many(many) = kind {
            match many.count {
                Some(count) => path.push_str(&format!("[{count}]")),
                None => path.push_str("[]"),
            }
            kind = &many.item;
        }
        match kind {
            FieldKind::Number(_) if self.found.len() >= MOST => return false,
            FieldKind::Number(number) => self.found.push(Leaf {
                is_many: path.contains('['),
                path,
                number: *number,
                unit: field.unit.clone(),
                is_stamp,
            }),
            FieldKind::Struct(inner) => return self.types(*inner, &(path + ".")),
            _ => {}
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::super::ros2msg::{Generation, read};
    use super::*;

    #[test]
    fn leaves_have_paths_as_users_write_them() {
        let text = format!(
            "Header header\nfloat64[] effort\nfloat32[3] fixed\nPoint[] points\nstring s\n{0}\n\
             MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n{0}\n\
             MSG: p/Point\nint16 x",
            "=".repeat(80)
        );
        let schema = read("p/msg/M", &text, Generation::Ros2).unwrap();
        let (found, more) = leaves(&schema);
        assert!(!more);
        let paths: Vec<_> = found
            .iter()
            .map(|l| (l.path.as_str(), l.is_stamp))
            .collect();
        assert_eq!(
            paths,
            [
                ("header.stamp.sec", true),
                ("header.stamp.nanosec", true),
                ("effort[]", false),
                ("fixed[3]", false),
                ("points[].x", false)
            ]
        );
    }

    #[test]
    fn definitions_that_explode_are_cut_short() {
        let mut text = String::from("T1 a\nT1 b\n");
        for level in 1..40 {
            text.push_str(&"=".repeat(80));
            text.push_str(&format!("\nMSG: p/T{level}\nT{0} a\nT{0} b\n", level + 1));
        }
        text.push_str(&"=".repeat(80));
        text.push_str("\nMSG: p/T40\nint8 x\n");
        let schema = read("p/M", &text, Generation::Ros2).unwrap();
        let (found, more) = leaves(&schema);
        assert_eq!((found.len(), more), (MOST, true));
    }
}
