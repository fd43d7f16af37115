//! Messages in JSON.

use serde_json::Value;

use super::decode::{Damage, Names, Reading, Targets};
use super::route::Hop;
use super::schema::{Kind, Schema};

/// Takes wanted numbers out of messages.
pub struct Decoder {
    value: Vec<Step>,
    lookup: Option<(Vec<Step>, String)>,
    stamp: Option<(Vec<Step>, Vec<Step>)>,
    spacing: Option<Vec<Step>>,
}

/// A step into a message, with the field's name instead of its place.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Step {
    Field(String),
    Item(i64),
    Called,
    All,
}

impl Decoder {
    /// Prepares for messages like the one that the schema was told from.
    #[must_use]
    pub fn new(schema: &Schema, targets: &Targets) -> Self {
        let way = |hops: &[Hop]| steps(schema, hops);
        Self {
            value: way(&targets.value.hops),
            lookup: targets
                .value
                .lookup
                .as_ref()
                .map(|lookup| (way(&lookup.hops), lookup.name.clone())),
            stamp: targets
                .stamp
                .as_ref()
                .map(|stamp| (way(&stamp.seconds), way(&stamp.nanoseconds))),
            spacing: targets.spacing.as_ref().map(|spacing| way(spacing)),
        }
    }

    /// Reads a message.
    ///
    /// # Errors
    /// [`Damage`] if the message does not hold the value.
    pub fn read(&mut self, message: &[u8], reading: &mut Reading) -> Result<(), Damage> {
        let message: Value = serde_json::from_slice(message)
            .map_err(|error| Damage::Malformed(format!("no JSON: {error}")))?;
        let mut place = None;
        if let Some((steps, name)) = &self.lookup {
            let names = Names::search(name.as_bytes(), |mut names| {
                find(&message, steps, &mut names);
                Ok(names)
            })?;
            place = names.found;
        }
        collect(&message, &self.value, place, &mut reading.values)?;
        if let Some((seconds, nanoseconds)) = &self.stamp {
            reading.seconds = at(&message, seconds).and_then(whole);
            reading.nanoseconds = at(&message, nanoseconds).and_then(whole);
        }
        if let Some(spacing) = &self.spacing {
            reading.spacing = at(&message, spacing).and_then(number);
        }
        Ok(())
    }
}

fn steps(schema: &Schema, hops: &[Hop]) -> Vec<Step> {
    let mut kind = &Kind::Struct(schema.root);
    let mut steps = Vec::with_capacity(hops.len());
    for hop in hops {
        match (hop, kind) {
            (Hop::Field(place), Kind::Struct(index)) => {
                let field = &schema.structs[*index].fields[*place];
                steps.push(Step::Field(field.name.clone()));
                kind = &field.kind;
                continue;
            }
            (Hop::Item(index), _) => steps.push(Step::Item(*index)),
            (Hop::Called, _) => steps.push(Step::Called),
            (Hop::All | Hop::Field(_), _) => steps.push(Step::All),
        }
        if let Kind::Many(many) = kind {
            kind = &many.item;
        }
    }
    steps
}

fn collect(
    value: &Value,
    steps: &[Step],
    found: Option<usize>,
    values: &mut Vec<f64>,
) -> Result<(), Damage> {
    let Some((step, rest)) = steps.split_first() else {
        values.push(number(value).ok_or(Damage::Absent)?);
        return Ok(());
    };
    let index = match step {
        Step::Field(name) => {
            let inner = value.get(name).ok_or(Damage::Absent)?;
            return collect(inner, rest, found, values);
        }
        Step::All => {
            let items = value.as_array().ok_or(Damage::Absent)?;
            return items
                .iter()
                .try_for_each(|item| collect(item, rest, found, values));
        }
        Step::Item(index) => *index,
        Step::Called => found
            .and_then(|place| i64::try_from(place).ok())
            .unwrap_or(i64::MAX),
    };
    let items = value.as_array().ok_or(Damage::Absent)?;
    let count = items.len();
    let from_front = if index < 0 {
        index.saturating_add(count as i64)
    } else {
        index
    };
    let item = usize::try_from(from_front)
        .ok()
        .and_then(|place| items.get(place));
    let item = item.ok_or(Damage::NoItem {
        index,
        count: count as u64,
    })?;
    collect(item, rest, found, values)
}

