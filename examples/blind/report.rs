//! The score as Markdown: marks, confusion matrix, failures, recovered torque.

use std::fmt::Write as _;

use crate::case::Answer;
use crate::conditions;
use crate::torque::Torque;

/// One case in one line.
pub fn line(answer: &Answer) -> String {
    let [train, holdout] = answer.case.strength();
    format!(
        "{} {}/{:03} ({}, strength {train:.2} and {holdout:.2}): {} {:?}, error over noise \
         {:.2} (plain {:.2}) -> {:.3}, {:.1} s ({:.1} s of the processors){}",
        if answer.is_right() { "right" } else { "WRONG" },
        answer.case.effect(),
        answer.case.number(),
        answer.case.variant(),
        answer.verdict(),
        answer.effects(),
        answer.error("before") / answer.case.floor(),
        answer.case.plain_error() / answer.case.floor(),
        answer.after_over_floor(),
        answer.seconds,
        answer.processor_seconds.unwrap_or(f64::NAN),
        match answer.code {
            Some(0) => String::new(),
            code => format!(
                ", exit {code:?}: {}",
                answer.stderr.lines().next().unwrap_or("")
            ),
        },
    )
}

/// Description of the records and how to reproduce them.
const PREFACE: &str = "\
# Blind records

How often `torqcomp diagnose` names the effect that a simulated stand has and its stand file does not.

The stand is that of the thesis; its true inertia, damping and stiffness are each off from the declared
ones by 2 to 20 %. Two records of 1.6 s at 20 kHz: multisine (to 1.0–2.2 kHz, settled or from rest) at two
levels, multisine and sweep, or two sweeps. Noise is 0.1 to 1 % of the signal; in a tenth of the records it
is coloured, in a tenth quantised. One effect of the list is put in, or none, or one that no list has. Where
the literature has several definitions of an effect, the records take them in turn: first or second order
of a low-pass, derivative or high-pass for a capacitive coupling, play or gap for a backlash, and so on
(`tests/blind/catalogue.rs`). The generator shares no code with the solver: inputs are known in
continuous time, the equations of motion are integrated at 32 steps a sample, switches are located.

*Strength* is what the best plain fit leaves of the noise-free record, over the noise: a quarter of the
records aims at 0.3 to 1, half at 1 to 5, a quarter at 5 to 25.

```text
cargo run --release --example blind -- make records --per-effect 20
cargo run --release --example blind -- score records --binary target/release/torqcomp --failures
```

";

/// The same for records of many stands.
const WIDE: &str = "\
# Blind records of many stands

Natural frequencies around 0.5, 20, 590 and 5000 Hz, damping ratios of 0.003 to 0.3, declared constants off by 2 to 20 %;
12 to 60 samples a period, 600 to 32,000 samples. Multisines, sweeps, random torques, plateaus and hits, mostly at another
level in the held-out record. Noise of 0.1 to 1 % of the signal, in half of the records also 0.5 % on the applied torque; in
a quarter a low-pass in front of the recorder, on both channels. *Strength* and *noise* count what the noise on the applied
torque makes of the signal (docs/closing-the-loop.md).

```text
cargo run --release --example blind -- make records --wide --per-effect 20
cargo run --release --example blind -- score records --binary target/release/torqcomp
```

";

/// Marks, table by effect, confusion matrix and, if requested, the failures.
pub fn markdown(answers: &[Answer], failures: bool) -> String {
    // Only wide records give their number of samples.
    let wide = answers.iter().all(|a| !a.case.truth["wide"].is_null());
    let mut text = String::from(if wide { WIDE } else { PREFACE });
    marks(&mut text, answers);
    by_effect(&mut text, answers);
    confusion(&mut text, answers);
    conditions::table(&mut text, answers);
    conditions::wrong(&mut text, answers);
    if failures {
        text.push_str("\n## What went wrong\n\n");
        for answer in answers.iter().filter(|answer| !answer.is_right()) {
            let _ = writeln!(text, "- {}", line(answer));
            let named = answer.effects().into_iter();
            for name in named.chain(answer.case.effects()) {
                let _ = writeln!(text, "  - {}", answer.candidate(name));
            }
        }
        text.push_str("\n## Right name, error above 1.2 of the noise\n\n");
        for answer in listed(answers).filter(|a| a.is_right() && a.after_over_floor() > 1.2) {
            let _ = writeln!(text, "- {}", line(answer));
        }
    }
    text
}

fn listed(answers: &[Answer]) -> impl Iterator<Item = &Answer> {
    answers
        .iter()
        .filter(|answer| answer.case.effects() == [answer.case.effect()])
}

/// Number of hits and total.
pub fn count<'a>(
    answers: impl Iterator<Item = &'a Answer>,
    hit: impl Fn(&Answer) -> bool,
) -> String {
    let (mut hits, mut all) = (0, 0);
    for answer in answers {
        all += 1;
        hits += usize::from(hit(answer));
    }
    if all == 0 {
        return "–".to_owned();
    }
    format!(
        "{hits} of {all} ({:.1} %)",
        100.0 * hits as f64 / f64::from(all)
    )
}

