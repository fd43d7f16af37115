//! What the lines above a table say of its columns.

use super::cell::Cell;
use super::head::{Head, Table};
use super::keys::{self, Entry, Topic};
use super::units::{self, Heading};
use crate::io::csv::{Delimiter, Dialect, NamedUnit};

/// Lines above a table among which its headings are looked for.
const LINES_FOR_HEADINGS: usize = 10;
/// Longest heading of a lone column, in words.
const WORDS: usize = 4;

/// A column as its headings describe it.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Its heading as written, or `column N`.
    pub heading: String,
    /// Its name without the unit.
    pub name: String,
    /// Its unit, if it is known.
    pub unit: Option<NamedUnit>,
    /// Its unit as written.
    pub unit_text: Option<String>,
    /// Whether the cells above it name the rows of the header: it holds the time of the columns that
    /// follow, if it holds anything.
    pub is_label: bool,
}

/// The lines above a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// The columns.
    pub fields: Vec<Field>,
    /// The keys and values.
    pub entries: Vec<Entry>,
    /// Text of the line with the names.
    pub names: Option<String>,
}

/// A unit, of time as well where a maker writes seconds as S.
fn unit_of(name: &str, unit: &str) -> Option<NamedUnit> {
    match unit.trim() {
        "S" if units::is_time_name(name) || units::is_axis_name(name) => units::read("s"),
        unit => units::read(unit),
    }
}

impl Field {
    /// A column without a heading, its place counted from 0.
    #[must_use]
    pub fn unnamed(place: usize) -> Self {
        let name = format!("column {}", place + 1);
        Self {
            heading: name.clone(),
            name,
            unit: None,
            unit_text: None,
            is_label: false,
        }
    }

    /// A column with a heading, and with a unit in a row of its own.
    #[must_use]
    pub fn new(heading: &str, unit: Option<&str>) -> Self {
        let heading = heading.trim().trim_matches('"').trim();
        let Heading {
            name,
            unit: own,
            unit_text,
        } = units::heading(heading);
        let below = unit.and_then(|unit| unit_of(&name, unit));
        let below_text = unit.and_then(units::as_written);
        // Under a name with a unit below, what looks like a unit at its end may be none.
        let is_plain = !heading.contains(['[', '(', '/']);
        let name = match &below {
            Some(_) if is_plain => heading.to_owned(),
            _ => name,
        };
        let own = own.filter(|_| below.is_none() || !is_plain);
        let unit_text = unit_text.filter(|_| own.is_some() || below.is_none());
        Self {
            heading: heading.to_owned(),
            name,
            unit_text: unit_text
                .or(below.as_ref().map(|u| u.text.clone()))
                .or(below_text),
            unit: own.or(below),
            is_label: false,
        }
    }

    /// A column whose heading is its name alone.
    #[must_use]
    pub fn with_unit(name: &str, unit: Option<&str>) -> Self {
        Self {
            heading: name.to_owned(),
            name: name.to_owned(),
            unit: unit.and_then(|unit| unit_of(name, unit)),
            unit_text: unit.and_then(units::as_written),
            is_label: false,
        }
    }

    /// Whether it is known to hold time, by its unit.
    #[must_use]
    pub fn has_time_unit(&self) -> bool {
        self.unit.as_ref().is_some_and(units::is_time)
    }

    /// Whether its name is that of time.
    #[must_use]
    pub fn is_named_time(&self) -> bool {
        units::is_time_name(&self.name) && (self.unit.is_none() || self.has_time_unit())
    }
}

/// A line above the table, split.
struct Row<'a> {
    line: usize,
    text: &'a str,
    cells: Vec<String>,
}

