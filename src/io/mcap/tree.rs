//! Numbers in messages that are parsed as trees of values: JSON and protobuf.

use super::decode::{Damage, NameSearch, Reading, Targets};
use super::route::Hop;
use super::schema::{FieldKind, Schema};

/// A value in a message.
pub(crate) trait TreeNode<'a>: Copy {
    /// A field, unless it is not set.
    fn field(self, name: &str) -> Option<Self>;
    /// Number of items; `None` if this is not a list.
    fn len(self) -> Option<usize>;
    /// An item of a list.
    fn item(self, place: usize) -> Option<Self>;
    fn number(self) -> Option<f64>;
    fn whole(self) -> Option<i64>;
    fn text(self) -> Option<&'a [u8]>;
}

/// Paths to the wanted numbers, with fields by name.
pub struct TreeTargets {
    value: Vec<TreeStep>,
    lookup: Option<(Vec<TreeStep>, String)>,
    /// Seconds and nanoseconds.
    stamp: Option<[Vec<TreeStep>; 2]>,
    spacing: Option<Vec<TreeStep>>,
}

enum TreeStep {
    Field(String),
    Item(i64),
    Called,
    All,
}

impl TreeTargets {
    pub(crate) fn new(schema: &Schema, targets: &Targets) -> Self {
        let path = |hops: &[Hop]| steps(schema, hops);
        let (lookup, stamp) = (&targets.value.lookup, &targets.stamp);
        Self {
            value: path(&targets.value.hops),
            lookup: lookup
                .as_ref()
                .map(|lookup| (path(&lookup.hops), lookup.name.clone())),
            stamp: stamp
                .as_ref()
                .map(|stamp| [path(&stamp.seconds), path(&stamp.nanoseconds)]),
            spacing: targets.spacing.as_ref().map(|spacing| path(spacing)),
        }
    }

    /// Extracts the wanted numbers from a message.
    pub(crate) fn read<'a>(
        &self,
        message: impl TreeNode<'a>,
        reading: &mut Reading,
    ) -> Result<(), Damage> {
        let mut called = None;
        if let Some((steps, name)) = &self.lookup {
            let names = NameSearch::search(name.as_bytes(), |mut names| {
                collect_names(message, steps, &mut names);
                Ok(names)
            })?;
            called = names.found;
            reading.place = called;
        }
        collect(message, &self.value, called, &mut reading.values)?;
        if let Some([seconds, nanoseconds]) = &self.stamp {
            reading.seconds = at(message, seconds).and_then(TreeNode::whole);
            reading.nanoseconds = at(message, nanoseconds).and_then(TreeNode::whole);
        }
        if let Some(spacing) = &self.spacing {
            reading.spacing = at(message, spacing).and_then(TreeNode::number);
        }
        Ok(())
    }
}

fn steps(schema: &Schema, hops: &[Hop]) -> Vec<TreeStep> {
    let mut kind = &FieldKind::Struct(schema.root);
    let mut steps = Vec::with_capacity(hops.len());
    for hop in hops {
        match (hop, kind) {
            (Hop::Field(place), FieldKind::Struct(index)) => {
                let field = &schema.structs[*index].fields[*place];
                steps.push(TreeStep::Field(field.name.clone()));
                kind = &field.kind;
                continue;
            }
            (Hop::Item(index), _) => steps.push(TreeStep::Item(*index)),
            (Hop::Called, _) => steps.push(TreeStep::Called),
            (Hop::All | Hop::Field(_), _) => steps.push(TreeStep::All),
        }
        if let FieldKind::Many(many) = kind {
            kind = &many.item;
        }
    }
    steps
}

fn collect<'a>(
    node: impl TreeNode<'a>,
    steps: &[TreeStep],
    called: Option<usize>,
    values: &mut Vec<f64>,
) -> Result<(), Damage> {
    let Some((step, rest)) = steps.split_first() else {
        values.push(node.number().ok_or(Damage::Absent)?);
        return Ok(());
    };
    if let TreeStep::Field(name) = step {
        let inner = node.field(name).ok_or(Damage::Absent)?;
        return collect(inner, rest, called, values);
    }
    let count = node.len().ok_or(Damage::Absent)?;
    let places = match step {
        TreeStep::Item(index) => {
            let place = item_place(*index, count)?;
            place..place + 1
        }
        TreeStep::Called => {
            let place = called.and_then(|place| i64::try_from(place).ok());
            let place = item_place(place.unwrap_or(i64::MAX), count)?;
            place..place + 1
        }
        TreeStep::All | TreeStep::Field(_) => 0..count,
    };
    for place in places {
        let item = node.item(place).ok_or(Damage::Absent)?;
        collect(item, rest, called, values)?;
    }
    Ok(())
}

/// Index of an item counted from the start or, if negative, from the end.
pub(crate) fn item_place(index: i64, count: usize) -> Result<usize, Damage> {
    let from_front = if index < 0 {
        index.saturating_add(count as i64)
    } else {
        index
    };
    let place = usize::try_from(from_front).ok();
    place.filter(|place| *place < count).ok_or(Damage::NoItem {
        index,
        count: count as u64,
    })
}

/// Compares each text at the end of a path. An item without a name counts as well.
fn collect_names<'a>(node: impl TreeNode<'a>, steps: &[TreeStep], names: &mut NameSearch) {
    match steps.split_first() {
        None => match node.text() {
            Some(text) => names.compare(text),
            None => names.seen += 1,
        },
        Some((TreeStep::Field(field), rest)) => match node.field(field) {
            Some(inner) => collect_names(inner, rest, names),
            None => names.seen += 1,
        },
        Some((_, rest)) => {
            let items = (0..node.len().unwrap_or(0)).filter_map(|place| node.item(place));
            items.for_each(|item| collect_names(item, rest, names));
        }
    }
}

fn at<'a, N: TreeNode<'a>>(node: N, steps: &[TreeStep]) -> Option<N> {
    steps.iter().try_fold(node, |node, step| match step {
        TreeStep::Field(name) => node.field(name),
        _ => None,
    })
}
