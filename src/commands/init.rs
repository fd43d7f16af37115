//! `init`: a commented stand file from the data the user has.

mod questions;
mod range;

use std::fmt::Write as _;
use std::io::{BufRead, IsTerminal, Write};
use std::path::Path;

use clap::ValueEnum;

use self::questions::{BRIDGE, DRAWING, MECHANICS, Question, TRANSDUCER};
use super::{Outcome, conclude};
use crate::cli::Strictness;
use crate::cli::init::{Init, InitFrom};
use crate::file_name::{ShowPath, is_dash};
use torqcomp_model::Kind;

use crate::failure::{ErrorCode, Failure};
use crate::stand::{self, TransducerSignal};

/// Sections in the order of the file, each with the comment above it.
const SECTIONS: [(&str, &str); 6] = [
    (
        "mechanics",
        "The response that is divided out of the record: J θ'' + f θ' + K θ = T.",
    ),
    ("calibration", "From the record to torque."),
    (
        "beam",
        "The drawing of the beam: from torque to strain at the gage.",
    ),
    ("gage", "The strain gage: from strain to resistance."),
    ("bridge", "The bridge."),
    ("recorder", "Amplifier and recorder."),
];

/// Runs the verb.
pub fn run(args: &Init) -> Result<Outcome, Failure> {
    let (mut input, mut errors) = (std::io::stdin().lock(), std::io::stderr());
    let can_ask = input.is_terminal() && errors.is_terminal();
    let mut asked = can_ask.then_some(Dialogue {
        input: &mut input,
        output: &mut errors,
    });
    let text = compose(args, asked.as_mut())?;
    let stand = stand::parse("the new stand file", &text)
        .map_err(|failure| ErrorCode::InvalidValue.usage(failure.to_string()))?;
    let mut output = args.result.open(&[])?;
    output.write(text.as_bytes())?;
    output.finish()?;
    Ok(conclude(&stand.warnings, false, &Strictness::default()))
}

/// A dialogue with a user at a terminal.
struct Dialogue<'a> {
    input: &'a mut dyn BufRead,
    output: &'a mut dyn Write,
}

impl Dialogue<'_> {
    /// The answer to a question, empty for none; asked again until `check` accepts it.
    fn ask(
        &mut self,
        question: &str,
        check: impl Fn(&str) -> Result<(), String>,
    ) -> Result<String, Failure> {
        let broken = |error: std::io::Error| {
            ErrorCode::CannotRead.failed(format_args!("no answer: {error}"))
        };
        loop {
            write!(self.output, "{question}: ").map_err(broken)?;
            self.output.flush().map_err(broken)?;
            let mut line = String::new();
            if self.input.read_line(&mut line).map_err(broken)? == 0 {
                return Err(
                    ErrorCode::MissingArgument.failed("input ended before the last question")
                );
            }
            let answer = line.trim().to_owned();
            match check(&answer) {
                Ok(()) => return Ok(answer),
                Err(why) => writeln!(self.output, "{why}").map_err(broken)?,
            }
        }
    }
}

/// The text of the file.
fn compose(args: &Init, mut dialogue: Option<&mut Dialogue>) -> Result<String, Failure> {
    let from = match (args.from, &mut dialogue) {
        (Some(from), _) => from,
        (None, Some(dialogue)) => {
            let question = "What do you have: a transducer with a data sheet or certificate, a bridge calibrated with \
                            weights, the drawing of the beam, or none of these? (transducer, bridge, drawing, unknown)";
            let known = |text: &str| source(text).map(|_| ());
            source(&dialogue.ask(question, known)?).map_err(Failure::of(ErrorCode::InvalidValue))?
        }
        (None, None) => {
            return Err(ErrorCode::MissingArgument.usage(
                "give --from transducer, bridge, drawing or unknown; without a terminal no questions are asked",
            ));
        }
    };
    let questions: Vec<&'static Question> = of(from).iter().chain(&MECHANICS).collect();
    let mut answers: Vec<Answer> = Vec::new();
    let mut missing = Vec::new();
    for question in questions {
        let given = args.given(question.flag).map(str::to_owned);
        let answer = match (given, &mut dialogue) {
            (Some(given), _) => Some(no_range(given, question.flag)?),
            (None, Some(dialogue)) => {
                let answer = dialogue.ask(&question.text(), |text| question.check(text))?;
                Some(answer).filter(|answer| !answer.is_empty())
            }
            (None, None) if question.is_needed => {
                missing.push(format!("--{} \"{}\"", question.flag, question.example));
                None
            }
            (None, None) => None,
        };
        let Some(value) = answer else { continue };
        let std = std_of(args, (question, &value), dialogue.as_deref_mut())?;
        answers.push(Answer {
            question,
            value,
            std,
        });
    }
    args.check_stds(&answers)?;
    if let Some(flag) = args.given_beside(from) {
        return Err(ErrorCode::ConflictingArguments.usage(format_args!(
            "--{flag} does not apply to --from {}",
            word(from)
        )));
    }
    if !missing.is_empty() {
        return Err(ErrorCode::MissingArgument.usage(format_args!(
            "--from {} also needs {}",
            word(from),
            missing.join(", ")
        )));
    }
    beyond_loop(&answers)?;
    Ok(page(args, from, &answers))
}

