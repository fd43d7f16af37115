//! Objects of a TDMS file: their properties and the location of their raw data, from the metadata of segments.

use std::collections::{BTreeMap, HashMap};

use super::super::bytes::{Number, Order};
use super::super::damaged;
use crate::failure::{ErrorCode, Failure};
use crate::unit::NamedUnit;

/// Identifier of data without a DAQmx scaler, and input of a scale that uses the stored data.
pub(super) const RAW: u32 = u32::MAX;
/// Seconds from 1904, the origin of LabVIEW times, to 1970.
const TO_1970_S: i64 = 2_082_844_800;
/// An unset time: the start of 1904.
pub(super) const NEVER_NS: i64 = -TO_1970_S * 1_000_000_000;

/// Value of a property.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Property {
    Number(f64),
    Text(String),
    /// Nanoseconds since 1970.
    Time(i64),
}

pub(super) type Properties = BTreeMap<String, Property>;

/// Storage of a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum RawType {
    Number(Number),
    /// One bit of a number.
    Bit(Number, u32),
    Time,
}

impl RawType {
    pub(super) fn width(self) -> usize {
        match self {
            Self::Number(number) | Self::Bit(number, _) => number.width(),
            Self::Time => 16,
        }
    }
}

/// Values of one scaler, or of a channel without scalers.
#[derive(Debug, Default)]
pub(super) struct RawSeries {
    pub(super) scale_id: u32,
    pub(super) values: Vec<f64>,
}

/// A DAQmx scaler: location of the values of one scale in the rows of a buffer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scaler {
    pub(super) stored: RawType,
    pub(super) buffer: usize,
    pub(super) offset: usize,
    pub(super) scale_id: u32,
}

/// Location of an object's values in a chunk of raw data.
#[derive(Debug, Clone)]
pub(super) enum RawIndex {
    Values {
        stored: RawType,
        count: u64,
    },
    /// Not numbers; total size in bytes.
    Other {
        bytes: u64,
    },
    Daqmx {
        count: u64,
        scalers: Vec<Scaler>,
        widths: Vec<u64>,
    },
}

/// The file, a group or a channel.
#[derive(Debug, Default)]
pub(super) struct TdmsObject {
    /// Group and channel, if any.
    pub(super) path: Vec<String>,
    pub(super) properties: Properties,
    pub(super) index: Option<RawIndex>,
    /// Whether the current segment contains its data.
    pub(super) has_data: bool,
    pub(super) series: Vec<RawSeries>,
    pub(super) times_ns: Vec<i64>,
    /// Why its data are not numeric.
    pub(super) left_out: Option<&'static str>,
    /// Property of its time axis that changed after samples had been stored.
    pub(super) changed: Option<&'static str>,
    /// Index of the object list that contains it, from 1.
    list: u64,
}

impl TdmsObject {
    /// Number of samples so far.
    pub(super) fn len(&self) -> usize {
        let series = self.series.iter().map(|series| series.values.len());
        series.min().unwrap_or(self.times_ns.len())
    }

    pub(super) fn number(&self, key: &str) -> Option<f64> {
        match self.properties.get(key)? {
            Property::Number(value) => Some(*value),
            _ => None,
        }
    }

    /// The unit of the horizontal axis in s, usually 1; `None` if it is not a unit of time.
    pub(super) fn time_unit_s(&self) -> Option<f64> {
        let Some(unit) = self.text("wf_xunit_string") else {
            return Some(1.0);
        };
        let unit = NamedUnit::parse(unit).filter(NamedUnit::is_time)?;
        Some(unit.unit.factor())
    }

    pub(super) fn text(&self, key: &str) -> Option<&str> {
        match self.properties.get(key)? {
            Property::Text(text) => Some(text.trim()).filter(|text| !text.is_empty()),
            _ => None,
        }
    }

    /// Nanoseconds since 1970.
    pub(super) fn time(&self, key: &str) -> Option<i64> {
        match self.properties.get(key)? {
            Property::Time(ns) => Some(*ns).filter(|ns| *ns != NEVER_NS),
            _ => None,
        }
    }

