//! Names from files, which may be malicious.

use crate::util::{Folder, sampled};

/// Sets the title of a terminal window, moves its cursor, and closes a tag.
const NAMES: [&str; 4] = [
    "a\u{1b}]0;owned\u{7}",
    "\u{9b}2Jcleared",
    "<script>alert(1)</script>&\u{1}",
    "=HYPERLINK(\u{202e}cmd)",
];

fn folder(name: &str) -> Folder {
    let folder = Folder::new();
    let wave = |i| (i as f64 * 0.05).sin();
    folder.write("in.csv", sampled(&format!("{name} [V]"), 1e4, 3000, wave));
    folder
}

fn is_clean(text: &str) -> bool {
    let hidden = |c: char| {
        c.is_control() && !matches!(c, '\n' | '\t') || ('\u{202a}'..='\u{202e}').contains(&c)
    };
    !text.contains(hidden)
}

#[test]
fn names_neither_steer_terminals_nor_break_pages() {
    for name in NAMES {
        let folder = folder(name);
        let runs: [&[&str]; 6] = [
            &["inspect", "in.csv", "--plot", "inspect.svg"],
            &["inspect", "in.csv", "--json"],
            &[
                "compensate",
                "in.csv",
                "--stand",
                "stand.toml",
                "-o",
                "out.csv",
                "--plot",
                "out.svg",
            ],
            &["extract", "in.csv"],
            &["extract", "in.csv", "--channel", name],
            &[
                "compensate",
                "in.csv",
                "--stand",
                "stand.toml",
                "--channel",
                "missing",
            ],
        ];
        for args in runs {
            let ran = folder.run(args);
            assert!(
                is_clean(&ran.stdout),
                "{name:?} {args:?}: {}",
                ran.stdout.escape_debug()
            );
            assert!(
                is_clean(&ran.stderr),
                "{name:?} {args:?}: {}",
                ran.stderr.escape_debug()
            );
        }
        for picture in ["inspect.svg", "out.svg"] {
            let svg = folder.read(picture);
            assert!(is_clean(&svg), "{name:?} {picture}");
            roxmltree::Document::parse(&svg).expect("well-formed XML");
            assert!(!svg.contains("<script"));
        }
    }
}

#[test]
fn a_spreadsheet_does_not_execute_a_heading() {
    for name in ["=1+2", "+1", "-1", "@cmd"] {
        let ran = folder(name).run(&["extract", "in.csv"]);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
        let heading = ran.stdout.lines().next().expect("a heading");
        assert_eq!(heading, format!("time_s,'{name} [V]"));
    }
}
