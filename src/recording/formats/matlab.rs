//! MATLAB 5 files (`save -v6` and `-v7`, SciPy's `savemat`): real numeric vectors are channels, a vector named like
//! time is their axis, and a number named like a rate or step their rate (MAT-File Format, MathWorks).

use std::io::Cursor;

use torqcomp_decimal::digits;

use super::bytes::{Bytes, Number, Order};
use super::{
    Content, Format, channel, cut, damaged, is_time_name, names_left_out, plausible_rate, stamped,
};
use crate::failure::{ErrorCode, Failure};
use crate::io::Reading;
use crate::recording::text::meaning;
use crate::recording::{TimeAxis, seconds_assumed};
use crate::unit::NamedUnit;

pub(super) const MATLAB: Format = Format {
    name: "mat",
    called: "a MATLAB file",
    is,
    takes: &["--time-column", "--time-unit"],
    read,
};

/// Size of the file header in bytes.
const HEAD: u64 = 128;
/// Types of elements.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Bits of the array flags.
const COMPLEX: u32 = 1 << 11;

fn is(head: &[u8]) -> bool {
    let is_version = |end: &[u8]| end == b"\0\x01IM" || end == b"\x01\0MI";
    head.starts_with(b"MATLAB 5") && head.get(124..128).is_some_and(is_version)
        // SciPy and others may omit the text.
        || head.get(124..128).is_some_and(is_version) && head.iter().take(4).all(|b| *b != 0)
}

/// A numeric variable.
struct Variable {
    name: String,
    values: Vec<f64>,
    /// Whether it has one row or one column.
    is_vector: bool,
}

/// An element: its type, its bytes, and whether they are complete.
struct Element {
    kind: u32,
    at: u64,
    bytes: Vec<u8>,
    is_whole: bool,
}

/// Reads an element; `None` at the end. Nested elements are padded to eight bytes.
fn element(
    bytes: &mut Bytes,
    order: Order,
    is_filled_up: bool,
) -> Result<Option<Element>, Failure> {
    let head = bytes.take(8)?;
    if head.len() < 8 {
        let is_whole = head.is_empty();
        return Ok((!is_whole).then_some(Element {
            kind: MATRIX,
            at: bytes.at,
            bytes: Vec::new(),
            is_whole,
        }));
    }
    let word = |from: usize| Number::Unsigned(4).read(&head[from..from + 4], order) as u32;
    let (kind, at) = (word(0), bytes.at);
    if kind >> 16 != 0 {
        // A short element has its length in the upper half and its bytes in the second word.
        let count = ((kind >> 16) as usize).min(4);
        return Ok(Some(Element {
            kind: kind & 0xffff,
            at,
            bytes: head[4..4 + count].to_vec(),
            is_whole: true,
        }));
    }
    let count = word(4);
    let content = bytes.take(u64::from(count))?;
    if is_filled_up {
        bytes.take(u64::from(count.wrapping_neg() % 8))?;
    }
    Ok(Some(Element {
        kind,
        at,
        is_whole: content.len() == count as usize,
        bytes: content,
    }))
}

/// Numeric type of an element.
fn number(kind: u32) -> Option<Number> {
    Some(match kind {
        1 => Number::Signed(1),
        2 => Number::Unsigned(1),
        3 => Number::Signed(2),
        4 => Number::Unsigned(2),
        5 => Number::Signed(4),
        6 => Number::Unsigned(4),
        7 => Number::Float32,
        9 => Number::Float64,
        12 => Number::Signed(8),
        13 => Number::Unsigned(8),
        _ => return None,
    })
}