    /// Sets a property. Those that locate the first sample are fixed once there are samples.
    fn set(&mut self, key: String, value: Property) {
        let count = self.len();
        let fixed = ["wf_increment", "wf_start_offset", "wf_start_time"];
        let fixed = fixed.into_iter().find(|fixed| *fixed == key);
        let before = self.properties.get(&key);
        if let (Some(fixed), Some(before), true) = (fixed, before, count > 0) {
            let unit_s = self.time_unit_s().unwrap_or(1.0);
            let step_s = unit_s * self.number("wf_increment").unwrap_or(0.0);
            let is_next = match (before, &value) {
                // Each waveform may give its own start.
                (Property::Time(first), Property::Time(now)) => {
                    let off_s = now.wrapping_sub(*first) as f64 * 1e-9 - step_s * count as f64;
                    off_s.abs() <= 0.5 * step_s
                }
                _ => false,
            };
            if *before != value && !is_next {
                self.changed = Some(fixed);
            }
            return;
        }
        self.properties.insert(key, value);
    }

    /// Index of the series with an identifier.
    pub(super) fn series_of(&mut self, scale_id: u32) -> usize {
        let place = self.series.iter().position(|s| s.scale_id == scale_id);
        place.unwrap_or_else(|| {
            self.series.push(RawSeries {
                scale_id,
                ..RawSeries::default()
            });
            self.series.len() - 1
        })
    }
}

/// All objects of a file, and those in the list of the current segment.
#[derive(Debug, Default)]
pub(super) struct TdmsObjects {
    pub(super) all: Vec<TdmsObject>,
    pub(super) listed: Vec<usize>,
    places: HashMap<String, usize>,
    lists: u64,
}

impl TdmsObjects {
    /// Parses the metadata of a segment.
    ///
    /// # Errors
    /// If they are inconsistent or have data of unknown types.
    pub(super) fn read(
        &mut self,
        fields: &mut MetadataFields,
        is_new_list: bool,
    ) -> Result<(), Failure> {
        if is_new_list || self.lists == 0 {
            self.listed.clear();
            self.lists += 1;
        }
        for _ in 0..fields.u32()? {
            let path = fields.text()?;
            let place = *self.places.entry(path).or_insert_with_key(|path| {
                self.all.push(TdmsObject {
                    path: parts(path),
                    ..TdmsObject::default()
                });
                self.all.len() - 1
            });
            let object = &mut self.all[place];
            if object.list != self.lists {
                object.list = self.lists;
                self.listed.push(place);
            }
            fields.index(object)?;
            for _ in 0..fields.u32()? {
                let key = fields.text()?;
                if let Some(value) = fields.property(&key)? {
                    object.set(key, value);
                }
            }
        }
        Ok(())
    }
}

/// Components of a path: `/'group'/'it''s'`.
fn parts(path: &str) -> Vec<String> {
    let mut parts = Vec::new();
    let mut left = path;
    while let Some((_, begun)) = left.split_once('\'') {
        let doubled = begun.replace("''", "\u{0}\u{0}");
        let end = doubled.find('\'').unwrap_or(doubled.len());
        parts.push(doubled[..end].replace("\u{0}\u{0}", "'"));
        left = begun.get(end + 1..).unwrap_or_default();
    }
    parts
}

/// A sequential reader of metadata.
pub(super) struct MetadataFields<'a> {
    pub(super) bytes: &'a [u8],
    /// Position of the remainder in the file.
    pub(super) at: u64,
    pub(super) order: Order,
}

