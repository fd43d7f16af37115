//! Definitions as protobuf's `FileDescriptorSet`.

use std::collections::HashMap;

use prost::Message as _;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorSet};

use super::{Field, Kind, MOST_STRUCTS, Number, Schema, SchemaError, Struct, Wire};

/// Deepest nesting of a message's own types within each other.
const DEEPEST_NESTING: usize = 32;

/// Reads the definition of the type `name` and of everything it is made of.
///
/// # Errors
/// [`SchemaError`] if the bytes are no `FileDescriptorSet` or a type is missing.
pub fn read(name: &str, bytes: &[u8]) -> Result<Schema, SchemaError> {
    let files = FileDescriptorSet::decode(bytes).map_err(|error| {
        SchemaError::new(format_args!("no protobuf FileDescriptorSet: {error}"))
    })?;
    let mut types = Types::default();
    for file in &files.file {
        let package = file.package.as_deref().unwrap_or("");
        // Before proto3 and in editions, a field that is not there has no value.
        let is_implicit = file.syntax.as_deref() == Some("proto3");
        for message in &file.message_type {
            types.add(package, message, is_implicit, 0)?;
        }
    }
    let mut builder = Builder {
        types: &types,
        schema: Schema {
            structs: Vec::new(),
            root: 0,
        },
        built: HashMap::new(),
        todo: Vec::new(),
    };
    let root = types
        .find(name.trim_start_matches('.'), "")
        .ok_or_else(|| SchemaError::new(format_args!("the message \"{name}\" is not defined")))?;
    builder.schema.root = builder.place(root)?;
    while let Some(place) = builder.todo.pop() {
        builder.fields(place)?;
    }
    Ok(builder.schema)
}

struct Found<'a> {
    name: String,
    message: &'a DescriptorProto,
    is_implicit: bool,
}

#[derive(Default)]
struct Types<'a> {
    all: Vec<Found<'a>>,
    by_name: HashMap<String, usize>,
}

impl<'a> Types<'a> {
    fn add(
        &mut self,
        scope: &str,
        message: &'a DescriptorProto,
        is_implicit: bool,
        level: usize,
    ) -> Result<(), SchemaError> {
        if level > DEEPEST_NESTING || self.all.len() >= MOST_STRUCTS {
            return Err(SchemaError::new("too many types, or nested too deeply"));
        }
        let own = message.name.as_deref().unwrap_or("");
        let name = match scope {
            "" => own.to_owned(),
            scope => format!("{scope}.{own}"),
        };
        for inner in &message.nested_type {
            self.add(&name, inner, is_implicit, level + 1)?;
        }
        self.by_name.entry(name.clone()).or_insert(self.all.len());
        self.all.push(Found {
            name,
            message,
            is_implicit,
        });
        Ok(())
    }

    /// A type by its full name, or by a name within a scope and those around it.
    fn find(&self, name: &str, scope: &str) -> Option<usize> {
        if let Some(full) = name.strip_prefix('.') {
            return self.by_name.get(full).copied();
        }
        let mut scope = scope;
        loop {
            let full = match scope {
                "" => name.to_owned(),
                scope => format!("{scope}.{name}"),
            };
            if let Some(place) = self.by_name.get(&full) {
                return Some(*place);
            }
            if scope.is_empty() {
                return None;
            }
            scope = scope.rsplit_once('.').map_or("", |(outer, _)| outer);
        }
    }
}

struct Builder<'a> {
    types: &'a Types<'a>,
    schema: Schema,
    /// Place in the schema of each type that is used.
    built: HashMap<usize, usize>,
    /// Places whose fields are still missing, with the type.
    todo: Vec<(usize, usize)>,
}