/// The value of a flag, if it is not a range.
fn no_range(given: String, flag: &str) -> Result<String, Failure> {
    match range::advice(&given) {
        None => Ok(given),
        Some(advice) => Err(ErrorCode::InvalidValue.usage(format_args!("--{flag}: {advice}"))),
    }
}

/// Rejects the output at rated torque given instead of its change.
fn beyond_loop(answers: &[Answer]) -> Result<(), Failure> {
    let text = |key: &str| {
        let found = answers.iter().find(|a| a.question.key == key);
        found.map(|answer| answer.value.as_str())
    };
    let (Some(output), Some(zero)) = (text("sensitivity"), text("zero")) else {
        return Ok(());
    };
    let kinds = [
        (TransducerSignal::Current, Kind::Current),
        (TransducerSignal::Voltage, Kind::Voltage),
    ];
    for (signal, kind) in kinds {
        let [Ok(change), Ok(offset)] = [output, zero].map(|text| kind.parse(text)) else {
            continue;
        };
        if let Some(why) = signal.beyond_loop(change, offset) {
            return Err(ErrorCode::InvalidValue.usage(format_args!(
                "--sensitivity {output} beside --zero {zero}: {why}"
            )));
        }
    }
    Ok(())
}

/// Standard uncertainty of an answer, from a flag or asked for.
fn std_of(
    args: &Init,
    (question, value): (&Question, &str),
    dialogue: Option<&mut Dialogue>,
) -> Result<Option<String>, Failure> {
    Ok(match (args.given_std(question.flag), dialogue) {
        (Some(given), _) => Some(given.to_owned()),
        (None, Some(dialogue)) if question.has_std() => {
            let check = |text: &str| question.check_std(text, value);
            let asked = dialogue.ask(&question.std_text(), check)?;
            Some(asked).filter(|std| !std.is_empty())
        }
        (None, _) => None,
    })
}

/// An answer with its standard uncertainty, if one is given.
struct Answer {
    question: &'static Question,
    value: String,
    std: Option<String>,
}

impl Answer {
    fn toml(&self) -> String {
        let text = |text: &str| toml_edit::Value::from(text).to_string();
        match &self.std {
            Some(std) => format!("{{ value = {}, std = {} }}", text(&self.value), text(std)),
            None => text(&self.value),
        }
    }
}

/// The text of the file by sections; missing ones are given as comments.
fn page(args: &Init, from: InitFrom, answers: &[Answer]) -> String {
    let name = args.name.as_deref().unwrap_or("my stand");
    let file = args.result.output.as_deref().filter(|file| !is_dash(file));
    let file = file.unwrap_or(Path::new("FILE")).shown().to_string();
    let mut text = format!(
        "schema = \"torqcomp.stand/1\"\nname = {}\n\n# Every number has its unit; a known uncertainty is written as\n\
         #     {{ value = \"50 N m\", std = \"0.1 N m\", source = \"certificate\" }}\n",
        toml_edit::Value::from(name)
    );
    for (section, about) in SECTIONS {
        let of_section: Vec<_> = answers
            .iter()
            .filter(|a| a.question.section == section)
            .collect();
        if of_section.is_empty() {
            let how = match (section, from) {
                ("mechanics", _) => NO_MECHANICS,
                ("calibration", InitFrom::Bridge | InitFrom::Unknown) => NO_CALIBRATION,
                _ => "",
            };
            text += &how.replace("FILE", &file);
            continue;
        }
        let _ = write!(text, "\n# {about}\n[{section}]\n");
        for answer in of_section {
            let Question { key, meaning, .. } = answer.question;
            let _ = writeln!(text, "{key} = {}  # {meaning}", answer.toml());
        }
    }
    text
}

/// How to obtain `[mechanics]`; FILE is the name of the file.
const NO_MECHANICS: &str = "\n# [mechanics] is the response that is divided out. Record the ringing of the \
    stand after a tap, and run\n\
    #     torqcomp identify decay tap.csv -o FILE\n# or write it by hand:\n\
    # [mechanics]\n# natural_frequency = \"590 Hz\"\n# damping_ratio = 0.02\n";
