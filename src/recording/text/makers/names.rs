//! Exports that the general reader takes as they are: how each is told.

use super::Maker;
use crate::recording::text::head::Head;
use crate::recording::text::header::after_definition;
use crate::recording::text::table::Hints;

const PLAIN: Hints = Hints {
    time_unit: None,
    unit: None,
};

const fn plain(name: &'static str, is: fn(&Head) -> bool) -> Maker {
    Maker {
        name,
        is,
        hints: PLAIN,
        read: None,
    }
}

/// One line for each.
pub const ALL: &[Maker] = &[
    Maker {
        name: "TwinCAT Scope",
        is: |head| {
            head.any(|line| line.starts_with("Starttime of export"))
                || head.any(|line| line.starts_with("SymbolComment"))
                || head.any(|line| line.starts_with("SampleTime[ms]"))
        },
        hints: Hints {
            time_unit: Some("ms"),
            unit: None,
        },
        read: None,
    },
    plain("Campbell TOA5", |head| {
        head.starts(0, "TOA5") || head.starts(0, "\"TOA5\"")
    }),
    plain("Mitsubishi MR Configurator", |head| {
        head.any(|line| line.starts_with("Number of sampling data"))
    }),
    plain("NI ELVISmx", |head| {
        head.starts(0, "Timestamp,") && head.starts(1, "Interval,")
    }),
    plain("PicoScope", |head| {
        let is_units = |line: &str| {
            let line = line.trim_start();
            let times = ["(s)", "(ms)", "(us)", "(\u{b5}s)", "(ns)"];
            times.iter().any(|unit| line.starts_with(unit)) && line.ends_with(')')
        };
        head.lines
            .get(1)
            .is_some_and(|line| is_units(line.text.trim_end()))
            && head
                .lines
                .get(2)
                .is_some_and(|line| line.text.trim().is_empty())
    }),
    plain("Kistler DynoWare", |head| {
        head.any(|line| line.contains("DynoWare"))
    }),
    plain("HBM catman", |head| {
        head.any(|line| line.to_lowercase().contains("catman"))
    }),
    plain("Keysight", |head| {
        head.starts(0, "x-axis,") && head.starts(1, "second,")
    }),
    plain("Keysight Infiniium", |head| {
        head.any(|line| line.starts_with("XInc:")) && head.any(|line| line.starts_with("XOrg:"))
    }),
    plain("Rohde & Schwarz", |head| {
        head.starts(0, "in s,")
            || head.starts(0, "in s;")
            || head.starts(0, "[s],")
            || head.starts(0, "[s];")
            || head.starts(0, "Model;RT")
            || head.any(|line| {
                line.starts_with("SignalResolution:") || line.starts_with("HardwareXStart:")
            })
    }),
    plain("Siglent", |head| {
        head.any(|line| line.starts_with("Model Number,SDS"))
    }),
    plain("Hantek", |head| head.starts(0, "#CHANNEL:")),
    plain("Yokogawa", |head| {
        head.any(|line| line.trim_start_matches('"').starts_with("TraceName"))
    }),
    plain("Graphtec", |head| {
        head.any(|line| line.contains("GRAPHTEC"))
    }),
    plain("Hioki", |head| {
        head.any(|line| line.trim_start_matches('"').starts_with("HIOKI"))
    }),
    plain("Digilent WaveForms", |head| {
        head.starts(0, "#Digilent WaveForms")
    }),
    plain("Moku", |head| head.starts(0, "% Moku")),
    plain("LabVIEW waveform table", |head| {
        head.starts(0, "waveform\t") || head.starts(0, "channel names:")
    }),
    plain("LabChart", |head| {
        head.starts(0, "Interval=") && head.any(|l| l.starts_with("ChannelTitle="))
    }),
    plain("ABB drive monitor", |head| {
        head.starts(0, "Time [s]\t") && head.lines[0].text.trim_end().ends_with("h)")
    }),
    plain("CASSY Lab", |head| {
        head.starts(0, "MIN") && head.any(|line| after_definition(line).is_some())
    }),
];
