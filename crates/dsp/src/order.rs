//! Sorting by a number.

/// Stable ascending sort of items by a number of each (`f64::total_cmp`).
///
/// The sort itself is not generic: each instantiation would add 5 kB to every binary.
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

/// Indices of the numbers in ascending order.
#[inline(never)]
fn order(numbers: &[f64]) -> Vec<usize> {
    let mut places: Vec<usize> = (0..numbers.len()).collect();
    places.sort_by(|a, b| numbers[*a].total_cmp(&numbers[*b]));
    places
}