/// Reads the lines above a table; `used` says which columns have data in the first rows.
#[must_use]
pub fn read(head: &Head, table: &Table, used: &[bool]) -> Header {
    let rows: Vec<Row> = head.lines[..table.first]
        .iter()
        .enumerate()
        .filter(|(_, line)| line.text.chars().any(char::is_alphanumeric))
        .map(|(line, content)| Row {
            line,
            text: &content.text,
            cells: split(&content.text, table, used),
        })
        .collect();
    let entries = |without: &[usize]| -> Vec<Entry> {
        rows.iter()
            // `CH1V,CH2V,t0 =-5e-05, tInc = 1e-09,` names columns and says more.
            .filter(|row| !without.contains(&row.line) || row.text.contains('='))
            .flat_map(|row| keys::entries(head.number(row.line), row.text, table.dialect))
            .collect()
    };
    let keyed = entries_below_keys(head, &rows);
    let entries = |without: &[usize]| -> Vec<Entry> {
        let mut all = entries(without);
        all.extend(keyed.iter().cloned());
        all
    };
    if let Some((fields, names)) = labelled(&rows, used) {
        return Header {
            fields,
            entries: entries(&[names]),
            names: Some(head.lines[names].text.clone()),
        };
    }
    let found = positional(&rows, table, used);
    let mut fields = found.fields;
    let entries = entries(&found.lines);
    if found.names.is_none() {
        fill_names(&mut fields, &entries, used);
    }
    fill_units(&mut fields, &entries, used);
    Header {
        fields,
        entries,
        names: found.names.map(|line| head.lines[line].text.clone()),
    }
}

/// Keys in a line of their own with their values in the next: `dt:` above `0.001`.
fn entries_below_keys(head: &Head, rows: &[Row]) -> Vec<Entry> {
    rows.windows(2)
        .filter(|pair| pair[1].line == pair[0].line + 1)
        .filter_map(|pair| {
            let key = pair[0].text.trim().strip_suffix(':')?;
            Some(Entry {
                line: head.number(pair[0].line),
                key: key.to_owned(),
                values: pair[1].cells.clone(),
            })
        })
        .collect()
}

/// Splits a line above the table as the table is split, or, if that does not give a cell for each
/// column, by other marks that do.
fn split(text: &str, table: &Table, used: &[bool]) -> Vec<String> {
    let text = uncommented(text);
    let cells = table.dialect.cells(text);
    let count = |cells: &[String]| cells.iter().filter(|cell| !cell.is_empty()).count();
    let wanted = used.iter().filter(|used| **used).count();
    if count(&cells) >= wanted && cells.len() <= table.width + 1 || wanted < 2 {
        return cells;
    }
    let others = [b'\t', b';', b',', b'|'];
    let mut ways: Vec<Vec<String>> = others
        .into_iter()
        .filter(|mark| table.dialect.delimiter != Delimiter::Byte(*mark))
        .filter(|mark| text.contains(char::from(*mark)))
        .map(|mark| {
            let delimiter = Delimiter::Byte(mark);
            Dialect {
                delimiter,
                ..table.dialect
            }
            .cells(text)
        })
        .collect();
    ways.push(
        text.split("  ")
            .map(str::trim)
            .filter(|cell| !cell.is_empty())
            .map(str::to_owned)
            .collect(),
    );
    ways.into_iter()
        .find(|way| way.len() == table.width)
        .unwrap_or(cells)
}

/// Headings may stand in a comment: `# time_s,bridge_V`.
fn uncommented(text: &str) -> &str {
    let text = text.trim_start_matches('\u{feff}');
    match text.trim_start().strip_prefix(['#', '%', '!']) {
        Some(rest) => rest.trim_start_matches(['#', '%', '!']).trim_start(),
        // CASSY heads its columns so.
        None => text.strip_prefix("DEF=").unwrap_or(text),
    }
}

/// Whether a cell labels the row of names.
fn is_name_label(cell: &str) -> bool {
    const LABELS: [&str; 20] = [
        "channeltitle",
        "channel title",
        "name",
        "names",
        "channel name",
        "channel names",
        "tracename",
        "trace name",
        "signal",
        "signals",
        "kanal",
        "kanalname",
        "channel",
        "channels",
        "source",
        "label",
        "labels",
        "bezeichnung",
        "signal name",
        "messstelle",
    ];
    let cell = cell
        .trim()
        .trim_end_matches([':', '='])
        .trim()
        .to_lowercase();
    LABELS.contains(&cell.as_str())
}

