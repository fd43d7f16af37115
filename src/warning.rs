//! What a user should know about a result.

use serde::Serialize;

/// Something that a user should know, with a code that scripts can rely on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Warning {
    /// Stable code, one of `CODES` (a test compares them with the sources).
    pub code: &'static str,
    /// For people.
    pub message: String,
}

impl Warning {
    /// A warning.
    #[must_use]
    pub fn new(code: &'static str, message: impl Into<String>) -> Self {
        Self {
            code,
            message: message.into(),
        }
    }
}

/// Every code, what it means, and what to do, by where it comes from. `docs/warnings.md` is written from this list.
#[rustfmt::skip]
pub(crate) const CODES: &[(&str, &[[&str; 3]])] = &[
    ("Compensate and harmonics", &[
        ["beyond-rated-torque", "the torque lies more than 1.5 times beyond the transducer's rated torque", "check unit, gain and zero of the channel"],
        ["band-lost-in-noise", "part of the band does not rise above the record's noise, which the compensation multiplies there", "choose a lower --band"],
        ["components-lost-in-noise", "components do not exceed twice their own uncertainty", "average over a longer record, or take them as zero"],
        ["direction-unknown", "the speed is not significantly different from zero over part of the record, where a friction depends on its sign", "take the torque there as known to the size of the friction only"],
        ["empty-plot", "no sample lies within --plot-range", "choose a range within the record"],
        ["fundamental-off", "another fundamental near the given one fits the record better", "add --refine"],
        ["mostly-noise", "most of the result is noise", "choose a lower --band, or record with less noise"],
        ["noise-unknown", "the noise of the record cannot be determined", "choose a lower --band if the result looks noisy"],
        ["not-recovered", "samples do not determine the torque, as at the limit of the recorder or within a gap", "take the torque near them as unknown"],
        ["order-or-mains", "an order of the shaft coincides with a line of the mains", "record at another speed"],
        ["orders-beyond-band", "orders lie where a compensated record was filtered", "compensate with a higher --band, or give the recorded channel and --stand"],
        ["orders-above-nyquist", "orders above half the sampling rate were left out", "record at a higher rate"],
        ["speed-changes", "the speed changes over the record, so that the components are averages", "take a part of constant speed with --range"],
        ["phase-hidden", "the signal at the frequency of a line hides the line's phase, so that part of the line is left", "record without excitation at this frequency"],
        ["resonance-above-nyquist", "the resonance lies above half the sampling rate, so that its ringing folds into the record", "record faster, or behind a low-pass"],
        ["resampled-gaps", "gaps in the time stamps were bridged by straight lines", "look at these places, or cut the record there"],
        ["short-record", "every sample depends on the extrapolation beyond the record's ends", "record for longer"],
        ["signal-above-band", "much of the signal lies above the band and is left out", "choose a higher --band"],
    ]),
    ("Stand file", &[
        ["residues-do-not-add-up", "the residues of [[modes]] leave much of the response at rest to modes above the band", "residues are parts of 1: check them"],
        ["scale-in-heading", "the heading of the channel names a scale such as x10, which was not applied", "say the unit with the scale, or rename the column"],
        ["calibration-not-used", "a record in strain was taken through the beam's drawing although a calibration is given", "record in the unit of the calibration"],
        ["damping-above-one", "the damping ratio is above 1", "write 7 % as 0.07"],
        ["zero-not-used", "the record at no load is given in another quantity than the record's, and was not subtracted", "give it in the record's unit"],
        ["gain-not-used", "a calibration of recorded volts does not need the gain that is given", "leave the gain out, or divide the calibration by it"],
        ["gain-assumed", "the gain between bridge and record is not given; 1 was assumed", "add [recorder] gain"],
        ["modulus-unusual", "the elastic modulus is that of no usual beam", "check its unit: steel has 200 GPa"],
    ]),
    ("Simulate and diagnose", &[
        ["no-record-held-out", "no hold-out record was given; the last 30 % of each training record are held out instead", "give --holdout"],
        ["records-apart", "no one stand fits both training and hold-out records", "use records of one stand and one setting"],
        ["resampled", "channels with other time stamps were interpolated to one grid", "record them with one clock"],
        ["training-leaves-constants-open", "the training records do not determine all constants", "train on records that excite the resonance"],
        ["unit-assumed", "a column without a unit was taken in the unit that the stand takes", "give --unit"],
    ]),
    ("Identify", &[
        ["amplitude-dependent", "frequency or damping changes with the amplitude", "quote it with its amplitude, or look for the cause with diagnose"],
        ["anchor-not-needed", "torque and motion determine all three constants; the declared one was not used", "leave out --inertia or --stiffness"],
        ["anchor-without-std", "the declared constant has no standard uncertainty, so that those of the others leave it out", "declare it with std"],
        ["at-bound", "a parameter lies at its bound: it is not identifiable from these data", "leave it out, or record data that determine it"],
        ["close-lines", "a line close to the mode is left in the residual", "try --modes"],
        ["curve", "the readings follow a curve, so that the constants hold at no load only", "use the curve at large loads"],
        ["decays-left-out", "there are more decays than are used", "choose them with --range"],
        ["dry-friction-by-direction", "a friction that differs by direction cannot be told from an offset of the torque", "check the zero of the torque"],
        ["hit-left-out", "a hit of the hammer was left out", "repeat the hit"],
        ["impossible", "a fitted constant has a sign that no stand has", "check the signs of the channels"],
        ["leads", "the measured signal leads the applied one, which is impossible", "check --applied and --measured"],
        ["leakage", "the segments are too short for a narrow mode, whose damping is too large", "choose a longer --segment"],
        ["level-dependent", "the response differs between levels", "look for the cause with diagnose"],
        ["mains-taken-off", "steady lines of the mains were fitted beside the decay and taken off", "record for longer if one of them is the stand's own"],
        ["no-unloading", "there are no readings while unloading, so that the hysteresis is unknown", "unload in steps, too"],
        ["noise-before-resonance", "the residual follows the resonance: the stand is driven by something else too, or the input is recorded with noise, which makes the gain too small", "reduce the noise of --applied, or excite more"],
        ["noisy-motion", "noise is a notable part of a regressor; it was corrected for", "use a longer window or a better sensor"],
        ["nonlinear", "the response has power at frequencies that were not applied: the stand is nonlinear", "look for the cause with diagnose"],
        ["undamped-left-out", "a mode without damping was not written into the stand file", "choose fewer --modes, or record for longer"],
        ["residues-unknown", "a decay shows several modes, but not their parts in the response to a torque", "add the residues, or use identify response"],
        ["not-anchored", "only ratios of the constants are determined", "declare the inertia or the stiffness"],
        ["not-converged", "the fit stopped before its minimum", "check the result, or choose another start"],
        ["not-viscous", "another law of damping fits the envelope better than viscous damping", "look for the cause with diagnose"],
        ["one-direction", "the body moves in one direction only: dry friction and offset are one number", "run it both ways"],
        ["one-series", "the loads were applied once, so that the repeatability is unknown", "repeat the series"],
        ["one-weight", "one load beside no load shows no curve", "apply other loads as well"],
        ["poor-fit", "the model leaves much of the data unexplained", "check the columns; choose another range, band or degree"],
        ["second-stroke", "the hammer struck twice; the recorded force includes both strokes", "repeat the hit if the coherence is low"],
        ["speed-unknown", "the speed is known but for a constant, so that the offset includes friction", "record position or speed"],
        ["turned", "the phase of the mode differs from that of the plain equation", "check for a delay or another mode"],
    ]),
    ("Time axis", &[
        ["clock-jump", "one step is longer than all of the rest of the record", "split the file there"],
        ["irregular-stamps", "time steps vary", "use --resample, or --rate if the stamps are rounded"],
        ["missing-rate", "nothing says how the samples lie in time", "give --rate or --time-column"],
        ["no-time-axis", "the horizontal axis is not time", "give --rate, or choose another file"],
        ["non-finite-stamps", "cells of the time column hold no number", "repair them"],
        ["rate-contradicts-stamps", "the stated rate differs from that of the time stamps", "find out which is right, and give it with --rate"],
        ["rate-drift", "the rate of the first rows differs from the mean rate", "give --rate"],
        ["rate-joins-gaps", "--rate joins the samples on both sides of gaps or backward steps in the time stamps", "leave out --rate if the stamps are right; bridge gaps with --fill, or leave them out with --range"],
        ["rate-overrides-stamps", "--rate differs from the rate of the stamps; --rate was used", "leave out --rate if the stamps are right"],
        ["repeated-stamps", "a time stamp equals the one before it", "remove the sample, or give --rate"],
        ["rounded-time-stamps", "the stamps are rounded to a quarter of a step or more; the rate is that of all of them", "nothing, or give --rate if it is known better"],
        ["time-assumed", "the time axis is assumed", "confirm it with --time-column and --time-unit, or give --rate"],
        ["time-backwards", "a time stamp lies before the one before it", "split the file there"],
        ["time-falls", "a column named as time falls too often to be time and was taken as a channel", "choose the time with --time-column, or give --rate"],
        ["time-gaps", "samples are missing between time stamps", "use --fill linear for short gaps"],
        ["time-jitter", "time steps differ by more than 1 %", "use --resample"],
        ["time-left-out", "a column named as time does not run as the time of the rows does and was left out", "choose another with --time-column"],
    ]),
    ("Samples", &[
        ["channel-copy", "a channel equals another one", "choose one of them"],
        ["channel-multiple", "a channel is a multiple of another one but for rounding", "choose one of them"],
        ["clipped", "the signal is cut off at its highest or lowest value", "record with a larger range"],
        ["coarse-quantisation", "fewer than 256 steps of the resolution lie in the range used", "use a smaller range of the recorder"],
        ["constant-channel", "all samples are the same", "check the connection, or choose another channel"],
        ["identical-files", "files are the same, byte by byte", "leave out the copies"],
        ["mains-lines", "lines at multiples of 50 or 60 Hz stand out", "check grounding and shielding, or declare the effect mains-pickup"],
        ["non-finite", "cells hold no number, or no finite one", "repair them, or cut the record there"],
        ["repeated-samples", "samples repeat the one before more often than the resolution explains", "record the source at its own rate"],
        ["stuck-channel", "the signal stands still for a while", "check cables and transmitters, and leave that part out"],
    ]),
    ("Reading text", &[
        ["extra-cells", "rows have more cells than there are headings", "check the headings"],
        ["filled", "missing samples were filled in, as --fill asks", "do not trust the result there"],
        ["first-samples-only", "only the first samples were looked at", "cut the file into parts if the rest matters"],
        ["lines-skipped", "lines among the rows are no rows and were left out", "check these lines"],
        ["sample-count", "the head says another number of rows than there are", "copy or export the file again"],
        ["samples-missing", "the header announces another number of samples than there are", "copy or export the file again"],
        ["screen-steps", "values are steps of the oscilloscope's screen", "export in another mode if they could not be scaled"],
        ["truncated-last-line", "the file ends in the middle of its last line, which was left out", "copy the file again"],
        ["unended-last-line", "the last line has no line end, unlike the others: its last number may be cut", "do not trust the last sample if the file was cut"],
        ["unit-overrides-heading", "--unit differs from the unit in the heading; --unit was used", "leave out --unit if the heading is right"],
        ["unreadable-characters", "some bytes are none of the encoding", "check the encoding"],
        ["zero-bytes", "zero bytes in the text were left out", "copy the file again"],
    ]),
    ("Reading MCAP", &[
        ["mcap-checksum", "a checksum of the file does not fit: some of its bytes are damaged", "recover the file from its source"],
        ["mcap-clock", "the clocks of the messages disagree", "see the message"],
        ["mcap-conflict", "schemas or channels are declared again with another content; the first was used", "record them under separate topics"],
        ["mcap-count", "messages, chunks or attachments that the file counts are not there", "recover the file from its source"],
        ["mcap-damaged-chunk", "a chunk is damaged and was left out", "recover the file from its source"],
        ["mcap-damaged-record", "a record is damaged and was left out", "recover the file from its source"],
        ["mcap-lost", "messages were lost", "recover the file from its source"],
        ["mcap-more-losses", "there were more losses of the same kind", "see the ones before"],
        ["mcap-out-of-order", "samples came after later ones and were put in order", "nothing, if the stamps are right"],
        ["mcap-skipped", "messages were left out", "see the message"],
        ["mcap-too-late", "samples came too late to be put in order and were left out", "sort the file by time first"],
        ["mcap-truncated", "the file ends without its end record; what is whole was read", "recover the file from its source"],
        ["mcap-unknown-channel", "messages belong to no declared channel", "recover the file from its source"],
        ["mcap-unreadable", "messages could not be read", "check their schema"],
        ["mcap-without-item", "messages do not have the item asked for", "check the name of the item"],
        ["samples-not-read", "numbers are only listed", "ask for them one by one with extract"],
    ]),
];
