//! Structure of JSON messages, derived from a message.

use serde_json::Value;

use super::{DEEPEST, Field, FieldKind, Number, Schema, SchemaError, Struct};

/// Derives the fields of messages from one of them. Numbers count as `float64`.
///
/// # Errors
/// [`SchemaError`] if the message is not an object.
pub fn read(message: &Value) -> Result<Schema, SchemaError> {
    let mut schema = Schema {
        structs: Vec::new(),
        root: 0,
        descriptor: None,
    };
    match kind(&mut schema, message, "message", 0) {
        FieldKind::Struct(root) => {
            schema.root = root;
            Ok(schema)
        }
        _ => Err(SchemaError::new("a JSON message must be an object")),
    }
}

fn kind(schema: &mut Schema, value: &Value, name: &str, level: usize) -> FieldKind {
    if level >= DEEPEST {
        return FieldKind::Nothing;
    }
    match value {
        Value::Null => FieldKind::Nothing,
        Value::Bool(_) => FieldKind::Number(Number::Bool),
        Value::Number(_) => FieldKind::Number(Number::F64),
        Value::String(_) => FieldKind::Text,
        Value::Array(items) => FieldKind::list(items.first().map_or(FieldKind::Nothing, |first| {
            kind(schema, first, name, level + 1)
        })),
        Value::Object(pairs) => {
            let fields = pairs
                .iter()
                .map(|(key, value)| Field::new(key, kind(schema, value, key, level + 1)))
                .collect();
            schema.structs.push(Struct {
                name: name.to_owned(),
                fields,
            });
            FieldKind::Struct(schema.structs.len() - 1)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::leaves::leaves;
    use super::*;

    #[test]
    fn fields_follow_from_a_message() {
        let text = r#"{"t": {"sec": 1, "nsec": 2}, "v": [1.5], "p": [{"x": true}], "n": null}"#;
        let schema = read(&serde_json::from_str(text).unwrap()).unwrap();
        let (found, _) = leaves(&schema);
        let mut paths: Vec<_> = found
            .iter()
            .map(|l| (l.path.as_str(), l.number.name()))
            .collect();
        paths.sort_unstable();
        assert_eq!(
            paths,
            [
                ("p[].x", "bool"),
                ("t.nsec", "float64"),
                ("t.sec", "float64"),
                ("v[]", "float64")
            ]
        );
        assert!(read(&Value::Bool(true)).is_err());
    }
}