impl Builder<'_> {
    fn place(&mut self, found: usize) -> Result<usize, SchemaError> {
        if let Some(place) = self.built.get(&found) {
            return Ok(*place);
        }
        let place = self.schema.structs.len();
        self.schema.structs.push(Struct {
            name: self.types.all[found].name.clone(),
            fields: Vec::new(),
        });
        self.built.insert(found, place);
        self.todo.push((place, found));
        Ok(place)
    }

    fn fields(&mut self, (place, found): (usize, usize)) -> Result<(), SchemaError> {
        let types = self.types;
        let found = &types.all[found];
        let mut fields = Vec::with_capacity(found.message.field.len());
        for field in &found.message.field {
            fields.push(self.field(field, found)?);
        }
        self.schema.structs[place].fields = fields;
        Ok(())
    }

    fn field(&mut self, field: &FieldDescriptorProto, owner: &Found) -> Result<Field, SchemaError> {
        let name = field.name.clone().unwrap_or_default();
        let kind = match field.r#type() {
            Type::Message | Type::Group => {
                let wanted = field.type_name.as_deref().unwrap_or("");
                let inner = self.types.find(wanted, &owner.name).ok_or_else(|| {
                    SchemaError::new(format_args!(
                        "the message \"{wanted}\" of {}.{name} is not defined",
                        owner.name
                    ))
                })?;
                Kind::Struct(self.place(inner)?)
            }
            Type::String | Type::Bytes => Kind::Text,
            other => Kind::Number(number(other)),
        };
        let is_many = field.label() == Label::Repeated;
        let is_implicit = owner.is_implicit
            && !field.proto3_optional.unwrap_or(false)
            && field.oneof_index.is_none();
        let told = || field.default_value.as_deref().and_then(default_value);
        Ok(Field {
            name,
            kind: if is_many { Kind::list(kind) } else { kind },
            unit: None,
            wire: Some(Wire {
                number: field.number.unwrap_or(0).unsigned_abs(),
                zigzag: matches!(field.r#type(), Type::Sint32 | Type::Sint64),
                fixed: matches!(
                    field.r#type(),
                    Type::Fixed32 | Type::Fixed64 | Type::Sfixed32 | Type::Sfixed64
                ),
                absent: if is_implicit { Some(0.0) } else { told() },
            }),
        })
    }
}

fn number(kind: Type) -> Number {
    match kind {
        Type::Double => Number::F64,
        Type::Float => Number::F32,
        Type::Int64 | Type::Sint64 | Type::Sfixed64 => Number::I64,
        Type::Uint64 | Type::Fixed64 => Number::U64,
        Type::Uint32 | Type::Fixed32 => Number::U32,
        Type::Bool => Number::Bool,
        _ => Number::I32,
    }
}

fn default_value(text: &str) -> Option<f64> {
    match text {
        "true" => Some(1.0),
        "false" => Some(0.0),
        text => text.parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    use prost_types::FileDescriptorProto;

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
            assert_eq!(schema.root().fields[0].kind, Kind::Struct(1), "{name}");
            let wire = schema.structs[1].fields[0].wire.unwrap();
            assert!(wire.zigzag && wire.absent == Some(0.0));
            let many = &schema.root().fields[1].kind;
            assert_eq!(*many, Kind::list(Kind::Number(Number::F32)));
        }
    }

    #[test]
    fn a_type_may_contain_itself() {
        let fields = vec![field("again", 1, Type::Message, Some(".p.q.Outer"))];
        let schema = read("p.q.Outer", &set(fields, "proto3")).unwrap();
        assert_eq!(schema.root().fields[0].kind, Kind::Struct(0));
    }

    #[test]
    fn what_is_missing_is_said() {
        let bytes = set(vec![field("a", 2, Type::Message, Some(".No"))], "proto2");
        let said = read("p.q.Outer", &bytes).unwrap_err().to_string();
        assert!(
            said.contains("\".No\" of p.q.Outer.a is not defined"),
            "{said}"
        );
        assert!(read("p.Nope", &bytes).is_err());
        assert!(read("p.q.Outer", b"\xff\xff").is_err());
    }

    #[test]
    fn before_proto3_absence_is_no_zero() {
        let mut told = field("told", 1, Type::Double, None);
        told.default_value = Some("2.5".to_owned());
        let bytes = set(vec![told, field("plain", 2, Type::Double, None)], "proto2");
        let schema = read("p.q.Outer", &bytes).unwrap();
        let absent: Vec<_> = schema
            .root()
            .fields
            .iter()
            .map(|f| f.wire.unwrap().absent)
            .collect();
        assert_eq!(absent, [Some(2.5), None]);
    }
}
