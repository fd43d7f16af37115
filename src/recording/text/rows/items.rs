//! List items identified by names in the row, as in exports of ROS messages: `effort[0]` belongs to
//! `name[0]`.

/// A column that contains one item of a list, and its possible other locations.
#[derive(Debug, Clone, PartialEq)]
pub struct Item {
    /// The column.
    pub column: usize,
    /// Name of the item in the first row.
    name: String,
    /// Columns of the names, and those of the corresponding values.
    places: Vec<(usize, usize)>,
}

impl Item {
    /// The column with the item's value in a row, according to the names in the row.
    pub(super) fn place_in(&self, cells: &[String]) -> Option<usize> {
        let is_named = |(name, _): &&(usize, usize)| {
            cells
                .get(*name)
                .is_some_and(|cell| cell.trim() == self.name)
        };
        // A name may be missing if there is none to follow.
        if self.name.is_empty() {
            return Some(self.column);
        }
        self.places.iter().find(is_named).map(|(_, value)| *value)
    }
}

/// Items of a table: all columns `list[i]` with a column `name[i]` of the same message.
pub fn items(headings: &[&str], first_row: &[String]) -> Vec<Item> {
    let parts: Vec<Option<(&str, &str)>> =
        headings.iter().map(|heading| list_item(heading)).collect();
    let sibling = |list: &str, names: bool, index: &str| {
        let place = |part: &Option<(&str, &str)>| {
            part.is_some_and(|(other, i)| {
                i == index
                    && if names {
                        is_names_of(other, list)
                    } else {
                        other == list
                    }
            })
        };
        parts.iter().position(place)
    };
    let of = |(column, part): (usize, &Option<(&str, &str)>)| {
        let (list, index) = (*part)?;
        let own = sibling(list, true, index).filter(|own| *own != column)?;
        let indices = parts.iter().flatten().filter(|(other, _)| *other == list);
        let places =
            indices.filter_map(|(_, i)| Some((sibling(list, true, i)?, sibling(list, false, i)?)));
        Some(Item {
            column,
            name: first_row.get(own)?.trim().to_owned(),
            places: places.collect(),
        })
    };
    parts.iter().enumerate().filter_map(of).collect()
}

/// A list and its index: `effort` and `0` for `effort[0]`, `effort.0` and `effort_0`.
fn list_item(heading: &str) -> Option<(&str, &str)> {
    let heading = heading.trim();
    let (list, index) = match heading.strip_suffix(']') {
        Some(open) => open.rsplit_once('[')?,
        None => heading.rsplit_once(['.', '_', '/'])?,
    };
    let is_number = !index.is_empty() && index.bytes().all(|byte| byte.is_ascii_digit());
    (is_number && !list.is_empty()).then_some((list, index))
}

/// Whether a list contains the names of another one of the same message.
fn is_names_of(names: &str, list: &str) -> bool {
    let split = |path: &'_ str| path.rfind(['.', '/']).map_or(0, |mark| mark + 1);
    let (message, last) = names.split_at(split(names));
    let is_same = message == &list[..split(list)];
    is_same && matches!(last, "name" | "names" | "joint_names") && names != list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_item_is_found_by_its_name() {
        let headings = [
            "t",
            "js.name[0]",
            "js.name[1]",
            "js.effort[0]",
            "js.effort[1]",
            "ch_1",
        ];
        let cells = |names: [&str; 2]| ["0", names[0], names[1], "1", "2", "3"].map(str::to_owned);
        let found = items(&headings, &cells(["a", "b"]));
        let columns: Vec<usize> = found.iter().map(|item| item.column).collect();
        assert_eq!(columns, [3, 4]);
        assert_eq!(found[0].place_in(&cells(["a", "b"])), Some(3));
        assert_eq!(found[0].place_in(&cells(["b", "a"])), Some(4));
        assert_eq!(found[0].place_in(&cells(["b", "c"])), None);
    }
}
