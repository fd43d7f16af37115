//! Protobuf messages, decoded by `prost-reflect`.

use std::borrow::Cow;

use prost_reflect::{DynamicMessage, FieldDescriptor, MessageDescriptor, ReflectMessage, Value};

use super::decode::{Damage, Reading};
use super::tree::{TreeNode, TreeTargets};

/// Extracts the wanted numbers from a message.
pub(crate) fn read(
    descriptor: &MessageDescriptor,
    targets: &TreeTargets,
    message: &[u8],
    reading: &mut Reading,
) -> Result<(), Damage> {
    let message = DynamicMessage::decode(descriptor.clone(), message)
        .map_err(|error| Damage::Malformed(error.to_string()))?;
    targets.read(ProtobufNode::Set(&Value::Message(message)), reading)
}

/// A value of a message.
#[derive(Clone, Copy)]
enum ProtobufNode<'a> {
    Set(&'a Value),
    /// Default of a number that is not in the message, from the definition.
    Default(f64),
    EmptyList,
}

impl<'a> TreeNode<'a> for ProtobufNode<'a> {
    fn field(self, name: &str) -> Option<Self> {
        let Self::Set(Value::Message(message)) = self else {
            return None;
        };
        let field = message.descriptor().get_field_by_name(name)?;
        match message.get_field(&field) {
            Cow::Borrowed(value) => Some(Self::Set(value)),
            Cow::Owned(_) if field.is_list() => Some(Self::EmptyList),
            Cow::Owned(default) => {
                let number = has_default(&field).then(|| number(&default));
                number.flatten().map(Self::Default)
            }
        }
    }

    fn len(self) -> Option<usize> {
        match self {
            Self::Set(value) => Some(value.as_list()?.len()),
            Self::EmptyList => Some(0),
            Self::Default(_) => None,
        }
    }

    fn item(self, place: usize) -> Option<Self> {
        match self {
            Self::Set(value) => value.as_list()?.get(place).map(Self::Set),
            _ => None,
        }
    }

    fn number(self) -> Option<f64> {
        match self {
            Self::Set(value) => number(value),
            Self::Default(number) => Some(number),
            Self::EmptyList => None,
        }
    }

    fn whole(self) -> Option<i64> {
        match self {
            Self::Set(Value::I64(value)) => Some(*value),
            Self::Set(Value::U64(value)) => Some(i64::try_from(*value).unwrap_or(i64::MAX)),
            other => other.number().map(|value| value as i64),
        }
    }

    fn text(self) -> Option<&'a [u8]> {
        match self {
            Self::Set(Value::String(text)) => Some(text.as_bytes()),
            Self::Set(Value::Bytes(bytes)) => Some(bytes),
            _ => None,
        }
    }
}

/// Whether an absent field has a value: always in proto3 except for `optional` fields, in proto2 if
/// the definition gives a default.
fn has_default(field: &FieldDescriptor) -> bool {
    !field.supports_presence() || field.field_descriptor_proto().default_value.is_some()
}

fn number(value: &Value) -> Option<f64> {
    Some(match value {
        Value::Bool(value) => f64::from(u8::from(*value)),
        Value::I32(value) | Value::EnumNumber(value) => f64::from(*value),
        Value::U32(value) => f64::from(*value),
        Value::I64(value) => *value as f64,
        Value::U64(value) => *value as f64,
        Value::F32(value) => f64::from(*value),
        Value::F64(value) => *value,
        _ => return None,
    })
}

#[cfg(test)]
#[path = "protobuf_tests.rs"]
mod tests;