/// A header whose rows are labelled in the first column (and again above every further column of
/// time): the columns, and the line of the names.
fn labelled(rows: &[Row], used: &[bool]) -> Option<(Vec<Field>, usize)> {
    let wide = |row: &&Row| {
        let filled = row.cells.iter().filter(|cell| !cell.is_empty()).count();
        row.cells.len() >= used.len() && 10 * filled >= 6 * used.len()
    };
    let names = rows
        .iter()
        .rev()
        .filter(wide)
        .find(|row| is_name_label(&row.cells[0]))?;
    let block = block_around(rows, names.line);
    let others: Vec<&Row> = rows
        .iter()
        .filter(|row| row.line != names.line && block.contains(&row.line))
        .filter(|row| row.cells.len() > 1 && !row.cells[0].is_empty())
        .filter(|row| row.cells.len() + 1 >= used.len())
        .collect();
    let about = |topic: Topic| {
        let key = |row: &&&Row| row.cells[0].trim_end_matches([':', '=']).trim().to_owned();
        others
            .iter()
            .find(|row| keys::topic(&key(row)) == Some(topic))
    };
    let units = about(Topic::Unit);
    // Without a row that says more, the label must stand above several columns.
    let is_alone = others.is_empty()
        || units.is_none() && about(Topic::Interval).is_none() && about(Topic::Rate).is_none();
    if is_alone && names.cells[1..].iter().all(|cell| *cell != names.cells[0]) {
        return None;
    }
    // Where the rows of data have no cell under the labels, the names begin one cell later.
    let filled = names.cells.iter().filter(|cell| !cell.is_empty()).count();
    if filled == used.len() + 1 && names.cells.len() >= filled && used.iter().all(|used| *used) {
        let fields = (0..used.len())
            .map(|place| {
                let unit = units
                    .and_then(|row| row.cells.get(place + 1))
                    .map(String::as_str);
                match unit {
                    Some(unit) => Field::with_unit(&names.cells[place + 1], Some(unit)),
                    None => Field::new(&names.cells[place + 1], None),
                }
            })
            .collect();
        return Some((fields, names.line));
    }
    let is_label = |place: usize| {
        let repeats = |row: &Row| row.cells.get(place) == row.cells.first();
        repeats(names)
            && others
                .iter()
                .all(|row| repeats(row) || row.cells.len() <= place)
    };
    let fields = (0..used.len())
        .map(|place| {
            if is_label(place) {
                let mut field = Field::new("time", None);
                field.is_label = true;
                return field;
            }
            let unit = units
                .and_then(|row| row.cells.get(place))
                .map(String::as_str);
            match names.cells.get(place) {
                Some(name) if !name.is_empty() && units.is_some() => Field::with_unit(name, unit),
                Some(name) if !name.is_empty() => Field::new(name, None),
                _ => Field::unnamed(place),
            }
        })
        .collect();
    Some((fields, names.line))
}

/// The lines around one that no empty line parts from it.
fn block_around(rows: &[Row], line: usize) -> std::ops::RangeInclusive<usize> {
    let (mut first, mut last) = (line, line);
    for row in rows {
        if row.line == last + 1 {
            last = row.line;
        }
    }
    for row in rows.iter().rev() {
        if row.line + 1 == first {
            first = row.line;
        }
    }
    first..=last
}

/// Columns named by the rows nearest above the data, and which lines those are.
struct Positional {
    fields: Vec<Field>,
    lines: Vec<usize>,
    names: Option<usize>,
}

fn positional(rows: &[Row], table: &Table, used: &[bool]) -> Positional {
    let near = rows.len().saturating_sub(LINES_FOR_HEADINGS);
    let fitting: Vec<&Row> = rows[near..]
        .iter()
        .filter(|row| is_heading(&row.cells, table, used))
        .filter(|row| !is_process_row(&row.cells))
        .rev()
        .collect();
    let unnamed = || Positional {
        fields: (0..table.width).map(Field::unnamed).collect(),
        lines: Vec::new(),
        names: None,
    };
    if is_key_block(&fitting, used) {
        return unnamed();
    }
    let (names, units, remarks) = match fitting.as_slice() {
        [] => return unnamed(),
        [below, above, ..] if is_mixed(&below.cells, &above.cells) => {
            (*above, Some(*below), Some(*below))
        }
        [below, above, ..] if is_units(&below.cells) => (*above, Some(*below), None),
        [only, ..] if is_nothing_but_units(&only.cells) => (*only, Some(*only), None),
        [names, ..] => (*names, None, None),
    };
    let mut lines = vec![names.line];
    lines.extend(units.map(|row| row.line));
    let upper = upper_names(names, &fitting, used);
    lines.extend(upper.map(|row| row.line));
    let cell = |row: Option<&Row>, place: usize| -> Option<String> {
        row?.cells
            .get(place)
            .filter(|cell| !cell.is_empty())
            .cloned()
    };
    let fields = (0..table.width)
        .map(|place| {
            let Some(name) = cell(Some(names), place) else {
                return Field::unnamed(place);
            };
            let below = cell(units, place);
            let is_unit = below.as_deref().is_some_and(|b| units::read(b).is_some());
            let mut field = Field::new(
                &name,
                below.as_deref().filter(|_| remarks.is_none() || is_unit),
            );
            if let Some(remark) = cell(remarks, place).filter(|_| !is_unit) {
                field.name = format!("{}: {remark}", field.name);
            }
            if let Some(upper) = cell(upper, place) {
                field.name = format!("{upper} {}", field.name);
            }
            field
        })
        .collect();
    Positional {
        fields,
        lines,
        names: Some(names.line),
    }
}

