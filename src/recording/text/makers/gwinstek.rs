//! GW Instek exports. In the mode `Fast` they contain screen steps instead of volts, 25 per division
//! (GDS-2000 user manual, page 121: "one division includes 25 points of horizontal and vertical data";
//! GDS-2000A user manual, page 187: fast data are "recorded as integers").

use super::{Maker, Rule};
use crate::failure::Failure;
use crate::io::Reading;
use crate::recording::text::chunks::Chunks;
use crate::recording::text::keys;
use crate::recording::text::table::Layout;
use crate::recording::{Channel, Recording};
use crate::warning::{Warning, WarningCode};

/// Steps per division of the screen.
const STEPS: f64 = 25.0;

const MAKER: Maker = Maker::of_seconds("GW Instek").with_reader(read);

/// The rule.
pub const ALL: &[Rule] = &[(MAKER, |head| {
    head.any(|line| line.starts_with("Waveform Data"))
        && (head.starts(0, "Format,1.") || head.starts(0, "Memory Length,"))
        || head.any(|line| line.starts_with("IntpDistance"))
})];

fn read(chunks: &mut Chunks, reading: &Reading) -> Result<Recording, Failure> {
    let layout = Layout::find(chunks, 1, MAKER.hints, reading)?;
    let mut recording = crate::recording::text::general(chunks, layout, MAKER.hints, reading)?;
    let details = std::mem::take(&mut recording.details);
    let (mut scaled, mut bare) = (Vec::new(), Vec::new());
    for (place, channel) in recording.channels.iter_mut().enumerate() {
        let said = |key: &str| of_channel(&details, key, place);
        // Older models have no modes.
        let is_fast = said("Mode").is_none_or(|mode| mode == "Fast");
        if !is_fast || !is_whole(channel) {
            continue;
        }
        match volts_per_step(&said) {
            Some(step) => {
                channel.samples.iter_mut().for_each(|value| *value *= step);
                scaled.push(channel.name.clone());
            }
            None => {
                (channel.unit, channel.unit_text) = (None, None);
                bare.push(channel.name.clone());
            }
        }
    }
    recording.warnings.extend(warning(&scaled, |names| {
        format!(
            "{names}: the file contains steps of the screen; they were scaled with 25 steps per division and the \
             \"Vertical Scale\" of the header"
        )
    }));
    recording.warnings.extend(warning(&bare, |names| {
        format!(
            "{names}: the file contains steps of the screen, not the unit in its header, and \"Vertical Scale\", \
             \"Vertical Position\" and \"Probe\" do not determine the size of a step; save it in the mode Detail, or \
             scale it yourself"
        )
    }));
    recording.details = details;
    Ok(recording)
}

fn warning(names: &[String], text: impl Fn(&str) -> String) -> Option<Warning> {
    let quoted: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
    (!names.is_empty()).then(|| WarningCode::ScreenSteps.warning(text(&quoted.join(", "))))
}

/// Whether all samples are integers.
fn is_whole(channel: &Channel) -> bool {
    let mut finite = channel.samples.iter().filter(|value| value.is_finite());
    finite.all(|value| value.fract() == 0.0)
}

/// The value of a key for a channel: the keys are repeated above each of them.
fn of_channel<'a>(details: &'a [(String, String)], key: &str, place: usize) -> Option<&'a str> {
    let (_, values) = details.iter().find(|(name, _)| name == key)?;
    let mut values = values
        .split(',')
        .map(str::trim)
        .filter(|value| *value != key);
    values.nth(place)
}

/// Volts (or amperes) per step, if the header is unambiguous: the trace is not shifted (sources differ
/// on whether the steps count from the middle of the screen or from the zero of the trace), and no
/// probe attenuates.
fn volts_per_step<'a>(said: &impl Fn(&str) -> Option<&'a str>) -> Option<f64> {
    let number = |key: &str| keys::quantity(said(key)?, b'.').map(|(value, _)| value);
    let scale = number("Vertical Scale").filter(|scale| *scale > 0.0)?;
    let is_centred = number("Vertical Position") == Some(0.0);
    let probe = number("Probe Ratio").or_else(|| number("Probe"));
    (is_centred && probe.is_none_or(|probe| probe == 1.0)).then_some(scale / STEPS)
}