/// Looks for a text among those at the end of a way.
fn find(value: &Value, steps: &[Step], names: &mut Names) {
    // An item without a name is an item all the same.
    match steps.split_first() {
        None => match value.as_str() {
            Some(text) => names.compare(text.as_bytes()),
            None => names.seen += 1,
        },
        Some((Step::Field(field), rest)) => match value.get(field) {
            Some(inner) => find(inner, rest, names),
            None => names.seen += 1,
        },
        Some((_, rest)) => {
            for item in value.as_array().into_iter().flatten() {
                find(item, rest, names);
            }
        }
    }
}

fn at<'a>(value: &'a Value, steps: &[Step]) -> Option<&'a Value> {
    steps.iter().try_fold(value, |value, step| match step {
        Step::Field(name) => value.get(name),
        _ => None,
    })
}

fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Bool(value) => Some(f64::from(u8::from(*value))),
        value => value.as_f64(),
    }
}

fn whole(value: &Value) -> Option<i64> {
    value.as_i64().or_else(|| {
        let value = value.as_f64()?;
        (value.fract() == 0.0 && value.abs() < 9e15).then_some(value as i64)
    })
}

#[cfg(test)]
mod tests {
    use super::super::path;
    use super::super::route::Route;
    use super::super::schema::json;
    use super::super::time::Stamp;
    use super::*;

    const MESSAGE: &str = r#"{"timestamp": {"nsec": 5, "sec": 7}, "name": ["a", "b"],
        "effort": [0.1, 2.5e-3], "joints": [{"torque": 1}, {"id": "b", "torque": -4}],
        "on": true, "n": null}"#;

    fn read(field: &str, message: &str) -> Result<Reading, Damage> {
        let schema = json::read(&serde_json::from_str(MESSAGE).unwrap()).unwrap();
        let targets = Targets {
            value: Route::find(&schema, &path::parse(field).unwrap()).unwrap(),
            stamp: Stamp::find(&schema),
            spacing: None,
        };
        let mut reading = Reading::default();
        Decoder::new(&schema, &targets).read(message.as_bytes(), &mut reading)?;
        Ok(reading)
    }

    #[test]
    fn items_by_place_and_by_name() {
        let value = |field: &str| read(field, MESSAGE).unwrap().values;
        assert_eq!(value("effort[-1]"), [2.5e-3]);
        assert_eq!(value("effort[name=a]"), [0.1]);
        assert_eq!(value("effort[:]"), [0.1, 2.5e-3]);
        assert_eq!(value("joints[:].torque"), [1.0, -4.0]);
        assert_eq!(value("on"), [1.0]);
        assert_eq!(read("on", MESSAGE).unwrap().stamp_ns(), Some(7_000_000_005));
    }

    #[test]
    fn what_is_missing_is_said() {
        assert_eq!(read("on", "{}"), Err(Damage::Absent));
        assert_eq!(
            read("effort[0]", r#"{"effort": [null]}"#),
            Err(Damage::Absent)
        );
        let said = read("effort[name=a]", r#"{"name": [], "effort": []}"#);
        let text = said.unwrap_err().to_string();
        assert_eq!(text, "no item is called \"a\"; none has a name");
        let said = read(
            "effort[name=motr]",
            r#"{"name": ["motor", "load"], "effort": [1, 2]}"#,
        );
        assert_eq!(
            said.unwrap_err().to_string(),
            "no item is called \"motr\" (did you mean \"motor\"?); there are: motor, load"
        );
        assert!(matches!(read("on", "{"), Err(Damage::Malformed(_))));
    }
}