/// Content of a matrix: numbers, or the reason why not.
enum Matrix {
    Numbers(Variable),
    Other { name: String, why: &'static str },
}

fn matrix(bytes: &mut Bytes, order: Order) -> Result<Option<Matrix>, Failure> {
    let mut next = || element(bytes, order, true);
    let (Some(flags), Some(dimensions), Some(name)) = (next()?, next()?, next()?) else {
        return Ok(None);
    };
    let flags = Number::Unsigned(4).all(&flags.bytes, order);
    let flags = flags.first().map_or(0, |flags| *flags as u32);
    let dimensions = Number::Signed(4).all(&dimensions.bytes, order);
    let name = String::from_utf8_lossy(&name.bytes)
        .trim_end_matches('\0')
        .to_owned();
    let why = match flags & 0xff {
        6..=15 if flags & COMPLEX != 0 => Some("complex numbers"),
        6..=15 if dimensions.len() > 2 => Some("more than two dimensions"),
        6..=15 => None,
        1 => Some("a cell array"),
        2 => Some("a structure"),
        4 => Some("text"),
        5 => Some("a sparse matrix"),
        _ => Some("an object"),
    };
    if let Some(why) = why {
        return Ok(Some(Matrix::Other { name, why }));
    }
    let Some(values) = next()? else {
        return Ok(None);
    };
    let Some(number) = number(values.kind) else {
        return Err(damaged(
            format_args!("the variable \"{name}\" has an unknown number type"),
            values.at,
        ));
    };
    let count: f64 = dimensions.iter().product();
    let mut values = number.all(&values.bytes, order);
    if (values.len() as f64) < count || dimensions.len() < 2 {
        return Ok(None);
    }
    values.truncate(count as usize);
    Ok(Some(Matrix::Numbers(Variable {
        name,
        values,
        is_vector: dimensions.contains(&1.0),
    })))
}

fn read(bytes: &mut Bytes, reading: &Reading) -> Result<Content, Failure> {
    let head = bytes.take(HEAD)?;
    let order = match head.get(126..128) {
        Some(b"IM") => Order::Little,
        _ => Order::Big,
    };
    let mut content = Content {
        dialect: "MATLAB 5".to_owned(),
        ..Content::default()
    };
    let mut variables: Vec<Variable> = Vec::new();
    let mut left_out = Vec::new();
    while let Some(found) = element(bytes, order, false)? {
        if !found.is_whole {
            content.lost = Some(cut("within a variable"));
            break;
        }
        let (kind, inner) = match found.kind {
            COMPRESSED => inflated(found, order)?,
            kind => (kind, Bytes::of(found.bytes, found.at)),
        };
        let mut inner = inner;
        if kind != MATRIX {
            continue;
        }
        match matrix(&mut inner, order)? {
            // In SciPy and MATLAB files, the data of objects have no name.
            Some(Matrix::Other { name, .. }) if name.is_empty() || name.starts_with("__") => {}
            Some(Matrix::Other { name, why }) => left_out.push(format!("\"{name}\" ({why})")),
            Some(Matrix::Numbers(variable)) => variables.push(variable),
            None => {
                content.lost = Some(cut("a variable is incomplete"));
                break;
            }
        }
    }
    channels(variables, reading, &mut content, &mut left_out)?;
    content.warnings.extend(names_left_out(&left_out));
    Ok(content)
}

/// Decompresses an element: its type and its content.
fn inflated(packed: Element, order: Order) -> Result<(u32, Bytes), Failure> {
    let unpacked = flate2::read::ZlibDecoder::new(Cursor::new(packed.bytes));
    let mut unpacked = Bytes::new(Box::new(unpacked));
    let found = element(&mut unpacked, order, false);
    match found {
        Ok(Some(found)) if found.is_whole => Ok((found.kind, Bytes::of(found.bytes, packed.at))),
        _ => Err(damaged(
            "a compressed variable cannot be decompressed",
            packed.at,
        )),
    }
}

fn bare(name: &str) -> String {
    let letters = name.chars().filter(|c| c.is_alphanumeric());
    letters.collect::<String>().to_lowercase()
}

/// The rate given by a number with such a name, and the name.
fn stated_rate(variables: &[Variable]) -> Result<Option<(String, f64)>, Failure> {
    let scalars = variables.iter().filter(|v| v.values.len() == 1);
    let stated = scalars.filter_map(|v| {
        let bare = bare(&v.name.replace("_hz", "").replace("_Hz", ""));
        let rate = match meaning("variables", &bare)? {
            "rate" => v.values[0],
            _ => 1.0 / v.values[0],
        };
        Some((v.name.clone(), plausible_rate(rate)?))
    });
    let stated: Vec<(String, f64)> = stated.collect();
    match stated.as_slice() {
        [] => Ok(None),
        [first, others @ ..] => match others
            .iter()
            .find(|(_, rate)| (rate / first.1 - 1.0).abs() > 1e-6)
        {
            None => Ok(Some(first.clone())),
            Some(other) => Err(ErrorCode::TimeUnknown.failed(format_args!(
                "\"{}\" and \"{}\" give two rates, {} and {} Hz; give the right one with --rate",
                first.0,
                other.0,
                digits::text(first.1, 6),
                digits::text(other.1, 6)
            ))),
        },
    }
}

/// Index of the time vector: the requested one, or the only one with a name of time.
fn time_of(variables: &[Variable], reading: &Reading) -> Result<Option<usize>, Failure> {
    let is_column = |v: &Variable| v.is_vector && v.values.len() > 1;
    if let Some(wanted) = &reading.time_column {
        let found = variables
            .iter()
            .position(|v| is_column(v) && v.name == *wanted);
        return found.map(Some).ok_or_else(|| {
            let names: Vec<&str> = variables
                .iter()
                .filter(|v| is_column(v))
                .map(|v| v.name.as_str())
                .collect();
            ErrorCode::ChannelNotFound.failed(format_args!(
                "there is no vector \"{wanted}\" for --time-column; the vectors are {}",
                names.join(", ")
            ))
        });
    }
    let mut found = (0..variables.len()).filter(|i| {
        let variable = &variables[*i];
        is_column(variable)
            && is_time_name(&variable.name)
            && variable.values.windows(2).all(|pair| pair[1] >= pair[0])
    });
    Ok(match (found.next(), found.next()) {
        (Some(one), None) => Some(one),
        _ => None,
    })
}

/// Converts the vectors to channels.
fn channels(
    mut variables: Vec<Variable>,
    reading: &Reading,
    content: &mut Content,
    left_out: &mut Vec<String>,
) -> Result<(), Failure> {
    let stated = match reading.rate_hz {
        Some(_) => None,
        None => stated_rate(&variables)?,
    };
    let time = time_of(&variables, reading)?.map(|place| variables.remove(place));
    let time = match time {
        Some(time) => Some((seconds(&time, reading)?, time.values.len())),
        None => None,
    };
    let of_rate = stated.map(|(name, rate_hz)| TimeAxis::of_header(&name, rate_hz, None));
    for variable in variables {
        let Variable {
            name,
            values,
            is_vector,
        } = variable;
        match values.as_slice() {
            [] => {}
            [one] => content.details.push((name, digits::text(*one, 12))),
            _ if !is_vector => left_out.push(format!("\"{name}\" (a matrix)")),
            _ => {
                let axis = match (&time, &of_rate) {
                    (Some((axis, count)), _) if *count == values.len() => axis.clone(),
                    (_, Some(axis)) => axis.clone(),
                    _ => TimeAxis::default(),
                };
                content
                    .channels
                    .push(channel(&name, unit_in(&name), values, axis));
            }
        }
    }
    Ok(())
}

/// The unit at the end of a name, as in `bridge_V`.
fn unit_in(name: &str) -> Option<&str> {
    let (_, unit) = name.rsplit_once('_')?;
    NamedUnit::parse(unit).map(|_| unit)
}

/// The axis of a time vector.
fn seconds(time: &Variable, reading: &Reading) -> Result<TimeAxis, Failure> {
    let (unit, is_given) = match (&reading.time_unit, unit_in(&time.name)) {
        (Some(unit), _) => (Some(unit.as_str()), true),
        (None, of_name) => (of_name, false),
    };
    let known = unit.and_then(NamedUnit::parse).filter(NamedUnit::is_time);
    if is_given && known.is_none() {
        return Err(ErrorCode::InvalidValue
            .usage("--time-unit is not a unit of time; expected s, ms, us or min"));
    }
    let second = known.as_ref().map_or(1.0, |unit| unit.unit.factor());
    let mut axis = stamped(&time.name, time.values.iter().map(|t| t * second).collect());
    if known.is_none() {
        axis.assumed = Some(seconds_assumed(&time.name, None));
    }
    Ok(axis)
}
