//! LabVIEW TDMS files (TDMS File Format Internal Structure, National Instruments): channels of all groups with their
//! units, waveform times and scales, with and without DAQmx raw data.
//!
//! A file is a sequence of segments, each with a lead-in, metadata that may refer to previous ones, and chunks of raw
//! data.

mod axes;
mod objects;
mod scales;

use self::objects::{MetadataFields, RawIndex, RawType, Scaler, TdmsObjects, time_ns};
use super::bytes::{Bytes, Order};
use super::{Content, Format, cut, damaged};
use crate::failure::{ErrorCode, Failure};
use crate::io::Reading;
use crate::warning::WarningCode;

pub(super) const TDMS: Format = Format {
    name: "tdms",
    called: "a LabVIEW TDMS file",
    is,
    takes: &["--time-column", "--time-unit"],
    read,
};

const TAG: &[u8] = b"TDSm";
/// Bits of the table of contents of a segment.
const METADATA: u32 = 1 << 1;
const NEW_LIST: u32 = 1 << 2;
const RAW_DATA: u32 = 1 << 3;
const INTERLEAVED: u32 = 1 << 5;
const BIG_ENDIAN: u32 = 1 << 6;
/// Length of an unclosed segment.
const OPEN: u64 = u64::MAX;
/// Number of bytes decoded at a time.
const PIECE: u64 = 1 << 18;

fn is(head: &[u8]) -> bool {
    head.starts_with(TAG)
}

/// Rows of equal width in a chunk.
struct RawRows {
    count: u64,
    width: u64,
    fields: Vec<RawField>,
}

/// A value in each row.
struct RawField {
    object: usize,
    series: usize,
    offset: usize,
    stored: RawType,
}

/// Layout of raw data in a chunk.
#[derive(Default)]
struct ChunkLayout {
    parts: Vec<RawRows>,
    is_daqmx: bool,
}

#[derive(Default)]
struct TdmsFile {
    objects: TdmsObjects,
    chunk: ChunkLayout,
    /// Whether metadata were read since the layout was computed, or its row layout changed.
    is_stale: bool,
    is_interleaved: bool,
    segments: usize,
    version: u32,
}

/// What follows a segment.
enum Next {
    Segment,
    End,
    /// The file ends within it.
    Cut(String),
}

fn read(bytes: &mut Bytes, reading: &Reading) -> Result<Content, Failure> {
    let mut file = TdmsFile::default();
    let mut content = Content::default();
    loop {
        match file.segment(bytes) {
            Ok(Next::Segment) => {}
            Ok(Next::End) => break,
            Ok(Next::Cut(what)) => {
                content.lost = Some(cut(&what));
                break;
            }
            // What precedes is complete.
            Err(failure) if file.has_samples() => {
                let message = format!(
                    "segment {} and everything after it are lost: {failure}",
                    file.segments
                );
                content.lost = Some(WarningCode::SegmentDamaged.warning(message));
                break;
            }
            Err(failure) => return Err(failure),
        }
    }
    content.dialect = file.dialect();
    axes::channels(file.objects, reading, &mut content)?;
    Ok(content)
}

impl TdmsFile {
    fn dialect(&self) -> String {
        let version = match self.version {
            4712 => "1.0",
            _ => "2.0",
        };
        let plural = if self.segments == 1 { "" } else { "s" };
        format!("LabVIEW TDMS {version}, {} segment{plural}", self.segments)
    }

    fn has_samples(&self) -> bool {
        self.objects.all.iter().any(|object| object.len() > 0)
    }

    /// Reads a segment.
    fn segment(&mut self, bytes: &mut Bytes) -> Result<Next, Failure> {
        let at = bytes.at;
        let lead_in = bytes.take(28)?;
        if lead_in.is_empty() {
            return Ok(Next::End);
        }
        self.segments += 1;
        if lead_in.len() < 28 {
            return Ok(self.cut("within the lead-in"));
        }
        if !is(&lead_in) {
            return Err(damaged("a segment does not begin with \"TDSm\"", at));
        }
        let mut fields = MetadataFields {
            bytes: &lead_in[4..],
            at: at + 4,
            order: Order::Little,
        };
        let contents = fields.u32()?;
        let order = match contents & BIG_ENDIAN {
            0 => Order::Little,
            _ => Order::Big,
        };
        fields.order = order;
        self.version = fields.u32()?;
        let (length, metadata) = (fields.u64()?, fields.u64()?);
        if !matches!(self.version, 4712 | 4713) {
            return Err(ErrorCode::NotARecording.failed(format_args!(
                "TDMS version {}, expected 4712 or 4713; save it as TDMS 2.0 in LabVIEW",
                self.version
            )));
        }
        if metadata > length {
            return Err(damaged(
                "the metadata of a segment are longer than the segment",
                bytes.at,
            ));
        }
        if contents & METADATA == 0 {
            if !bytes.skip(metadata)? {
                return Ok(self.cut("within the metadata"));
            }
        } else if !self.metadata(bytes, metadata, contents & NEW_LIST != 0, order)? {
            return Ok(self.cut("within the metadata"));
        }
        let is_interleaved = contents & INTERLEAVED != 0;
        self.is_stale |= is_interleaved != self.is_interleaved;
        self.is_interleaved = is_interleaved;
        let length = Some(length - metadata).filter(|_| length != OPEN);
        self.raw_data(bytes, length, contents & RAW_DATA != 0, order)
    }