impl<'a> MetadataFields<'a> {
    fn take(&mut self, count: u64) -> Result<&'a [u8], Failure> {
        let taken = usize::try_from(count)
            .ok()
            .and_then(|count| self.bytes.split_at_checked(count));
        let Some((taken, rest)) = taken else {
            return Err(damaged(
                "the metadata of a segment exceed their declared length",
                self.at,
            ));
        };
        self.bytes = rest;
        self.at += count;
        Ok(taken)
    }

    pub(super) fn u32(&mut self) -> Result<u32, Failure> {
        Ok(Number::Unsigned(4).read(self.take(4)?, self.order) as u32)
    }

    pub(super) fn u64(&mut self) -> Result<u64, Failure> {
        let bytes = self.take(8)?.try_into().unwrap_or_default();
        Ok(match self.order {
            Order::Little => u64::from_le_bytes(bytes),
            Order::Big => u64::from_be_bytes(bytes),
        })
    }

    fn text(&mut self) -> Result<String, Failure> {
        let count = self.u32()?;
        Ok(String::from_utf8_lossy(self.take(count.into())?).into_owned())
    }

    /// Reads a property; `None` if its type is not used.
    fn property(&mut self, key: &str) -> Result<Option<Property>, Failure> {
        let (at, kind) = (self.at, self.u32()?);
        if kind == TEXT {
            return Ok(Some(Property::Text(self.text()?)));
        }
        let Some((stored, width)) = stored(kind) else {
            let what = format_args!("the property \"{key}\" has the unknown type {kind:#x}");
            return Err(damaged(what, at));
        };
        let bytes = self.take(width)?;
        Ok(stored.map(|stored| match stored {
            RawType::Time => Property::Time(time_ns(bytes, self.order)),
            RawType::Number(number) | RawType::Bit(number, _) => {
                Property::Number(number.read(bytes, self.order))
            }
        }))
    }

    /// Reads the location of an object's data.
    fn index(&mut self, object: &mut TdmsObject) -> Result<(), Failure> {
        let at = self.at;
        let kind = self.u32()?;
        object.has_data = kind != NO_DATA;
        let index = match kind {
            NO_DATA => return Ok(()),
            AS_BEFORE if object.index.is_some() => return Ok(()),
            AS_BEFORE => {
                let what = "a channel refers to a previous index that does not exist";
                return Err(damaged(what, at));
            }
            DAQMX | DAQMX_DIGITAL | DAQMX_DIGITAL_DOCUMENTED => self.daqmx(kind != DAQMX)?,
            _ => self.values(object)?,
        };
        object.index = Some(index);
        Ok(())
    }

    fn values(&mut self, object: &mut TdmsObject) -> Result<RawIndex, Failure> {
        let (at, kind) = (self.at, self.u32()?);
        self.dimension()?;
        let count = self.u64()?;
        if kind == TEXT {
            object.left_out = Some("text");
            return Ok(RawIndex::Other { bytes: self.u64()? });
        }
        let Some((stored, width)) = stored(kind) else {
            return Err(ErrorCode::NotARecording.failed(format_args!(
                "data type {kind:#x}{} of a channel is not supported; save it as DBL in LabVIEW",
                match kind {
                    0x0b | 0x1b => " (extended precision)",
                    0x4f => " (fixed point)",
                    _ => "",
                }
            ))
            .with(|place| place.byte = Some(at)));
        };
        Ok(match stored {
            Some(stored) => RawIndex::Values { stored, count },
            None => {
                object.left_out = Some("complex numbers");
                let bytes = count.saturating_mul(width);
                RawIndex::Other { bytes }
            }
        })
    }

    fn dimension(&mut self) -> Result<(), Failure> {
        let at = self.at;
        match self.u32()? {
            1 => Ok(()),
            other => Err(damaged(
                format_args!("a channel has {other} dimensions, expected 1"),
                at,
            )),
        }
    }

    /// Reads an index of raw DAQmx data; for digital lines, the offset counts bits.
    fn daqmx(&mut self, is_digital: bool) -> Result<RawIndex, Failure> {
        let kind = self.u32()?;
        self.dimension()?;
        let count = self.u64()?;
        let mut scalers = Vec::new();
        for _ in 0..self.u32()? {
            let (at, code) = (self.at, self.u32()?);
            let number = match code {
                0 | 2 | 4 | 6 => Number::Unsigned(1 << (code / 2)),
                1 | 3 | 5 | 7 => Number::Signed(1 << (code / 2)),
                8 => Number::Float32,
                9 => Number::Float64,
                _ => {
                    let what = format_args!("a DAQmx scaler has the unknown type {code}");
                    return Err(damaged(what, at));
                }
            };
            let (buffer, offset) = (self.u32()? as usize, self.u32()?);
            // The sample-format bitmap.
            self.take(if is_digital { 1 } else { 4 })?;
            let scale_id = self.u32()?;
            scalers.push(Scaler {
                stored: match is_digital {
                    true => RawType::Bit(number, offset % 8),
                    false => RawType::Number(number),
                },
                buffer,
                offset: offset as usize / if is_digital { 8 } else { 1 },
                // Other data types have a single scaler.
                scale_id: if kind == DAQMX_DATA { scale_id } else { RAW },
            });
        }
        let mut widths = Vec::new();
        for _ in 0..self.u32()? {
            widths.push(u64::from(self.u32()?));
        }
        Ok(RawIndex::Daqmx {
            count,
            scalers,
            widths,
        })
    }
}

