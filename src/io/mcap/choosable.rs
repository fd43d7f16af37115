//! Names by which the numbers in a file can be selected.

use super::inventory::{ChannelReport, LeafReport};

impl LeafReport {
    /// Its path with the first item instead of lists and arrays: `poses[].c[9].x` is `poses[0].c[0].x`.
    pub fn first_item(&self) -> String {
        let mut pieces = self.path.split('[');
        let mut item = pieces.next().unwrap_or_default().to_owned();
        for piece in pieces {
            item.push_str("[0]");
            item.push_str(piece.split_once(']').map_or("", |(_, behind)| behind));
        }
        item
    }
}

impl ChannelReport {
    /// The numbers that part of a name can select, as topic and field: those of lists only by the names of their items,
    /// since otherwise any item could be meant. The description of a list (`layout` of the `MultiArray` messages of
    /// ROS) is excluded.
    pub fn choosable(&self) -> Vec<[String; 2]> {
        let one = |leaf: &LeafReport| -> Vec<String> {
            match leaf.path.split_once('[') {
                None => vec![leaf.path.clone()],
                Some((list, behind)) => {
                    let behind = behind.split_once(']').map_or("", |(_, behind)| behind);
                    let named = |name: &String| format!("{list}[name={name}]{behind}");
                    leaf.names.iter().map(named).collect()
                }
            }
        };
        let has_lists = self.leaves.iter().any(|leaf| leaf.path.contains('['));
        let describes = |leaf: &LeafReport| has_lists && leaf.path.starts_with("layout.");
        let numbers = self.leaves.iter();
        let numbers = numbers.filter(|leaf| !leaf.is_stamp && !describes(leaf));
        let fields = numbers.flat_map(one);
        fields.map(|field| [self.topic.clone(), field]).collect()
    }
}
