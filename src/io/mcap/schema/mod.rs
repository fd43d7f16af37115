//! Structure of messages, independent of the definition language.

pub mod json;
pub mod leaves;
pub mod protobuf;
pub mod ros2idl;
pub mod ros2msg;
mod token;

use std::fmt;

/// Maximum nesting depth of types.
pub const DEEPEST: usize = 64;
/// Maximum number of types in a definition.
pub const MOST_STRUCTS: usize = 4096;

/// Type of number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum Number {
    Bool,
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

/// Each type of number, in their order, with its ROS name and its size in CDR and ROS 1.
const NUMBERS: [(Number, &str, u8); 11] = [
    (Number::Bool, "bool", 1),
    (Number::I8, "int8", 1),
    (Number::U8, "uint8", 1),
    (Number::I16, "int16", 2),
    (Number::U16, "uint16", 2),
    (Number::I32, "int32", 4),
    (Number::U32, "uint32", 4),
    (Number::I64, "int64", 8),
    (Number::U64, "uint64", 8),
    (Number::F32, "float32", 4),
    (Number::F64, "float64", 8),
];

impl Number {
    /// The type with this ROS name.
    pub fn named(name: &str) -> Option<Self> {
        let found = NUMBERS.iter().find(|(_, known, _)| *known == name)?;
        Some(found.0)
    }

    /// Size in CDR and ROS 1.
    pub fn size(self) -> u8 {
        NUMBERS[self as usize].2
    }

    /// ROS name.
    pub fn name(self) -> &'static str {
        NUMBERS[self as usize].1
    }
}

/// Type of a field.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FieldKind {
    /// A number.
    Number(Number),
    /// Text of bytes, or bytes in protobuf.
    Text,
    /// Text of wide characters.
    WideText,
    /// Another type, by its index in [`Schema::structs`].
    Struct(usize),
    /// Several items of the same type.
    Many(Box<Many>),
    /// Nothing readable, such as JSON's null.
    Nothing,
}

/// Several items of the same type.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Many {
    /// Type of each.
    pub item: FieldKind,
    /// Their number, if fixed.
    pub count: Option<u32>,
}

impl FieldKind {
    /// A list of any length.
    pub fn list(item: Self) -> Self {
        Self::Many(Box::new(Many { item, count: None }))
    }

    /// An array of `count` items.
    pub fn array(item: Self, count: u32) -> Self {
        let count = Some(count);
        Self::Many(Box::new(Many { item, count }))
    }
}

/// A field of a type.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Name.
    pub name: String,
    /// Type.
    pub kind: FieldKind,
    /// Unit, if stated by the definition.
    pub unit: Option<String>,
}

impl Field {
    /// A field without a unit.
    pub fn new(name: impl Into<String>, kind: FieldKind) -> Self {
        Self {
            name: name.into(),
            kind,
            unit: None,
        }
    }
}

/// A type: ordered fields.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Struct {
    /// Full name.
    pub name: String,
    /// Its fields.
    pub fields: Vec<Field>,
}

/// A resolved definition: types refer to each other by index.
#[derive(Debug, Clone, PartialEq)]
pub struct Schema {
    /// All types.
    pub structs: Vec<Struct>,
    /// The type of the messages.
    pub root: usize,
    /// For protobuf, the same type.
    pub(crate) descriptor: Option<prost_reflect::MessageDescriptor>,
}

/// Reason why a definition cannot be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SchemaError {
    /// Line in the definition, from 1, if known.
    pub line: Option<usize>,
    /// The reason.
    pub why: String,
}

impl SchemaError {
    /// An error without a line.
    pub fn new(why: impl fmt::Display) -> Self {
        Self {
            line: None,
            why: why.to_string(),
        }
    }

    /// An error in a line.
    pub fn at(line: usize, why: impl fmt::Display) -> Self {
        Self {
            line: Some(line),
            why: why.to_string(),
        }
    }
}

impl fmt::Display for SchemaError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "line {line} of its definition: {}", self.why),
            None => write!(f, "its definition: {}", self.why),
        }
    }
}

impl Schema {
    /// The type of the messages.
    pub fn root(&self) -> &Struct {
        &self.structs[self.root]
    }

    /// Rejects types that are recursive or nested too deeply.
    ///
    /// # Errors
    /// [`SchemaError`] with the type's name.
    pub fn check_nesting(&self) -> Result<(), SchemaError> {
        let mut depths = vec![None; self.structs.len()];
        self.depth(self.root, &mut depths, 0).map(drop)
    }

    /// Number of levels of types within a type, including itself.
    fn depth(
        &self,
        index: usize,
        depths: &mut [Option<usize>],
        above: usize,
    ) -> Result<usize, SchemaError> {
        if let Some(depth) = depths[index] {
            return Ok(depth);
        }
        if above >= DEEPEST {
            return Err(SchemaError::new(format_args!(
                "{} contains itself or is nested deeper than {DEEPEST} levels",
                self.structs[index].name
            )));
        }
        let mut deepest = 0;
        for field in &self.structs[index].fields {
            let mut kind = &field.kind;
            while let FieldKind::Many(many) = kind {
                kind = &many.item;
            }
            if let FieldKind::Struct(inner) = kind {
                deepest = deepest.max(self.depth(*inner, depths, above + 1)?);
            }
        }
        if above + deepest >= DEEPEST {
            return Err(SchemaError::new(format_args!(
                "{} is nested deeper than {DEEPEST} levels",
                self.structs[index].name
            )));
        }
        depths[index] = Some(deepest + 1);
        Ok(deepest + 1)
    }
}
