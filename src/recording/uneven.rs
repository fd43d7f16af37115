//! Stamps without a usual step, as of variable-step solvers and event loggers, and records without a rate.

use torqcomp_decimal::digits;

use super::Channel;
use super::axis::{REVERSED, SampleStep, falls, no_stamps};
use crate::failure::{ErrorCode, Failure};
use crate::print::plural;

/// Mean step of stamps that rise, however unevenly.
pub(super) fn mean_step(stamps: &[f64]) -> Option<SampleStep> {
    let span = stamps.last()? - stamps.first()?;
    let rises = stamps.windows(2).all(|pair| pair[1] >= pair[0]);
    (rises && span > 0.0).then(|| SampleStep {
        step: span / (stamps.len() - 1) as f64,
        relative_std: None,
    })
}

/// What to do about stamps in seconds without a usual step; `None` if they do not rise.
pub(crate) fn advice_for_uneven(stamps_s: &[f64]) -> Option<String> {
    let mean = mean_step(stamps_s)?;
    let hz = digits::text(1.0 / mean.step, 4);
    Some(format!(
        "if they are right, interpolate with --resample --rate HZ, at about their mean rate of {hz} Hz; give --rate HZ \
         alone only if the samples are uniform and the stamps wrong"
    ))
}

/// Text about stamps without a step, and what to do.
pub(super) fn no_step(heading: &str, times: &[f64]) -> String {
    let why = match times {
        [] | [_] => {
            return format!(
                "\"{heading}\" has {}, so the sampling rate is unknown; give it with --rate HZ",
                plural(times.len(), "stamp")
            );
        }
        _ if falls(times) => return format!("\"{heading}\": {REVERSED}"),
        _ if times.windows(2).all(|pair| pair[1] <= pair[0]) => "do not rise",
        _ => {
            "have no usual step: fewer than half of their steps are within 25 % of the median one; interpolate with \
             --resample --rate HZ if they are right"
        }
    };
    format!(
        "the stamps in \"{heading}\" {why}; give the rate with --rate HZ, another column with --time-column, or another clock \
         of an MCAP file with --time log, publish or header"
    )
}

/// Failure for a channel whose rate is unknown.
pub(super) fn without_rate(channel: &Channel) -> Failure {
    let given = "give it with --rate HZ, or name the column of stamps with --time-column";
    let why = match channel.axis.stamps_s.as_deref() {
        Some(stamps) if falls(stamps) => REVERSED.to_owned(),
        Some(stamps) => {
            let advice = advice_for_uneven(stamps).unwrap_or_else(|| given.to_owned());
            format!("its time stamps have no usual step; {advice}")
        }
        None => no_stamps(&channel.axis, given),
    };
    ErrorCode::TimeUnknown.failed(format_args!(
        "the sampling rate of \"{}\" is unknown, because {why}",
        channel.name
    ))
}