    fn cut(&self, place: &str) -> Next {
        Next::Cut(format!("{place} of segment {}", self.segments))
    }

    /// Reads metadata; returns whether they are complete.
    fn metadata(
        &mut self,
        bytes: &mut Bytes,
        length: u64,
        is_new_list: bool,
        order: Order,
    ) -> Result<bool, Failure> {
        let at = bytes.at;
        let metadata = bytes.take(length)?;
        if (metadata.len() as u64) < length {
            return Ok(false);
        }
        self.is_stale = true;
        let mut fields = MetadataFields {
            bytes: &metadata,
            at,
            order,
        };
        self.objects.read(&mut fields, is_new_list)?;
        Ok(true)
    }

    /// Reads the chunks of a segment, of known length or up to the end of the file.
    fn raw_data(
        &mut self,
        bytes: &mut Bytes,
        length: Option<u64>,
        is_there: bool,
        order: Order,
    ) -> Result<Next, Failure> {
        if !is_there || length == Some(0) {
            let is_whole = bytes.skip(length.unwrap_or(OPEN))?;
            return Ok(match is_whole {
                true => Next::Segment,
                false => self.cut("within the data"),
            });
        }
        if self.is_stale {
            self.chunk = laid_out(&mut self.objects, self.is_interleaved, bytes.at)?;
            self.is_stale = false;
        }
        let sizes = self.chunk.parts.iter().map(RawRows::size);
        let size = sizes.fold(0, u64::saturating_add);
        if size == 0 {
            let what = "a segment has data, but no channel for them";
            return Err(damaged(what, bytes.at));
        }
        let mut left = length.unwrap_or(OPEN);
        while left > 0 {
            let within = left.min(size);
            let end = bytes.at.saturating_add(within);
            for part in &self.chunk.parts {
                let there = end.saturating_sub(bytes.at).checked_div(part.width);
                let count = match (length, self.chunk.is_daqmx) {
                    // The last chunk of a closed segment may have fewer samples of each channel.
                    (Some(_), false) => {
                        (u128::from(part.count) * u128::from(within) / u128::from(size)) as u64
                    }
                    _ => part.count.min(there.unwrap_or(0)),
                };
                if !part.read(bytes, count, &mut self.objects, order)? {
                    let open = match length {
                        None => ", which was not closed: complete samples were read",
                        Some(_) => "",
                    };
                    let place = format!("within the data of segment {}{open}", self.segments);
                    return Ok(Next::Cut(place));
                }
            }
            if !bytes.skip(end.saturating_sub(bytes.at))? {
                return Ok(self.cut("within the data"));
            }
            left -= within;
        }
        Ok(Next::Segment)
    }
}

impl RawRows {
    fn size(&self) -> u64 {
        self.count.saturating_mul(self.width)
    }

    /// Reads a number of rows; returns whether all were there.
    fn read(
        &self,
        bytes: &mut Bytes,
        count: u64,
        objects: &mut TdmsObjects,
        order: Order,
    ) -> Result<bool, Failure> {
        if self.fields.is_empty() {
            return bytes.skip(count.saturating_mul(self.width));
        }
        let at_once = (PIECE / self.width.max(1)).max(1);
        let mut left = count;
        while left > 0 {
            let wanted = left.min(at_once) * self.width;
            let piece = bytes.take(wanted)?;
            for field in &self.fields {
                let object = &mut objects.all[field.object];
                let rows = piece.chunks_exact(self.width as usize);
                field.read(rows, object, order);
            }
            if (piece.len() as u64) < wanted {
                return Ok(false);
            }
            left -= left.min(at_once);
        }
        Ok(true)
    }
}