/// Whether cells can be headings: one for (nearly) each column with data, and no numbers but those
/// of channels after a text.
fn is_heading(cells: &[String], table: &Table, used: &[bool]) -> bool {
    let places: Vec<usize> = (0..used.len()).filter(|place| used[*place]).collect();
    let filled = places
        .iter()
        .filter(|place| cells.get(**place).is_some_and(|cell| !cell.is_empty()))
        .count();
    let fits = if places.len() < 2 {
        let words = |cell: &String| cell.split_whitespace().count();
        filled == places.len()
            && cells.iter().filter(|cell| !cell.is_empty()).count() == 1
            && cells
                .iter()
                .all(|cell| words(cell) <= WORDS && !cell.contains(['=', ':']))
    } else {
        let last_is_there = cells.len() > *places.last().unwrap_or(&0);
        filled == places.len()
            || places.len() > 2 && filled + 1 >= places.len() && last_is_there
            || places.len() > 5 && 10 * filled >= 7 * places.len()
    };
    let mut texts = 0;
    fits && cells.iter().filter(|cell| !cell.is_empty()).all(|cell| {
        match Cell::read(cell, table.dialect.decimal) {
            Cell::Text | Cell::NonFinite => {
                texts += 1;
                true
            }
            Cell::Number(value) => {
                texts > 0 && value.fract() == 0.0 && (0.0..1000.0).contains(&value)
            }
            _ => false,
        }
    })
}

/// Rows of a key and a value each above a table of two columns are no headings.
fn is_key_block(fitting: &[&Row], used: &[bool]) -> bool {
    let two = used.iter().filter(|used| **used).count() == 2;
    let Some(nearest) = fitting.first() else {
        return false;
    };
    let is_time = nearest.cells.iter().any(|cell| {
        let field = Field::new(cell, None);
        field.is_named_time()
            || field.has_time_unit()
            || units::is_axis_name(cell)
            || units::is_index_name(cell)
    });
    let (key, values) = (&nearest.cells[0], &nearest.cells[1..]);
    let is_known = keys::topic(key).is_some() && values.iter().all(|v| units::read(v).is_none());
    // An empty line parts headings from keys.
    let in_block = fitting.len() > 2 && fitting[1].line + 1 == nearest.line;
    two && !is_time && !is_units(&nearest.cells) && (in_block || is_known)
}

/// Whether cells are units: all of them, or some where others repeat, or most are in brackets.
fn is_units(cells: &[String]) -> bool {
    let filled: Vec<&String> = cells.iter().filter(|cell| !cell.is_empty()).collect();
    let known = filled
        .iter()
        .filter(|cell| units::read(cell).is_some())
        .count();
    let bracketed = filled
        .iter()
        .filter(|cell| units::is_bracketed(cell))
        .count();
    let like = filled
        .iter()
        .filter(|cell| {
            units::read(cell).is_some()
                || units::is_bracketed(cell)
                || units::as_written(cell).is_none()
        })
        .count();
    let repeats = filled
        .iter()
        .any(|cell| filled.iter().filter(|c| c == &cell).count() > 1);
    known > 0 && (repeats || 2 * like > filled.len()) || bracketed > 0 && bracketed == filled.len()
}

/// Whether a lone line above the data names its columns by their units: `s,V`.
fn is_nothing_but_units(cells: &[String]) -> bool {
    let mut filled = cells.iter().filter(|cell| !cell.is_empty()).peekable();
    filled.peek().is_some() && filled.all(|cell| NamedUnit::parse(cell).is_some())
}

