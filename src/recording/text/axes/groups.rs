//! Assignment of channels to time columns.

/// A group of columns with the same time in different formats, and its channels.
pub(super) struct Group {
    pub(super) times: Vec<usize>,
    pub(super) channels: Vec<usize>,
}

/// Assigns channels to time columns: adjacent ones are different formats of the same time; several
/// separate ones each belong to the channels after them.
pub(super) fn groups(times: &[usize], used: &[usize]) -> Vec<Group> {
    let mut blocks: Vec<Vec<usize>> = Vec::new();
    for place in used.iter().filter(|place| times.contains(place)) {
        let before = used.iter().rev().find(|p| *p < place);
        match blocks.last_mut() {
            Some(block) if block.last() == before => block.push(*place),
            _ => blocks.push(vec![*place]),
        }
    }
    let channels: Vec<usize> = used
        .iter()
        .copied()
        .filter(|p| !times.contains(p))
        .collect();
    let first_is_time = used.first().is_some_and(|place| times.contains(place));
    if blocks.len() < 2 || !first_is_time {
        // All share one axis; further time columns are ordinary channels.
        let mut blocks = blocks.into_iter();
        let times = blocks.next().unwrap_or_default();
        let mut channels: Vec<usize> = channels.into_iter().chain(blocks.flatten()).collect();
        channels.sort_unstable();
        return vec![Group { times, channels }];
    }
    let ends: Vec<usize> = blocks
        .iter()
        .skip(1)
        .map(|b| b[0])
        .chain([usize::MAX])
        .collect();
    let mut groups: Vec<Group> = Vec::new();
    for (times, end) in blocks.into_iter().zip(ends) {
        let first = times[0];
        let own: Vec<usize> = channels
            .iter()
            .copied()
            .filter(|p| *p > first && *p < end)
            .collect();
        match groups.last_mut() {
            Some(group) if own.is_empty() => group.channels.extend(times),
            _ => groups.push(Group {
                times,
                channels: own,
            }),
        }
    }
    groups
}
