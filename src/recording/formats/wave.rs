//! WAV: RIFF with PCM of 8 to 32 bits or floating point, and its 64-bit forms RF64 and BW64 (EBU Tech 3306, ITU-R
//! BS.2088).
//!
//! Samples are fractions of full scale, which no field defines: `--full-scale "10 V"` does.

use super::bytes::{Bytes, Number, Order};
use super::{Content, Format, channel, cut, damaged, plausible_rate};
use crate::failure::{ErrorCode, Failure};
use crate::io::Reading;
use crate::recording::TimeAxis;
use crate::unit::OF_FULL_SCALE;
use crate::warning::WarningCode;

pub(super) const WAVE: Format = Format {
    name: "wav",
    called: "a WAV file",
    is,
    takes: &["--full-scale"],
    read,
};

/// Data length not filled in by a recorder, or given in a chunk `ds64`.
const UNKNOWN: u32 = u32::MAX;
/// Maximum size of a non-data chunk kept in memory.
const LONGEST_CHUNK: u64 = 1 << 16;

fn is(head: &[u8]) -> bool {
    let is_riff = [b"RIFF", b"RF64", b"BW64"]
        .iter()
        .any(|id| head.starts_with(*id));
    is_riff && head.get(8..12) == Some(b"WAVE")
}

/// Storage of samples.
struct WaveLayout {
    number: Number,
    /// Numeric value of full scale, and of zero.
    full: f64,
    zero: f64,
    channels: usize,
    rate_hz: f64,
    dialect: String,
}

impl WaveLayout {
    /// Parses a chunk `fmt `.
    fn of(chunk: &[u8], at: u64) -> Result<Self, Failure> {
        let u16_at = |place: usize| {
            let bytes = chunk.get(place..place + 2)?;
            Some(u16::from_le_bytes(bytes.try_into().ok()?))
        };
        let short = || damaged("the chunk \"fmt \" is too short", at);
        let mut tag = u16_at(0).ok_or_else(short)?;
        let channels = usize::from(u16_at(2).ok_or_else(short)?);
        let rate = chunk.get(4..8).ok_or_else(short)?;
        let rate_hz = Number::Unsigned(4).read(rate, Order::Little);
        let block = usize::from(u16_at(12).ok_or_else(short)?);
        let bits = usize::from(u16_at(14).ok_or_else(short)?);
        if tag == 0xfffe {
            // An extensible header starts its identifier with the actual format.
            tag = u16_at(24).ok_or_else(short)?;
        }
        let width = block.checked_div(channels).unwrap_or(0);
        let (number, full, zero, kind) = match (tag, width) {
            (1, 1) => (Number::Unsigned(1), 128.0, 128.0, "PCM"),
            (1, 2..=4) => {
                let full = 2.0_f64.powi(8 * width as i32 - 1);
                (Number::Signed(width), full, 0.0, "PCM")
            }
            (3, 4) => (Number::Float32, 1.0, 0.0, "floating point"),
            (3, 8) => (Number::Float64, 1.0, 0.0, "floating point"),
            _ => {
                return Err(ErrorCode::NotARecording.failed(format_args!(
                    "the WAV format {tag} with {bits} bits is not supported; convert \
                     it to PCM (sox IN.wav -e signed -b 24 OUT.wav)"
                )));
            }
        };
        if width * channels != block || plausible_rate(rate_hz).is_none() {
            return Err(damaged("the chunk \"fmt \" is inconsistent", at));
        }
        let plural = if channels == 1 { "" } else { "s" };
        Ok(Self {
            number,
            full,
            zero,
            channels,
            rate_hz,
            dialect: format!("WAV, {bits}-bit {kind}, {channels} channel{plural}"),
        })
    }

    /// Size in bytes of one sample of all channels.
    fn frame(&self) -> usize {
        self.number.width() * self.channels
    }
}

fn read(bytes: &mut Bytes, reading: &Reading) -> Result<Content, Failure> {
    bytes.skip(12)?;
    let mut layout = None;
    let mut long = None;
    loop {
        let Some(head) = bytes.array::<8>()? else {
            return Err(damaged("there is no chunk \"data\"", bytes.at));
        };
        let (id, size) = (&head[..4], Number::Unsigned(4));
        let size = size.read(&head[4..], Order::Little) as u32;
        let at = bytes.at;
        if id == b"data" {
            let Some(layout) = layout else {
                return Err(damaged("no chunk \"fmt \" before the data", at));
            };
            let known = match (size, long) {
                (UNKNOWN, Some(long)) => Some(long),
                (0 | UNKNOWN, _) => None,
                (size, _) => Some(u64::from(size)),
            };
            return data(bytes, &layout, known, reading);
        }
        if u64::from(size) > LONGEST_CHUNK {
            bytes.skip(u64::from(size) + u64::from(size % 2))?;
            continue;
        }
        let chunk = bytes.take(u64::from(size) + u64::from(size % 2))?;
        match id {
            b"fmt " => layout = Some(WaveLayout::of(&chunk, at)?),
            b"ds64" => {
                let size = chunk
                    .get(8..16)
                    .map(|b| u64::from_le_bytes(b.try_into().unwrap_or_default()));
                long = size;
            }
            _ => {}
        }
    }
}

/// Reads the samples, of known length or up to the end of the file.
fn data(
    bytes: &mut Bytes,
    layout: &WaveLayout,
    length: Option<u64>,
    reading: &Reading,
) -> Result<Content, Failure> {
    let stored = bytes.take(length.unwrap_or(u64::MAX))?;
    let frames = stored.len() / layout.frame();
    let (scale, unit) = match &reading.full_scale {
        Some(full) => (full.value / layout.full, full.unit.text.as_str()),
        None => (1.0 / layout.full, OF_FULL_SCALE),
    };
    let width = layout.number.width();
    let samples = |place: usize| -> Vec<f64> {
        let frames = stored.chunks_exact(layout.frame());
        let each = frames.map(|frame| layout.number.read(&frame[place * width..], Order::Little));
        each.map(|value| (value - layout.zero) * scale).collect()
    };
    let axis = TimeAxis::of_header("sample rate", layout.rate_hz, None);
    let channels = (0..layout.channels).map(|place| {
        let name = format!("channel {}", place + 1);
        channel(&name, Some(unit), samples(place), axis.clone())
    });
    let mut content = Content {
        dialect: layout.dialect.clone(),
        channels: channels.collect(),
        ..Content::default()
    };
    let is_part = stored.len() % layout.frame() != 0;
    if let Some(length) = length.filter(|length| *length > stored.len() as u64) {
        let announced = length / layout.frame() as u64;
        content.lost = Some(cut(&format!("{frames} of {announced} samples are present")));
    } else if is_part {
        content.lost = Some(cut("the last sample is incomplete"));
    }
    if reading.full_scale.is_none() {
        content.warnings.push(WarningCode::FullScaleUnknown.warning(
            "the samples are fractions of full scale (-1 to 1), which a WAV file does not state; give it with its \
             unit, as --full-scale \"10 V\"",
        ));
    }
    Ok(content)
}