fn marks(text: &mut String, answers: &[Answer]) {
    let of = |effect: &'static str| answers.iter().filter(move |a| a.case.effect() == effect);
    let right = |answer: &Answer| answer.is_right();
    let _ = writeln!(text, "| mark | wanted | reached |\n|---|---|---|");
    let _ = writeln!(
        text,
        "| listed: the name and no other | 95 % | {} |",
        count(listed(answers), right)
    );
    let _ = writeln!(
        text,
        "| of these, with a strength of 1 and more in both records | | {} |",
        count(
            listed(answers).filter(|a| a.case.strength().iter().all(|s| *s >= 1.0)),
            right
        )
    );
    let named = |a: &Answer| a.effects().contains(&a.case.effect());
    let _ = writeln!(
        text,
        "| listed: the name among those accepted | | {} |",
        count(listed(answers), named)
    );
    for (name, wanted) in [("two", "92 %"), ("three", "80 %")] {
        let _ = writeln!(
            text,
            "| {name} at once: their names and no other | {wanted} | {} |",
            count(of(name), right)
        );
        let _ = writeln!(
            text,
            "| {name} at once: other names with the verdict `explained` | none | {} |",
            count(of(name), |a| a.verdict() == "explained" && !a.is_right())
        );
    }
    let _ = writeln!(
        text,
        "| unlisted beside listed: any verdict but `explained` | most | {} |",
        count(of("mixed"), right)
    );
    let _ = writeln!(
        text,
        "| none: `nothing-missing` | 95 % | {} |",
        count(of("none"), right)
    );
    let _ = writeln!(
        text,
        "| unlisted: `unexplained` or `partly-explained` | most | {} |",
        count(of("unlisted"), right)
    );
    let _ = writeln!(
        text,
        "| unlisted: a name with the verdict `explained` | none | {} |",
        count(of("unlisted"), |a| a.verdict() == "explained")
    );
    let _ = writeln!(
        text,
        "| name right: error after within 1.2 of the noise | all | {} |",
        count(listed(answers).filter(|a| a.is_right()), |a| a
            .after_over_floor()
            <= 1.2)
    );
    let times = |pick: fn(&Answer) -> Option<f64>| {
        let mut times: Vec<f64> = answers.iter().filter_map(pick).collect();
        times.sort_by(f64::total_cmp);
        match (times.get(times.len() / 2), times.last()) {
            (Some(middle), Some(most)) => format!("{middle:.1} s, {most:.1} s"),
            _ => "–".to_owned(),
        }
    };
    let _ = writeln!(
        text,
        "| time of a run: median, longest | 15 s | {} |",
        times(|answer| Some(answer.seconds))
    );
    let _ = writeln!(
        text,
        "| time of the processors: median, longest | 30 s | {} |",
        times(|answer| answer.processor_seconds)
    );
}

fn effects(answers: &[Answer]) -> Vec<&str> {
    let mut names: Vec<&str> = answers.iter().map(|answer| answer.case.effect()).collect();
    names.sort_unstable();
    names.dedup();
    names
}

fn by_effect(text: &mut String, answers: &[Answer]) {
    text.push_str(
        "\n| effect | right | strength below 1 | 1 to 5 | above 5 | after over noise: median | largest |\n\
         |---|---|---|---|---|---|---|\n",
    );
    for effect in effects(answers) {
        let of = || {
            answers
                .iter()
                .filter(move |answer| answer.case.effect() == effect)
        };
        let within = |low: f64, high: f64| {
            let inside = move |a: &&Answer| (low..high).contains(&a.case.strength()[0]);
            count(of().filter(inside), |answer| answer.is_right())
        };
        let mut after: Vec<f64> = of()
            .filter(|answer| answer.is_right())
            .map(Answer::after_over_floor)
            .filter(|ratio| ratio.is_finite())
            .collect();
        after.sort_by(f64::total_cmp);
        let number = |value: Option<&f64>| value.map_or("–".to_owned(), |v| format!("{v:.3}"));
        let _ = writeln!(
            text,
            "| {effect} | {} | {} | {} | {} | {} | {} |",
            count(of(), |answer| answer.is_right()),
            within(0.0, 1.0),
            within(1.0, 5.0),
            within(5.0, f64::INFINITY),
            number(after.get(after.len() / 2)),
            number(after.last()),
        );
    }
}

fn confusion(text: &mut String, answers: &[Answer]) {
    let mut columns: Vec<String> = answers.iter().map(Answer::column).collect();
    columns.sort();
    columns.dedup();
    let _ = writeln!(
        text,
        "\n## Confusion matrix\n\nRow: what was in the record. Column: what was answered.\n"
    );
    let _ = writeln!(
        text,
        "| | {} |\n|---|{}",
        columns.join(" | "),
        "---|".repeat(columns.len())
    );
    for effect in effects(answers) {
        let _ = write!(text, "| {effect} |");
        for column in &columns {
            let hits = answers
                .iter()
                .filter(|a| a.case.effect() == effect && a.column() == *column)
                .count();
            let cell = if hits == 0 {
                "·".to_owned()
            } else {
                hits.to_string()
            };
            let _ = write!(text, " {cell} |");
        }
        text.push('\n');
    }
}

/// Recovered torque by case.
pub fn torques(answers: &[Answer], checks: &[Torque]) -> String {
    let mut text = String::from(
        "\n## Torque recovered by `compensate` from the held-out record\n\n\
         | record | answer | signal error before / after | torque error, plain stand | refined stand | \
         before / after | after over noise |\n|---|---|---|---|---|---|---|\n",
    );
    for (answer, check) in answers.iter().zip(checks) {
        let show = |value: &Result<f64, String>| match value {
            Ok(rms) => format!("{rms:.4} N m"),
            Err(error) => error.lines().next().unwrap_or("failed").to_owned(),
        };
        let (plain, refined) = (
            check.plain.as_ref().copied().unwrap_or(f64::NAN),
            check.refined.as_ref().copied().unwrap_or(f64::NAN),
        );
        let _ = writeln!(
            text,
            "| {}/{:03} {} | {} | {:.2} | {} | {} | {:.2} | {:.2} |",
            answer.case.effect(),
            answer.case.number(),
            answer.case.variant(),
            answer.effects().join(", "),
            answer.error("before") / answer.error("after"),
            show(&check.plain),
            show(&check.refined),
            plain / refined,
            refined / check.floor,
        );
    }
    text
}