/// Indices of raw data other than the length of one.
const NO_DATA: u32 = u32::MAX;
const AS_BEFORE: u32 = 0;
const DAQMX: u32 = 0x1269;
/// As written by DAQmx, and as documented.
const DAQMX_DIGITAL: u32 = 0x126a;
const DAQMX_DIGITAL_DOCUMENTED: u32 = 0x1369;
/// Types other than numbers of fixed width.
const TEXT: u32 = 0x20;
const DAQMX_DATA: u32 = u32::MAX;

/// Storage of values of a type, if they are numbers or times, and their size in bytes.
fn stored(kind: u32) -> Option<(Option<RawType>, u64)> {
    let number = match kind {
        1..=4 => Number::Signed(1 << (kind - 1)),
        5..=8 => Number::Unsigned(1 << (kind - 5)),
        9 | 0x19 => Number::Float32,
        10 | 0x1a => Number::Float64,
        // Booleans.
        0x21 => Number::Unsigned(1),
        0x44 => return Some((Some(RawType::Time), 16)),
        0x08_000c => return Some((None, 8)),
        0x10_000d => return Some((None, 16)),
        _ => return None,
    };
    Some((Some(RawType::Number(number)), number.width() as u64))
}

/// A time stamp in nanoseconds since 1970: seconds since 1904 and units of 2⁻⁶⁴ s, in the given byte order.
pub(super) fn time_ns(bytes: &[u8], order: Order) -> i64 {
    let mut wide: [u8; 16] = bytes.try_into().unwrap_or_default();
    if order == Order::Big {
        wide.reverse();
    }
    let both = i128::from_le_bytes(wide);
    let seconds = (both >> 64) as i64;
    let nanoseconds = (u128::from(both as u64) * 1_000_000_000 + (1 << 63)) >> 64;
    seconds
        .saturating_sub(TO_1970_S)
        .saturating_mul(1_000_000_000)
        .saturating_add(nanoseconds as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_have_groups_and_channels() {
        assert_eq!(parts("/"), Vec::<String>::new());
        assert_eq!(parts("/'a'"), ["a"]);
        assert_eq!(parts("/'a/b'/'it''s'"), ["a/b", "it's"]);
        assert_eq!(parts("/''''/'b"), ["'", "b"]);
    }

    #[test]
    fn times_count_from_1904() {
        let mut bytes = [0; 16];
        bytes[..8].copy_from_slice(&(1_u64 << 63).to_le_bytes());
        bytes[8..].copy_from_slice(&(TO_1970_S + 2).to_le_bytes());
        assert_eq!(time_ns(&bytes, Order::Little), 2_500_000_000);
        bytes.reverse();
        assert_eq!(time_ns(&bytes, Order::Big), 2_500_000_000);
        assert_eq!(time_ns(&[0; 16], Order::Little), NEVER_NS);
    }
}