/// How to obtain `[calibration]`.
const NO_CALIBRATION: &str = "\n# [calibration] converts the record to torque. A record in N m needs \
    none. For one in V, mV/V, mA or Hz, load the\n\
    # stand with known weights and run\n\
    #     torqcomp identify static loads.csv --load LOAD --reading READING --radius \"0.5 m\" -o FILE\n\
    # or write one of these by hand:\n# [calibration]\n# torque_per_volt = \"12.5 N m/V\"\n\
    # torque_per_ratio = \"25 N m/(mV/V)\"\n";

fn of(from: InitFrom) -> &'static [Question] {
    match from {
        InitFrom::Transducer => &TRANSDUCER,
        InitFrom::Bridge => &BRIDGE,
        InitFrom::Drawing => &DRAWING,
        InitFrom::Unknown => &[],
    }
}

/// A source as on the command line.
fn word(from: InitFrom) -> String {
    let word = from.to_possible_value();
    word.map_or_else(String::new, |word| word.get_name().to_owned())
}

fn source(text: &str) -> Result<InitFrom, String> {
    InitFrom::from_str(text, true)
        .map_err(|_| "write transducer, bridge, drawing or unknown".to_owned())
}

impl Init {
    /// Value of a flag.
    fn given(&self, flag: &str) -> Option<&str> {
        let found = self.flags().into_iter().find(|(name, _)| *name == flag)?;
        found.1
    }

    /// A given flag that does not apply to such a file.
    fn given_beside(&self, from: InitFrom) -> Option<&'static str> {
        let known: Vec<&str> = of(from).iter().chain(&MECHANICS).map(|q| q.flag).collect();
        let mut given = self.flags().into_iter().filter(|(_, text)| text.is_some());
        given
            .find(|(flag, _)| !known.contains(flag))
            .map(|(flag, _)| flag)
    }

    /// The standard uncertainty given for a flag.
    fn given_std(&self, flag: &str) -> Option<&str> {
        let found = self.std.iter().find(|(name, _)| name == flag)?;
        Some(&found.1)
    }

    /// Rejects a standard uncertainty for a value that is not given or takes none.
    fn check_stds(&self, answers: &[Answer]) -> Result<(), Failure> {
        for (flag, std) in &self.std {
            let answer = answers.iter().find(|a| a.question.flag == flag);
            let Some(answer) = answer.filter(|a| a.question.has_std()) else {
                return Err(ErrorCode::ConflictingArguments.usage(format_args!(
                    "--std {flag}={std}: --{flag} is not given, or has no uncertainty"
                )));
            };
            let checked = answer.question.check_std(std, &answer.value);
            checked.map_err(|why| {
                ErrorCode::InvalidValue.usage(format_args!("--std {flag}={std}: {why}"))
            })?;
        }
        Ok(())
    }

    fn flags(&self) -> [(&'static str, Option<&str>); 18] {
        [
            ("natural-frequency", &self.natural_frequency),
            ("damping-ratio", &self.damping_ratio),
            ("sensitivity", &self.sensitivity),
            ("rated-torque", &self.rated_torque),
            ("torque-per-ratio", &self.torque_per_ratio),
            ("torque-per-volt", &self.torque_per_volt),
            ("width", &self.width),
            ("depth", &self.depth),
            ("length", &self.length),
            ("elastic-modulus", &self.elastic_modulus),
            ("radius", &self.radius),
            ("gage-position", &self.gage_position),
            ("gage-factor", &self.gage_factor),
            ("gage-resistance", &self.gage_resistance),
            ("layout", &self.layout),
            ("excitation", &self.excitation),
            ("gain", &self.gain),
            ("zero", &self.zero),
        ]
        .map(|(flag, text)| (flag, text.as_deref()))
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::cli::{Cli, Verb};

    #[test]
    fn a_wrong_answer_is_asked_again_and_an_empty_one_leaves_out() {
        let cli = Cli::parse_from(["torqcomp", "init", "--rated-torque", "50 N m"]);
        let Verb::Init(args) = cli.verb else {
            unreachable!()
        };
        // Each quantity is followed by its standard uncertainty, also for the torque given by a flag.
        let answers = "data sheet\ntransducer\n2 mV/V\n\n\n\n\n\n590\n590 Hz\n1 Hz\n0.02\n\n";
        let mut said = Vec::new();
        let mut dialogue = Dialogue {
            input: &mut answers.as_bytes(),
            output: &mut said,
        };
        let text = compose(&args, Some(&mut dialogue)).unwrap();
        assert!(
            text.contains("sensitivity = \"2 mV/V\"") && text.contains("rated_torque = \"50 N m\""),
            "{text}"
        );
        assert!(
            text.contains("natural_frequency = { value = \"590 Hz\", std = \"1 Hz\" }")
                && !text.contains("[recorder]"),
            "{text}"
        );
        let said = String::from_utf8(said).unwrap();
        assert!(
            said.contains("write transducer, bridge") && said.contains("\"590\" has no unit"),
            "{said}"
        );
        stand::parse("s", &text).unwrap();
    }
}
