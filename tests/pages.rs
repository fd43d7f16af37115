//! Files of an installed program: its version, manual pages and completions.

use crate::util::Folder;

#[test]
fn the_version_names_the_build_and_its_target() {
    let version = env!("CARGO_PKG_VERSION");
    let folder = Folder::new();
    assert_eq!(folder.run(&["-V"]).stdout, format!("torqcomp {version}\n"));
    let said = folder.run(&["--version"]).stdout;
    let build = said
        .strip_prefix(&format!("torqcomp {version} ("))
        .and_then(|rest| rest.strip_suffix(")\n"))
        .unwrap_or_else(|| panic!("{said}"));
    let (origin, target) = build.split_once(", ").expect("an origin and a target");
    match cfg!(debug_assertions) {
        true => assert_eq!(origin, "debug build"),
        false => assert!(origin.contains("commit"), "{origin}"),
    }
    assert!(target.starts_with(std::env::consts::ARCH), "{target}");
    assert!(target.contains(std::env::consts::OS), "{target}");
}

#[test]
fn manual_pages_go_to_standard_output_a_file_or_all_into_a_folder() {
    let folder = Folder::new();
    let program = folder.run(&["man"]);
    assert_eq!((program.code, program.stderr.as_str()), (0, ""));
    assert!(program.stdout.contains(".TH torqcomp 1 "), "{program:?}");
    let decay = folder.run(&["man", "identify", "decay", "-o", "decay.1"]);
    assert_eq!(decay.code, 0, "{decay:?}");
    assert_eq!(folder.run(&["man", "-o", "man/"]).code, 0);
    let read = |name: &str| folder.read(&format!("man/{name}.1"));
    assert_eq!(read("torqcomp"), program.stdout);
    assert_eq!(read("torqcomp-identify-decay"), folder.read("decay.1"));
    let pages = std::fs::read_dir(folder.path("man")).expect("a folder");
    // The program, its commands, and the tests of `identify`.
    let verbs = folder.run(&["--help"]).stdout;
    let verbs = verbs.split_once("Commands:\n").expect("verbs").1;
    let listed = verbs.lines().take_while(|line| !line.is_empty());
    let listed = listed.filter(|line| !line.starts_with("  help ")).count();
    assert_eq!(pages.count(), 1 + listed + 4);
}

#[test]
fn a_page_that_is_not_there_is_a_wrong_command_line() {
    let folder = Folder::new();
    let ran = folder.run(&["man", "compansate"]);
    assert_eq!(ran.code, 2);
    assert!(
        ran.stderr.contains("did you mean \"compensate\"?"),
        "{ran:?}"
    );
    let ran = folder.run(&["man", "predict", "more"]);
    assert!(
        ran.stderr.contains("predict has no further verbs"),
        "{ran:?}"
    );
    let ran = folder.run(&["man", "predict", "-o", "man/"]);
    assert_eq!(ran.code, 2);
    assert!(ran.stderr.contains("name a file"), "{ran:?}");
}

#[test]
fn pages_replace_others_only_by_force() {
    let folder = Folder::new();
    let write = |force: &[&str]| folder.run(&[&["man", "-o", "man/"], force].concat());
    assert_eq!(write(&[]).code, 0);
    let again = write(&[]);
    assert_eq!(again.code, 1);
    assert!(again.stderr.contains("--force"), "{again:?}");
    assert_eq!(write(&["--force"]).code, 0);
}

#[test]
fn completions_know_verbs_and_options_in_every_shell() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let ran = folder.run(&["completions", shell]);
        assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{shell}");
        for word in [
            "compensate",
            "identify",
            "decay",
            "skip-existing",
            "whole-record",
        ] {
            assert!(ran.stdout.contains(word), "{shell}: {word}");
        }
    }
    assert_eq!(folder.run(&["completions", "korn"]).code, 2);
}
