//! Verbs that read one recording at a time, and so take many.

use std::path::Path;

use super::{Outcome, compensate, extract, harmonics, inspect};
use crate::batch::{self, BatchTask, OneRun};
use crate::cli::{
    BatchOptions, Compensate, Extract, Format, Harmonics, Inspect, OneChannel, OutputArgs, Simulate,
};
use crate::failure::Failure;
use crate::outcome::Made;
use crate::{print, stand};

/// A verb that reads one recording at a time.
pub(super) trait OneByOne: Clone + Sync {
    /// What is asked for, of many recordings.
    fn task(&self) -> BatchTask<'_>;

    /// The same of one of them.
    fn of_one(&self, one: &OneRun) -> Self;

    /// Does the work on one recording.
    fn work(&self) -> Result<Made, Failure>;
}

/// Whether these arguments ask for many recordings, each by itself.
pub(super) fn are_asked(args: &impl OneByOne) -> bool {
    let task = args.task();
    batch::is_asked(task.inputs, task.many, task.result)
}

/// Runs a verb over one recording or many; `options` are those that its results may depend on.
pub(super) fn run(args: &impl OneByOne, options: &[String]) -> Result<Outcome, Failure> {
    let task = args.task();
    if !are_asked(args) && !batch::is_several(task.inputs) {
        return args.work()?.publish();
    }
    if let ([folder], true, false) = (task.inputs, task.result.is_stdout(), are_asked(args)) {
        return Err(Failure::failed(format_args!(
            "{folder}: the results of several recordings need a folder; give -o FOLDER/"
        )));
    }
    // A fault of the stand file would be said for each recording.
    if let Some(path) = task.stand {
        stand::read(path)?;
    }
    print::hide_progress();
    batch::run(&task, options, &|one| args.of_one(one).work())
}

/// Arguments of a channel for one recording.
fn channel(record: &OneChannel, one: &OneRun) -> OneChannel {
    OneChannel {
        inputs: vec![one.input.to_owned()],
        many: BatchOptions::default(),
        ..record.clone()
    }
}

/// Arguments of the result for one recording.
fn result(result: &OutputArgs, one: &OneRun) -> OutputArgs {
    OutputArgs {
        output: one.outputs.first().map(|path| path.display().to_string()),
        force: one.replace,
        ..result.clone()
    }
}

/// Names and values of the options that are given.
fn given<'a, const N: usize>(
    options: [(&'static str, Option<&'a Path>); N],
) -> Vec<(&'static str, &'a Path)> {
    let options = options.into_iter();
    options
        .filter_map(|(name, path)| Some((name, path?)))
        .collect()
}

impl OneByOne for Compensate {
    fn task(&self) -> BatchTask<'_> {
        BatchTask {
            verb: "compensate",
            inputs: &self.record.inputs,
            many: &self.record.many,
            result: &self.result,
            name: match self.format {
                Some(Format::Mcap) => "{stem}.torque.mcap",
                _ => "{stem}.torque.csv",
            },
            beside: given([
                ("--plot", self.plot.as_deref()),
                ("--html", self.html.as_deref()),
            ]),
            stand: Some(&self.stand),
            as_json: self.json,
            makes_json: false,
            is_quiet: self.work.quiet,
        }
    }

    fn of_one(&self, one: &OneRun) -> Self {
        let mut args = self.clone();
        args.record = channel(&self.record, one);
        args.result = result(&self.result, one);
        let mut beside = one.outputs.iter().skip(1).cloned();
        args.plot = self.plot.as_ref().and_then(|_| beside.next());
        args.html = self.html.as_ref().and_then(|_| beside.next());
        args.work.threads = self.work.threads.or(u16::try_from(one.threads).ok());
        args
    }

    fn work(&self) -> Result<Made, Failure> {
        compensate::work(self)
    }
}

impl OneByOne for Extract {
    fn task(&self) -> BatchTask<'_> {
        BatchTask {
            verb: "extract",
            inputs: &self.record.inputs,
            many: &self.record.many,
            result: &self.result,
            name: "{stem}.rows.csv",
            beside: Vec::new(),
            stand: None,
            as_json: false,
            makes_json: false,
            is_quiet: self.quiet,
        }
    }

    fn of_one(&self, one: &OneRun) -> Self {
        Self {
            record: channel(&self.record, one),
            result: result(&self.result, one),
            ..self.clone()
        }
    }

    fn work(&self) -> Result<Made, Failure> {
        extract::work(self)
    }
}

impl OneByOne for Harmonics {
    fn task(&self) -> BatchTask<'_> {
        BatchTask {
            verb: "harmonics",
            inputs: &self.record.inputs,
            many: &self.record.many,
            result: &self.result,
            name: match self.json {
                true => "{stem}.harmonics.json",
                false => "{stem}.harmonics.txt",
            },
            beside: Vec::new(),
            stand: self.stand.as_deref(),
            as_json: self.json,
            makes_json: self.json,
            is_quiet: false,
        }
    }

    fn of_one(&self, one: &OneRun) -> Self {
        Self {
            record: channel(&self.record, one),
            result: result(&self.result, one),
            ..self.clone()
        }
    }

    fn work(&self) -> Result<Made, Failure> {
        harmonics::work(self)
    }
}

impl OneByOne for Inspect {
    fn task(&self) -> BatchTask<'_> {
        BatchTask {
            verb: "inspect",
            inputs: &self.files,
            many: &self.many,
            result: &self.result,
            name: match self.json {
                true => "{stem}.inspect.json",
                false => "{stem}.inspect.txt",
            },
            beside: given([("--plot", self.plot.as_deref())]),
            stand: None,
            as_json: self.json,
            makes_json: self.json,
            is_quiet: false,
        }
    }

    fn of_one(&self, one: &OneRun) -> Self {
        Self {
            files: vec![one.input.to_owned()],
            many: BatchOptions::default(),
            result: result(&self.result, one),
            plot: self.plot.as_ref().and(one.outputs.get(1)).cloned(),
            ..self.clone()
        }
    }

    fn work(&self) -> Result<Made, Failure> {
        inspect::work(self)
    }
}

impl OneByOne for Simulate {
    fn task(&self) -> BatchTask<'_> {
        BatchTask {
            verb: "simulate",
            inputs: &self.inputs,
            many: &self.many,
            result: &self.result,
            name: "{stem}.simulated.csv",
            beside: Vec::new(),
            stand: Some(&self.stand),
            as_json: self.json,
            makes_json: false,
            is_quiet: self.quiet,
        }
    }

    fn of_one(&self, one: &OneRun) -> Self {
        Self {
            inputs: vec![one.input.to_owned()],
            many: BatchOptions::default(),
            result: result(&self.result, one),
            ..self.clone()
        }
    }

    fn work(&self) -> Result<Made, Failure> {
        super::simulate::work(self)
    }
}