/// Whether the first cell is a unit of time under the name of time, and the others are remarks:
/// `ms,Servo motor speed,Torque` under `Time,Analog 1,Analog 2`.
fn is_mixed(below: &[String], above: &[String]) -> bool {
    let (Some(unit), Some(name)) = (below.first(), above.first()) else {
        return false;
    };
    units::read(unit).is_some_and(|unit| units::is_time(&unit))
        && units::is_time_name(name)
        && below.len() > 1
        && below[1..]
            .iter()
            .all(|cell| units::read(cell).is_none() && !units::is_bracketed(cell))
        && below[1..]
            .iter()
            .any(|cell| units::as_written(cell).is_some_and(|c| c.len() > 3))
}

/// Rows under the units that say how values were formed: `Avg`, `Smp`.
fn is_process_row(cells: &[String]) -> bool {
    const WORDS: [&str; 14] = [
        "avg", "smp", "max", "min", "std", "tot", "raw", "actual", "scaled", "sample", "mean",
        "ts", "rn", "med",
    ];
    let mut filled = cells.iter().filter(|cell| !cell.is_empty()).peekable();
    filled.peek().is_some() && filled.all(|cell| WORDS.contains(&cell.to_lowercase().as_str()))
}

/// A row above the names that tells columns of the same name apart: `CH 1`, `CH 2` above `Voltage`.
fn upper_names<'a>(names: &Row, fitting: &[&'a Row<'a>], used: &[bool]) -> Option<&'a Row<'a>> {
    let cells = |row: &Row| -> Vec<String> {
        (1..used.len())
            .filter_map(|place| row.cells.get(place).cloned())
            .collect()
    };
    let is_distinct = |cells: &[String]| {
        cells
            .iter()
            .enumerate()
            .all(|(place, cell)| !cell.is_empty() && !cells[..place].contains(cell))
    };
    let own = cells(names);
    if own.len() < 2 || is_distinct(&own) {
        return None;
    }
    fitting
        .iter()
        .copied()
        .filter(|row| row.line < names.line)
        .find(|row| {
            let cells = cells(row);
            let is_text = |cell: &String| Cell::read(cell, b'.') == Cell::Text;
            is_distinct(&cells) && cells.iter().all(is_text)
        })
}

/// Names out of a line such as `Source,CH1`, where no line above the table has them.
fn fill_names(fields: &mut [Field], entries: &[Entry], used: &[bool]) {
    let places: Vec<usize> = (0..fields.len()).filter(|place| used[*place]).collect();
    let about = entries
        .iter()
        .find(|entry| entry.topic() == Some(Topic::Name));
    let Some(entry) = about else {
        return;
    };
    // The key may be repeated for each channel.
    let values: Vec<&String> = entry
        .values
        .iter()
        .filter(|v| !v.is_empty() && **v != entry.key)
        .collect();
    if values.len() == places.len() {
        for (place, name) in places.into_iter().zip(values) {
            fields[place] = Field::new(name, None);
        }
    }
}

/// Units out of lines such as `Vertical Units,V,V`: one for each column, or one for all.
fn fill_units(fields: &mut [Field], entries: &[Entry], used: &[bool]) {
    let signals: Vec<usize> = (0..fields.len())
        .filter(|place| used[*place])
        .filter(|place| {
            let field = &fields[*place];
            !field.is_named_time()
                && !units::is_axis_name(&field.name)
                && !units::is_index_name(&field.name)
        })
        .collect();
    let about = |topic| {
        entries
            .iter()
            .find(move |entry| entry.topic() == Some(topic))
    };
    if let Some(entry) = about(Topic::Unit) {
        let values: Vec<&String> = entry
            .values
            .iter()
            .filter(|value| !value.is_empty())
            .collect();
        for (rank, place) in signals.iter().enumerate() {
            let text = match values.as_slice() {
                [one] => one,
                several if several.len() == signals.len() => several[rank],
                _ => continue,
            };
            set_unit(&mut fields[*place], text);
        }
    }
    if let Some(text) = about(Topic::AxisUnit).and_then(Entry::value) {
        let axis = fields
            .iter_mut()
            .find(|field| field.is_named_time() || units::is_axis_name(&field.name));
        if let Some(field) = axis {
            set_unit(field, if text == "S" { "s" } else { text });
        }
    }
}

fn set_unit(field: &mut Field, text: &str) {
    if field.unit.is_none() && field.unit_text.is_none() {
        field.unit = units::read(text);
        field.unit_text = units::as_written(text);
    }
}