impl RawField {
    /// Appends the value in each row.
    fn read<'a>(
        &self,
        rows: impl Iterator<Item = &'a [u8]>,
        object: &mut objects::TdmsObject,
        order: Order,
    ) {
        let cells = rows.map(|row| &row[self.offset..self.offset + self.stored.width()]);
        if self.stored == RawType::Time {
            object
                .times_ns
                .extend(cells.map(|cell| time_ns(cell, order)));
            return;
        }
        let values = &mut object.series[self.series].values;
        match self.stored {
            RawType::Number(number) => values.extend(cells.map(|cell| number.read(cell, order))),
            RawType::Bit(number, bit) => values.extend(cells.map(|cell| {
                let all = number.read(cell, order) as i128;
                f64::from((all >> bit) as u8 & 1)
            })),
            RawType::Time => {}
        }
    }
}

/// Layout of the listed objects' data in a chunk.
fn laid_out(
    objects: &mut TdmsObjects,
    is_interleaved: bool,
    at: u64,
) -> Result<ChunkLayout, Failure> {
    let listed = objects.listed.iter().copied();
    let with_data = listed.filter(|place| objects.all[*place].has_data);
    let places: Vec<usize> = with_data.collect();
    let mut chunk = ChunkLayout::default();
    let (mut has_values, mut has_others) = (false, false);
    for place in &places {
        let object = &mut objects.all[*place];
        match object.index.clone() {
            Some(RawIndex::Values { stored, count }) => {
                has_values = true;
                let series = match stored {
                    RawType::Time => 0,
                    _ => object.series_of(objects::RAW),
                };
                let field = RawField {
                    object: *place,
                    series,
                    offset: 0,
                    stored,
                };
                chunk.values(field, count, is_interleaved, at)?;
            }
            Some(RawIndex::Other { bytes }) => {
                has_others = true;
                chunk.parts.push(RawRows {
                    count: bytes,
                    width: 1,
                    fields: Vec::new(),
                });
            }
            Some(RawIndex::Daqmx {
                count,
                scalers,
                widths,
            }) => {
                chunk.is_daqmx = true;
                chunk.buffers((*place, object), count, &scalers, &widths, at)?;
            }
            None => {}
        }
    }
    let is_mixed = chunk.is_daqmx && (has_values || has_others);
    if is_mixed || is_interleaved && has_others && places.len() > 1 {
        let what =
            "a segment mixes DAQmx raw data, or text among interleaved numbers, with other data";
        return Err(damaged(what, at));
    }
    chunk.parts.retain(|part| part.size() > 0);
    Ok(chunk)
}

impl ChunkLayout {
    /// Adds the values of a channel: in separate rows, or next to those of the others.
    fn values(
        &mut self,
        mut field: RawField,
        count: u64,
        is_interleaved: bool,
        at: u64,
    ) -> Result<(), Failure> {
        let width = field.stored.width() as u64;
        match self.parts.first_mut().filter(|_| is_interleaved) {
            Some(row) if row.count != count => {
                let what = "interleaved channels have different numbers of samples";
                return Err(damaged(what, at));
            }
            Some(row) => {
                field.offset = row.width as usize;
                row.width += width;
                row.fields.push(field);
            }
            None => self.parts.push(RawRows {
                count,
                width,
                fields: vec![field],
            }),
        }
        Ok(())
    }

    /// Adds the scalers of an object with values in buffers of rows.
    fn buffers(
        &mut self,
        (place, object): (usize, &mut objects::TdmsObject),
        count: u64,
        scalers: &[Scaler],
        widths: &[u64],
        at: u64,
    ) -> Result<(), Failure> {
        if self.parts.is_empty() {
            let empty = |width: &u64| RawRows {
                count: 0,
                width: *width,
                fields: Vec::new(),
            };
            self.parts = widths.iter().map(empty).collect();
        }
        for scaler in scalers {
            let end = scaler.offset as u64 + scaler.stored.width() as u64;
            let part = self.parts.get_mut(scaler.buffer);
            let part = part.filter(|part| end <= part.width && widths.len() > scaler.buffer);
            let Some(part) = part else {
                let what = "a DAQmx scaler is outside its raw data";
                return Err(damaged(what, at));
            };
            part.count = part.count.max(count);
            part.fields.push(RawField {
                object: place,
                series: object.series_of(scaler.scale_id),
                offset: scaler.offset,
                stored: scaler.stored,
            });
        }
        Ok(())
    }
}
