//! Order by numbers.

/// Sorts items by a number of each, the least first (`f64::total_cmp`); items with equal numbers stay in their order.
///
/// The sort itself is compiled once: of each type that it is generic in, it would take 5 kB of every binary.
///
/// ```
/// let mut masses_kg = vec![("disc", 2.5), ("rod", 0.1), ("ring", 2.5)];
/// torqcomp_dsp::sort_by_number(&mut masses_kg, |mass| -mass.1);
/// assert_eq!(masses_kg, [("disc", 2.5), ("ring", 2.5), ("rod", 0.1)]);
/// ```
pub fn sort_by_number<T>(items: &mut Vec<T>, number: impl FnMut(&T) -> f64) {
    let numbers: Vec<f64> = items.iter().map(number).collect();
    let mut taken: Vec<Option<T>> = items.drain(..).map(Some).collect();
    let sorted = order(&numbers).into_iter();
    items.extend(sorted.filter_map(|place| taken[place].take()));
}

/// Places of numbers, that of the least first.
#[inline(never)]
fn order(numbers: &[f64]) -> Vec<usize> {
    let mut places: Vec<usize> = (0..numbers.len()).collect();
    places.sort_by(|a, b| numbers[*a].total_cmp(&numbers[*b]));
    places
}
