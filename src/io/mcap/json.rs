//! Messages in JSON.

use serde_json::Value;

use super::decode::{Damage, Reading};
use super::tree::{TreeNode, TreeTargets};

/// Extracts the wanted numbers from a message.
pub(crate) fn read(
    targets: &TreeTargets,
    message: &[u8],
    reading: &mut Reading,
) -> Result<(), Damage> {
    let message: Value = serde_json::from_slice(message)
        .map_err(|error| Damage::Malformed(format!("not JSON: {error}")))?;
    targets.read(&message, reading)
}

impl<'a> TreeNode<'a> for &'a Value {
    fn field(self, name: &str) -> Option<Self> {
        self.get(name)
    }

    fn len(self) -> Option<usize> {
        Some(self.as_array()?.len())
    }

    fn item(self, place: usize) -> Option<Self> {
        self.get(place)
    }

    fn number(self) -> Option<f64> {
        match self {
            Value::Bool(value) => Some(f64::from(u8::from(*value))),
            value => value.as_f64(),
        }
    }

    fn whole(self) -> Option<i64> {
        self.as_i64().or_else(|| {
            let value = self.as_f64()?;
            (value.fract() == 0.0 && value.abs() < 9e15).then_some(value as i64)
        })
    }

    fn text(self) -> Option<&'a [u8]> {
        self.as_str().map(str::as_bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::super::decode::Targets;
    use super::super::path;
    use super::super::route::Route;
    use super::super::schema::json;
    use super::super::time::Stamp;
    use super::super::tree::TreeTargets;
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
        super::read(
            &TreeTargets::new(&schema, &targets),
            message.as_bytes(),
            &mut reading,
        )?;
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
