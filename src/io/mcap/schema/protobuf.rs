//! Definitions as protobuf `FileDescriptorSet`.

use prost::Message as _;
use prost_reflect::{DescriptorPool, FieldDescriptor, Kind as ProtobufKind, MessageDescriptor};
use prost_types::{DescriptorProto, FileDescriptorSet};

use super::{Field, FieldKind, MOST_STRUCTS, Number, Schema, SchemaError, Struct};

/// Parses the definition of the type `name` and of everything it refers to.
///
/// # Errors
/// [`SchemaError`] if the bytes are not a `FileDescriptorSet` or a type is missing.
pub fn read(name: &str, bytes: &[u8]) -> Result<Schema, SchemaError> {
    let mut set = FileDescriptorSet::decode(bytes).map_err(|error| {
        SchemaError::new(format_args!("not a protobuf FileDescriptorSet: {error}"))
    })?;
    let messages = set.file.iter_mut().flat_map(|file| &mut file.message_type);
    messages.for_each(keep_map_order);
    let pool = DescriptorPool::from_file_descriptor_set(set).map_err(SchemaError::new)?;
    if pool.all_messages().len() > MOST_STRUCTS {
        return Err(SchemaError::new("too many types"));
    }
    let root = pool
        .get_message_by_name(name.trim_start_matches('.'))
        .ok_or_else(|| SchemaError::new(format_args!("the message \"{name}\" is not defined")))?;
    let mut messages = vec![root.clone()];
    let mut structs = Vec::new();
    while let Some(message) = messages.get(structs.len()).cloned() {
        // In the order of the definition; `fields()` is in the order of numbers.
        let names = message.descriptor_proto().field.iter().map(|f| f.name());
        let fields = names.filter_map(|name| message.get_field_by_name(name));
        structs.push(Struct {
            name: message.full_name().to_owned(),
            fields: fields
                .map(|field| Field::new(field.name(), kind(&field, &mut messages)))
                .collect(),
        });
    }
    Ok(Schema {
        structs,
        root: 0,
        descriptor: Some(root),
    })
}

/// Turns maps into lists of entries, which preserve the order of the message.
fn keep_map_order(message: &mut DescriptorProto) {
    if let Some(options) = &mut message.options {
        options.map_entry = None;
    }
    message.nested_type.iter_mut().for_each(keep_map_order);
}

fn kind(field: &FieldDescriptor, messages: &mut Vec<MessageDescriptor>) -> FieldKind {
    let kind = match field.kind() {
        ProtobufKind::Message(inner) => {
            let known = messages.iter().position(|message| *message == inner);
            FieldKind::Struct(known.unwrap_or_else(|| {
                messages.push(inner);
                messages.len() - 1
            }))
        }
        ProtobufKind::String | ProtobufKind::Bytes => FieldKind::Text,
        ProtobufKind::Double => FieldKind::Number(Number::F64),
        ProtobufKind::Float => FieldKind::Number(Number::F32),
        ProtobufKind::Int64 | ProtobufKind::Sint64 | ProtobufKind::Sfixed64 => {
            FieldKind::Number(Number::I64)
        }
        ProtobufKind::Uint64 | ProtobufKind::Fixed64 => FieldKind::Number(Number::U64),
        ProtobufKind::Uint32 | ProtobufKind::Fixed32 => FieldKind::Number(Number::U32),
        ProtobufKind::Bool => FieldKind::Number(Number::Bool),
        ProtobufKind::Int32
        | ProtobufKind::Sint32
        | ProtobufKind::Sfixed32
        | ProtobufKind::Enum(_) => FieldKind::Number(Number::I32),
    };
    if field.is_list() {
        FieldKind::list(kind)
    } else {
        kind
    }
}

#[cfg(test)]
#[path = "tests/protobuf.rs"]
mod tests;
