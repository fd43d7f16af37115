//! Warnings about a result.

use schemars::JsonSchema;
use serde::Serialize;

/// Something that a user should know, with a code that scripts can rely on.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Warning {
    /// Stable code of the warning.
    pub code: &'static str,
    /// Human-readable message.
    pub message: String,
}

/// Declares the codes, and the list from which `docs/warnings.md` is generated.
macro_rules! codes {
    ($($group:literal { $($name:ident = $code:literal: $meaning:literal, $remedy:literal;)* })*) => {
        /// What a warning is about.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum WarningCode {
            $($(#[doc = concat!("`", $code, "`")] $name,)*)*
        }

        impl WarningCode {
            /// The stable code.
            pub const fn name(self) -> &'static str {
                match self {
                    $($(Self::$name => $code,)*)*
                }
            }
        }

        /// Every code with its meaning and remedy, grouped by origin.
        pub(crate) const CODES: &[(&str, &[[&str; 3]])] =
            &[$(($group, &[$([$code, $meaning, $remedy],)*]),)*];
    };
}

impl WarningCode {
    /// A warning of this kind.
    pub fn warning(self, message: impl Into<String>) -> Warning {
        Warning {
            code: self.name(),
            message: message.into(),
        }
    }
}

codes! {
    "Compensate and harmonics" {
        BeyondRatedTorque = "beyond-rated-torque": "the torque exceeds 1.5 times the transducer's rated torque", "check unit, gain and zero of the channel";
        BelowRatedTorque = "below-rated-torque": "the torque stays below 0.5 % of the transducer's rated torque", "check unit and gain of the channel";
        BandLostInNoise = "band-lost-in-noise": "part of the band is no larger than the record's noise, which the compensation amplifies", "choose a lower --band";
        ComponentsLostInNoise = "components-lost-in-noise": "components are below twice their own uncertainty", "average over a longer record, or treat them as zero";
        DampingDiffers = "damping-differs": "the record's resonance at the declared frequency has another damping ratio", "determine the stand's constants with identify decay";
        DirectionUnknown = "direction-unknown": "the speed is not significantly different from zero over part of the record, so the direction of the friction is unknown there", "treat the torque there as uncertain by the friction torque";
        EndsFeltFar = "ends-felt-far": "the inverse of an effect such as structural damping is infinitely long, so the ends of the record affect samples far from them", "discard more at both ends, or record from rest to rest";
        EmptyPlot = "empty-plot": "--plot-range contains no samples", "choose a range within the record";
        FundamentalOff = "fundamental-off": "a fundamental close to the given one fits the record better", "add --refine";
        LinesDecideBand = "lines-decide-band": "the upper end of the band is set by a few narrow lines, or by what lies far above the rest, which may be interference", "if they are not torque, give the --band named in the message";
        LoadChanges = "load-changes": "the mean torque changes over the record, so the components are averages over different loads", "select a part of constant load with --range";
        MeanUnknown = "mean-unknown": "an effect such as an AC coupling does not pass a constant, so the mean of the torque and its slope over the record are unknown", "record with DC coupling if you need them";
        MostlyAmplified = "mostly-amplified": "the result is more than 10 times the record", "check the mechanics of the stand, the sampling rate and --band";
        MostlyNoise = "mostly-noise": "most of the result is noise", "choose a lower --band, or record with less noise";
        NoiseUnknown = "noise-unknown": "the noise of the record cannot be estimated", "choose a lower --band if the result looks noisy";
        NotRecovered = "not-recovered": "the torque cannot be recovered from some samples, such as those clipped by the recorder or within a gap", "treat the torque near them as unknown";
        OrderOrMains = "order-or-mains": "an order of the shaft coincides with a line of the mains", "record at another speed";
        OrdersBeyondBand = "orders-beyond-band": "orders lie above the band of a compensated record", "compensate with a higher --band, or give the recorded channel and --stand";
        OrdersAboveNyquist = "orders-above-nyquist": "orders above half the sampling rate were left out", "record at a higher rate";
        AmplitudeChanges = "amplitude-changes": "the amplitude of a component changes over the record, so the components are averages", "select a shorter part with --range";
        LineBesideOrder = "line-beside-order": "a line that is no order lies beside one and makes its component wrong", "add its order to --orders, or record for longer";
        LinesBetweenOrders = "lines-between-orders": "strong lines lie between the orders: the given fundamental may be a multiple of the speed", "give --fundamental as the speed, or add the orders";
        OrdersExplainLittle = "orders-explain-little": "most of the record is neither orders of the fundamental nor noise", "select a part of constant speed with --range, or give its speed";
        SpeedChanges = "speed-changes": "the speed changes or fluctuates over the record, so the components are averages", "select a part of constant speed with --range";
        PhaseHidden = "phase-hidden": "the signal at the frequency of a line, or of spikes, masks its phase, so part of it remains", "record without excitation at this frequency";
        ResonanceElsewhere = "resonance-elsewhere": "the record shows no resonance at the declared frequency, but one elsewhere", "determine the stand's constants with identify decay";
        ResonanceAboveNyquist = "resonance-above-nyquist": "the resonance is above half the sampling rate, so its ringing aliases into the record", "record at a higher rate, or through a low-pass";
        ResampledGaps = "resampled-gaps": "gaps in the time stamps were filled by linear interpolation", "check these places, or cut the record there";
        ResampledUneven = "resampled-uneven": "stamps that nearly coincide were interpolated by straight lines", "give --rate if the stamps are times of arrival";
        ShortRecord = "short-record": "every sample depends on the extrapolation beyond the record's ends", "record for longer";
        SignalAboveBand = "signal-above-band": "much of the signal lies above the band and is removed", "choose a higher --band";
    }
    "Stand file" {
        ResiduesDoNotAddUp = "residues-do-not-add-up": "the residues of [[modes]] leave much of the static response to modes above the band", "check them: residues are fractions of 1";
        DiagnosisIncomplete = "diagnosis-incomplete": "the stand file was written by a diagnosis that did not fully explain its records", "compare it with the previous stand file on a record with a known torque, or diagnose again with other records";
        ScaleInHeading = "scale-in-heading": "the heading of the channel contains a scale factor such as x10, or a line above whole numbers gives one; it was not applied", "scale the column and rename it, or remove the line";
        CalibrationNotUsed = "calibration-not-used": "a record in strain was converted with the beam's dimensions although a calibration is given", "record in the unit of the calibration";
        DampingAboveOne = "damping-above-one": "the damping ratio is above 1", "write 7 % as 0.07";
        MeganewtonMetres = "meganewton-metres": "a torque is in MN m, which is easily written for mN m", "give --unit \"mN m\", or confirm MN m";
        VoltsUnusual = "volts-unusual": "most of a record in V exceeds 30 V, more than any bridge amplifier outputs", "give --unit mV if it is in mV";
        ZeroFarFromRecord = "zero-far-from-record": "the given zero is more than 10 times as large as any sample of the record", "check the zero and its unit";
        ZeroNotUsed = "zero-not-used": "the zero is given in a different quantity from the record, and was not subtracted", "give it in the unit of the record";
        GainNotUsed = "gain-not-used": "a calibration in recorded volts needs no gain; the given gain was not used", "omit the gain, or divide the calibration by it";
        LowPassOrderAssumed = "low-pass-order-assumed": "the order of the recorder's low-pass is not given; 1 was assumed", "add low_pass_order";
        GainAssumed = "gain-assumed": "the gain between bridge and record is not given; 1 was assumed", "add [recorder] gain";
        GageFactorUnusual = "gage-factor-unusual": "the gage factor is not that of any common gage", "check it: metal foil has about 2";
        ModulusUnusual = "modulus-unusual": "the elastic modulus is not that of any common beam material", "check its unit: steel has 200 GPa";
    }
    "Simulate and diagnose" {
        ShiftExplainsMore = "shift-explains-more": "a time shift between the channels explains the records better than any effects", "record both channels with one recorder and the same filters, or declare the delay named in the message";
        TwoClocks = "two-clocks": "the two channels drift apart, as if recorded with separate clocks", "record both channels with one clock";
        ShiftOrEffect = "shift-or-effect": "a time shift of the applied channel explains the records about as well as the effects found", "record both channels with one recorder and the same filters";
        FreeBody = "free-body": "the body has no spring: a known spring ties both it and the model to the measured motion, and the errors are those of the applied quantity", "use constants and effects as they are; to predict the motion, add the spring that the stand will have";
        NoRecordHeldOut = "no-record-held-out": "no hold-out record was given; the last 30 % of each training record, or the last decay, are held out instead", "give --holdout or --holdout-decay";
        DeclaredNotRefitted = "declared-not-refitted": "the declared effects, refitted to the training records, diverge on the hold-out records; the stand file is used as it is", "check the declared effects; diagnose without them and compare";
        GainDiffers = "gain-differs": "the static gain from known loads, or from a response test, differs from that of the stand file, units or other records, which is kept", "check the calibration, and the lever arm of loads or forces";
        RunningDiffers = "running-differs": "in use, the resonance is not that of the fitted stand", "compare with a record at another speed, as the torque may have a peak there; fit records taken as the stand is used, with the same clamping, temperature and parts mounted";
        ResonanceHidden = "resonance-hidden": "a running record does not show the resonance of the stand", "record for longer, at a higher rate, while the speed rises through the resonance, or with a rougher torque";
        LoadsContradictEffects = "loads-contradict-effects": "known loads do not confirm the effects found", "record hits of other sizes, and examine the loads with identify static";
        RecordsApart = "records-apart": "no single stand fits both training and hold-out records", "use records of one stand and one setting";
        NoTorquesTried = "no-torques-tried": "the stand file does not say how torques in the stand affect the record, so diagnose did not try them", "give mode shapes instead of residues, or record the displacement";
        Resampled = "resampled": "channels with different time stamps were interpolated to a common grid", "record them with one clock";
        EffectsLeaveConstantsOpen = "effects-leave-constants-open": "with the effects found, the training records determine a constant of the stand much less well than without them", "keep the constants from a record without the effects, or train on more levels";
        TrainingLeavesConstantsOpen = "training-leaves-constants-open": "the training records do not determine all constants", "train on records that excite the resonance";
        UnitAssumed = "unit-assumed": "a column without a unit was assumed to be in the unit that the stand expects", "give --unit";
    }
    "Identify" {
        AcCoupledOrDrift = "ac-coupled-or-drift": "a channel of a response test drifts or is AC coupled, which looks like a slow mode", "record with DC coupling";
        AmplitudeDependent = "amplitude-dependent": "frequency or damping changes with the amplitude", "state the amplitude with it, or look for the cause with diagnose";
        AnchorNotNeeded = "anchor-not-needed": "torque and motion determine all three constants; the declared one was not used", "omit --inertia or --stiffness";
        AnchorWithoutStd = "anchor-without-std": "the declared constant has no standard uncertainty, so those of the others do not include it", "declare it with std";
        AtBound = "at-bound": "a parameter lies at its bound: it is not identifiable from these data", "omit it, or record data that determine it";
        ChannelsShifted = "channels-shifted": "one channel lags the other; the delay was fitted", "record both with one recorder and the same filters";
        CloseLines = "close-lines": "the residual has a line close to the mode", "try --modes";
        CrowdedModes = "crowded-modes": "many modes lie close to the strongest one, as where a mode with dry friction rings beside another", "filter the other mode out with the upper end of --band";
        Curve = "curve": "the readings follow a curve, so the constants are valid at no load only", "use the curve at large loads";
        DecaysApart = "decays-apart": "decays ring at different frequencies: the stand was changed, or they are of two stands", "identify them one by one";
        DecaysLeftOut = "decays-left-out": "not all decays were used", "select them with --range";
        Drag = "drag": "the torque of a run-up grows with the square of the speed, which the constants do not allow for", "take the constants with drag that the message gives, or record at low speeds";
        DryFrictionByDirection = "dry-friction-by-direction": "friction that differs by direction cannot be distinguished from a torque offset", "check the zero of the torque";
        HitLeftOut = "hit-left-out": "a hammer hit was not used", "repeat the hit";
        Impossible = "impossible": "a fitted constant has a physically impossible sign", "check the signs of the channels";
        Leads = "leads": "the measured signal leads the applied one, which is impossible", "check --applied and --measured";
        Leakage = "leakage": "the segments are too short for a narrow mode, whose damping is overestimated", "choose a longer --segment";
        FewSamplesPerSwing = "few-samples-per-swing": "the body reverses within few samples, so that dry and viscous friction cannot be told apart", "record at a higher rate, or reverse less often";
        LevelDependent = "level-dependent": "the response differs between levels", "look for the cause with diagnose";
        LowPassFitted = "low-pass-fitted": "the measured channel lags as behind an RC low-pass, which was fitted", "check the filter of the amplifier, or record both channels with the same filters";
        MainsTakenOff = "mains-taken-off": "steady mains lines were fitted along with the decay and removed", "record for longer if one of them is the stand's own";
        NotLinear = "not-linear": "the mean reading at a load deviates from the curve by more than its repeatability explains: the characteristic is nonlinear, or the amplifier is at its limit", "omit the loads beyond the limit, or use --degree 3";
        NoUnloading = "no-unloading": "no readings were taken during unloading, so the hysteresis is unknown", "unload in steps as well";
        NoiseBeforeResonance = "noise-before-resonance": "the residual follows the resonance: something else also drives the stand, or the input is noisy, which makes the gain too small", "reduce the noise of --applied, or excite more";
        NoisyMotion = "noisy-motion": "much of the measured acceleration or speed is noise; the resulting bias was corrected", "use a longer window or a better sensor";
        Overtone = "overtone": "a mode has two or three times the frequency and the decay rate of the strongest: it is distortion", "excite the stand less, or use a later part of the decay with --range";
        OneHit = "one-hit": "a single hit does not show the error of its force, which dominates the uncertainties: those of frequency and damping are upper limits, that of the static gain may be too small", "take several hits";
        Nonlinear = "nonlinear": "the response has power at frequencies that were not applied: the stand is nonlinear", "look for the cause with diagnose";
        ModeOutOfReach = "mode-out-of-reach": "a fitted mode lies above all frequencies of the records, or above the fitted ones without being determined by them, and was dropped", "check for a shift between the channels, excite higher frequencies, or choose fewer --modes";
        UndampedLeftOut = "undamped-left-out": "a mode without measurable damping was dropped", "choose fewer --modes, or record for longer";
        ZeroUnknown = "zero-unknown": "the records of a response test that gives a calibration do not begin at rest, so the output at no load is unknown", "record the output without load, and give it as [recorder] zero";
        ResiduesUnknown = "residues-unknown": "a decay gives several modes, but not their residues in the response to a torque", "add the residues, use identify response, or write the stand's mode alone with --modes 1";
        NotAnchored = "not-anchored": "only ratios of the constants are determined", "declare the inertia or the stiffness";
        NotConverged = "not-converged": "the fit stopped before its minimum", "check the result, or choose another start";
        NotViscous = "not-viscous": "another damping law fits the envelope better than viscous damping", "look for the cause with diagnose";
        OneDirection = "one-direction": "the body moves in one direction only: dry friction and offset cannot be separated", "run it both ways";
        OneSeries = "one-series": "the loads were applied only once, so the repeatability is unknown", "repeat the series";
        CalibrationDiffers = "calibration-differs": "a calibration with weights differs by more than 10 % from that of the stand file", "check the lever arm, gravity and units of the loads, and the gain of the amplifier";
        RowOffLine = "row-off-line": "one row of known loads is far off the line of all others", "check the load and the reading of that row";
        RowsSorted = "rows-sorted": "the rows of loads are sorted by load and reading", "restore the order in which they were taken";
        StillSettling = "still-settling": "readings had not settled when the load was changed: their settled values are extrapolated", "keep each load for longer";
        UnsettledLeftOut = "unsettled-left-out": "readings right after, or before, changes of the load are not steady; each load counts once, with the settled value of its rows", "let readings settle, or give one row per load";
        OneWeight = "one-weight": "a single load besides zero does not reveal a nonlinear characteristic", "apply further loads";
        PoorFit = "poor-fit": "the model does not explain much of the data", "check the columns; choose another range, band or degree";
        ZeroDrifts = "zero-drifts": "the reading without load drifts over the test", "allow a longer warm-up, and read the zero of each record";
        DrivenAtFirst = "driven-at-first": "the motion at the start of a decay is still driven: a soft push, a hand, or a load that is let go slowly", "hit briefly, or give the free decay with --range";
        RestartInDecay = "restart-in-decay": "the ringing starts again within a decay", "hit once, and check for lost samples and overload";
        SecondStroke = "second-stroke": "the hammer struck twice; the recorded force includes both strokes", "repeat the hit if the coherence is low";
        NoiseOnForce = "noise-on-force": "noise on the hammer's force signal counts as force, so the response is too small", "use DC coupling for the hammer, or record so that its signal is at rest after the stroke";
        HitsOverlap = "hits-overlap": "a hit follows before the response to the previous one has decayed", "wait longer between hits, or add --excitation transient";
        ShortPulse = "short-pulse": "the hammer pulses are so short that frequencies above half the sampling rate alias into their spectrum", "record at a higher rate, or use a softer tip";
        SpeedUnknown = "speed-unknown": "the speed is known only up to a constant, so viscous friction and offset include dry friction", "record position or speed";
        ToneTakenOff = "tone-taken-off": "steady lines were fitted along with the decay and removed", "switch off running machinery; record for longer if one of them is the stand's own";
        StdContradicted = "std-contradicted": "the scatter of the readings contradicts the given standard uncertainties", "check their unit";
        Turned = "turned": "the phase of the mode differs from that of the equation of motion", "check for a delay or another mode";
    }
    "Time axis" {
        ClockJump = "clock-jump": "one time step is longer than the rest of the record", "split the file there";
        IrregularStamps = "irregular-stamps": "time steps vary", "use --resample, or --rate if the stamps are rounded";
        MissingRate = "missing-rate": "the sampling rate is unknown", "give --rate or --time-column";
        NoTimeAxis = "no-time-axis": "the horizontal axis is not time", "give --rate, or choose another file";
        NonFiniteStamps = "non-finite-stamps": "cells of the time column contain no number", "repair them";
        RateContradictsStamps = "rate-contradicts-stamps": "the rate stated in the file differs from that of the time stamps", "find out which is right, and give it with --rate";
        RateDrift = "rate-drift": "the sampling rate of the first rows differs from the mean rate", "give --rate";
        RateJoinsGaps = "rate-joins-gaps": "--rate joins the samples on both sides of gaps or backward steps in the time stamps", "omit --rate if the stamps are right; fill gaps with --fill, or exclude them with --range";
        RateKeepsRepeats = "rate-keeps-repeats": "--rate was given, and some time stamps repeat the one before: perhaps rows that were written twice", "omit --rate, and drop the repeats with --resample";
        RateOverridesStamps = "rate-overrides-stamps": "--rate differs from the rate of the stamps; --rate was used", "omit --rate if the stamps are right";
        RepeatedStamps = "repeated-stamps": "a time stamp equals the previous one", "remove the sample, or give --rate";
        RoundedTimeStamps = "rounded-time-stamps": "the stamps are rounded to a quarter of a step or more; the rate is that of all of them", "compare the rate with the recorder's setting; give --rate if you know it more precisely, or what the message says if rows are missing or written twice";
        Restarted = "restarted": "the start time of a channel changes within a TDMS file: its samples are not contiguous", "save each part in a separate file";
        StampsOfArrival = "stamps-of-arrival": "the stamps jitter, but the decay shows that the samples were taken at equal intervals, which are used", "give the recorder's rate with --rate";
        TimeAssumed = "time-assumed": "the time axis is assumed", "confirm it with --time-column and --time-unit, or give --rate";
        TimeBackwards = "time-backwards": "a time stamp is earlier than the previous one", "split the file there";
        TimeFalls = "time-falls": "a column named like time decreases too often to be time and was read as a channel", "choose the time with --time-column, or give --rate";
        TimeGaps = "time-gaps": "samples are missing between time stamps", "use --fill linear for short gaps";
        TimeJitter = "time-jitter": "time steps differ by more than 1 %", "use --resample, or --rate if the stamps are arrival times";
        ClocksDisagree = "clocks-disagree": "two time columns of a table run at different speeds", "find out which is right, and choose it with --time-column";
        CounterJumps = "counter-jumps": "a column that counts the rows jumps, so rows are missing, and no other time shows it", "select a part without jumps, or use the column as time";
        TimeLeftOut = "time-left-out": "a column named like time disagrees with the time of the rows and was ignored", "choose another with --time-column";
    }
    "Samples" {
        FullScaleUnknown = "full-scale-unknown": "samples are fractions of full scale, which the file does not state", "give --full-scale with its unit";
        LeftOut = "left-out": "functions or variables of the file that are not time series were skipped", "export them in another form if you need them";
        FileCut = "file-cut": "the file ends early: it holds less than it declares", "copy it again";
        SegmentDamaged = "segment-damaged": "a segment of a TDMS file is inconsistent; it and everything after it are lost", "copy the file again";
        ChannelCopy = "channel-copy": "a channel is identical to another one", "use one of them";
        ChannelMultiple = "channel-multiple": "a channel is a multiple of another one, apart from rounding", "use one of them";
        Clipped = "clipped": "the signal is clipped at its highest or lowest value", "record with a larger range";
        CoarseQuantisation = "coarse-quantisation": "the signal spans fewer than 256 quantisation steps (100 where it is fitted), or stays within one for most of a window of a run-up", "use a smaller input range; for a run-up, a longer --window";
        TwoSignals = "two-signals": "the samples of two or more signals follow in turn: several sources are mixed in one record", "record each under a name of its own";
        ConstantChannel = "constant-channel": "all samples are the same", "check the connection, or choose another channel";
        IdenticalFiles = "identical-files": "files are identical, byte for byte; in a fit, they count twice, and its uncertainties are too small", "remove the copies";
        MainsLines = "mains-lines": "lines at multiples of 50 or 60 Hz stand out", "check grounding and shielding, or declare the effect mains-pickup";
        NonFinite = "non-finite": "cells contain no number, or no finite one", "repair them, or cut the record there";
        InterpolatedSamples = "interpolated-samples": "the samples lie on straight lines between every k-th of them: the record was interpolated to a higher rate", "use the record as it was recorded, or keep every k-th row";
        RepeatedSamples = "repeated-samples": "samples repeat the previous value more often than the resolution explains", "record at the rate of the source";
        Spikes = "spikes": "one or two consecutive samples lie far from their neighbours", "repair them if they mark missing values or are drop-outs or glitches";
        StuckChannel = "stuck-channel": "the signal is constant for a while, or drops out", "check cables and transmitters, and exclude that part";
    }
    "Reading text" {
        CellsWithUnits = "cells-with-units": "cells contain a unit after each number; their column was skipped", "remove the units from the cells and put one in the heading";
        ExtraCells = "extra-cells": "rows have more cells than there are headings", "check the headings";
        Filled = "filled": "missing samples were filled in, as requested by --fill", "do not trust the result there";
        FirstSamplesOnly = "first-samples-only": "only the first samples were checked", "cut the file into parts if the rest matters";
        ItemsMove = "items-move": "rows list named items (`name[0]` beside `effort[0]`) in a changing order; each was tracked by the name that it has in the first row", "write each item to a separate column";
        LinesSkipped = "lines-skipped": "lines between the rows are not rows of numbers and were skipped", "check these lines";
        SampleCount = "sample-count": "the number of rows differs from that in the header", "copy or export the file again";
        SamplesMissing = "samples-missing": "the number of samples differs from that in the header", "copy or export the file again";
        ScreenSteps = "screen-steps": "values are in steps of the oscilloscope's screen", "export in another mode if they could not be scaled";
        TruncatedLastLine = "truncated-last-line": "the file ends in the middle of its last line, which was dropped", "copy the file again";
        TextsInChannel = "texts-in-channel": "most of the first cells of a channel are not numbers; their column was skipped", "write plain numbers there, and leave the cells without a value empty";
        UnassignedHeadings = "unassigned-headings": "the line above the rows has more words than there are columns, which have no names then", "write headings without spaces, or separate all cells by tabs or commas";
        UnendedLastLine = "unended-last-line": "the last line has no line ending, unlike the others: its last number may be truncated", "do not trust the last sample if the file was cut off";
        UnitOverridesHeading = "unit-overrides-heading": "--unit differs from the unit in the heading; --unit was used", "omit --unit if the heading is right";
        UnreadableCharacters = "unreadable-characters": "some bytes are invalid in the encoding", "check the encoding";
        ZeroBytes = "zero-bytes": "zero bytes in the text were removed", "copy the file again";
    }
    "Reading MCAP" {
        McapChecksum = "mcap-checksum": "a checksum of the file does not match: some of its bytes are corrupt", "recover the file from its source";
        McapClock = "mcap-clock": "the clocks of the messages disagree", "see the message";
        McapConflict = "mcap-conflict": "schemas or channels are declared again with different content; the first was used", "record them under separate topics";
        McapCount = "mcap-count": "messages, chunks or attachments counted by the file are missing", "recover the file from its source";
        McapDamagedChunk = "mcap-damaged-chunk": "a chunk is damaged and was skipped", "recover the file from its source";
        McapDamagedRecord = "mcap-damaged-record": "a record is damaged and was skipped", "recover the file from its source";
        McapItemsMove = "mcap-items-move": "the item requested by its index changes places; it was tracked by its name", "request it by name";
        McapLost = "mcap-lost": "messages were lost", "recover the file from its source";
        McapMoreLosses = "mcap-more-losses": "there were more losses of the same kind", "see the preceding ones";
        McapOutOfOrder = "mcap-out-of-order": "samples arrived out of order and were sorted", "nothing, if the stamps are right";
        McapSkipped = "mcap-skipped": "messages were skipped", "see the message";
        McapTooLate = "mcap-too-late": "samples arrived too late to be sorted and were dropped", "sort the file by time first";
        McapTruncated = "mcap-truncated": "the file ends without its end record; everything complete was read", "recover the file from its source";
        McapUnknownChannel = "mcap-unknown-channel": "messages belong to no declared channel", "recover the file from its source";
        McapUnreadable = "mcap-unreadable": "messages could not be read", "check their schema";
        McapWithoutItem = "mcap-without-item": "messages do not contain the requested item", "check the name of the item";
        SamplesNotRead = "samples-not-read": "numbers are listed, but not examined", "read them one by one with extract";
    }
}
