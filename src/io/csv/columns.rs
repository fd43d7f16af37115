//! Choosing columns: the time axis and the channel.

use super::{Column, Options};
use crate::failure::{Failure, did_you_mean};

/// Place of a column by its heading, its name without the unit, or its number from 1 among those at `places`.
fn find_column(
    columns: &[Column],
    places: &[usize],
    wanted: &str,
    flag: &str,
) -> Result<usize, Failure> {
    let matching = |is: &dyn Fn(&Column) -> bool| -> Vec<usize> {
        (0..columns.len()).filter(|i| is(&columns[*i])).collect()
    };
    let ways: [Vec<usize>; 3] = [
        matching(&|c| c.heading == wanted),
        matching(&|c| c.is_called(wanted)),
        matching(&|c| {
            c.heading.eq_ignore_ascii_case(wanted) || c.name.eq_ignore_ascii_case(wanted)
        }),
    ];
    match ways
        .iter()
        .find(|found| !found.is_empty())
        .map(Vec::as_slice)
    {
        Some([place]) => return Ok(*place),
        Some(same) => {
            let number = |place: &usize| places.iter().position(|p| p == place);
            return Err(Failure::failed(format_args!(
                "{} columns are called \"{wanted}\"; give the number of the one you mean, {flag} {}",
                same.len(),
                list(same.iter().filter_map(number).map(|n| (n + 1).to_string()))
            )));
        }
        None => {}
    }
    if let Ok(number) = wanted.parse::<usize>()
        && let Some(place) = number.checked_sub(1).and_then(|n| places.get(n))
    {
        return Ok(*place);
    }
    let headings = columns.iter().map(|c| c.heading.as_str());
    Err(Failure::failed(format_args!(
        "there is no column \"{wanted}\"{}; the columns are {}",
        did_you_mean(wanted, headings.clone()),
        list((0..columns.len()).map(|i| label(columns, places, i)))
    )))
}

/// `a, b or c`.
pub(crate) fn list(items: impl IntoIterator<Item = String>) -> String {
    let items: Vec<String> = items.into_iter().collect();
    match items.as_slice() {
        [] => "none".to_owned(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} or {last}", first.join(", ")),
    }
}

/// Place of the time column, if there is one.
pub(crate) fn time_column(columns: &[Column], options: &Options) -> Result<Option<usize>, Failure> {
    let all: Vec<usize> = (0..columns.len()).collect();
    if let Some(wanted) = &options.time_column {
        return find_column(columns, &all, wanted, "--time-column").map(Some);
    }
    let candidates: Vec<usize> = (0..columns.len())
        .filter(|i| columns[*i].is_time())
        .collect();
    let named: Vec<usize> = candidates
        .iter()
        .copied()
        .filter(|i| columns[*i].is_named_time())
        .collect();
    match (named.as_slice(), candidates.as_slice()) {
        ([one], _) | ([], [one]) => Ok(Some(*one)),
        (_, []) => Ok(None),
        (_, several) if options.rate_hz.is_some() && !options.resample => {
            Ok(several.first().copied())
        }
        (_, several) => Err(Failure::failed(format_args!(
            "{} columns could be the time axis; choose one with --time-column {}",
            several.len(),
            list(several.iter().map(|i| label(columns, &all, *i)))
        ))),
    }
}

/// A heading in quotes, with its number where several columns have it.
fn label(columns: &[Column], places: &[usize], place: usize) -> String {
    let heading = &columns[place].heading;
    let is_one = columns.iter().filter(|c| c.heading == *heading).count() == 1;
    match places.iter().position(|p| *p == place) {
        Some(number) if !is_one => format!("{} (\"{heading}\")", number + 1),
        _ => format!("\"{heading}\""),
    }
}

/// Place of the channel: the one that is asked for, or the only one.
pub(super) fn channel(
    columns: &[Column],
    time: Option<usize>,
    options: &Options,
) -> Result<usize, Failure> {
    // Their numbers are those that `inspect` gives: the time is not counted.
    let signals: Vec<usize> = (0..columns.len())
        .filter(|i| Some(*i) != time && !columns[*i].is_time())
        .collect();
    if let Some(wanted) = &options.channel {
        return find_column(columns, &signals, wanted, "--channel");
    }
    match signals.as_slice() {
        [one] => Ok(*one),
        [] => Err(Failure::failed(
            "there is no column besides the time; expected one with the signal",
        )),
        several => Err(Failure::failed(format_args!(
            "{} columns could be the signal; choose one with --channel {}",
            several.len(),
            list(several.iter().map(|i| label(columns, &signals, *i)))
        ))),
    }
}
