//! Verbs that read one recording at a time, and therefore accept many.

use std::path::{Path, PathBuf};

use super::{Outcome, compensate, extract, harmonics, inspect};
use crate::batch::{self, BatchTask, OneRun};
use crate::cli::{
    BatchOptions, Compensate, Extract, Format, Harmonics, Inspect, OutputArgs, Simulate,
};
use crate::failure::{ErrorCode, Failure};
use crate::file_name::ShowPath;
use crate::outcome::Made;
use crate::stand;

/// A verb that reads one recording at a time.
pub(super) trait OneByOne: Clone + Sync {
    /// Arguments for many recordings.
    fn task(&self) -> BatchTask<'_>;

    /// Arguments of a single recording.
    fn own(&mut self) -> Own<'_>;

    /// The same verb for a single recording.
    fn of_one(&self, one: &OneRun) -> Self {
        let mut args = self.clone();
        let own = args.own();
        *own.inputs = vec![one.input.to_owned()];
        *own.many = BatchOptions::default();
        own.result.force = one.replace;
        own.result.output = one.outputs.first().cloned();
        for (asked, path) in own.beside.into_iter().zip(one.outputs.iter().skip(1)) {
            asked.clone_from(path);
        }
        if let Some(threads) = own.threads {
            *threads = threads.or(u16::try_from(one.threads).ok());
        }
        args
    }

    /// Does the work on one recording.
    fn work(&self) -> Result<Made, Failure>;
}

/// Arguments that differ between recordings.
pub(super) struct Own<'a> {
    inputs: &'a mut Vec<PathBuf>,
    many: &'a mut BatchOptions,
    result: &'a mut OutputArgs,
    /// Additional outputs besides the result, in the order of [`BatchTask::beside`].
    beside: Vec<&'a mut PathBuf>,
    /// For a verb that shares its work on one recording among threads.
    threads: Option<&'a mut Option<u16>>,
}

impl<'a> Own<'a> {
    /// For a verb with one result, on one thread.
    fn of(
        inputs: &'a mut Vec<PathBuf>,
        many: &'a mut BatchOptions,
        result: &'a mut OutputArgs,
    ) -> Self {
        Self {
            inputs,
            many,
            result,
            beside: Vec::new(),
            threads: None,
        }
    }
}

/// Whether these arguments request separate processing of many recordings.
pub(super) fn are_asked(args: &impl OneByOne) -> bool {
    let task = args.task();
    batch::is_asked(task.inputs, task.many, task.result)
}

/// Runs a verb on one recording or many; `options` are those that may affect its results.
pub(super) fn run(args: &impl OneByOne, options: &[String]) -> Result<Outcome, Failure> {
    let task = args.task();
    if !are_asked(args) && !batch::is_several(task.inputs) {
        return args.work()?.publish();
    }
    if let ([folder], true, false) = (task.inputs, task.result.is_stdout(), are_asked(args)) {
        return Err(ErrorCode::MissingArgument
            .failed(format_args!("{}", batch::NEED_FOLDER))
            .at(folder.shown()));
    }
    // A fault in the stand file would be reported for each recording.
    if let Some(path) = task.stand {
        stand::read(path)?;
    }
    batch::run(&task, options, &|one| args.of_one(one).work())
}

/// Names and values of the given options.
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
        }
    }

    fn own(&mut self) -> Own<'_> {
        let record = &mut self.record;
        let beside = [self.plot.as_mut(), self.html.as_mut()];
        Own {
            beside: beside.into_iter().flatten().collect(),
            threads: Some(&mut self.work.threads),
            ..Own::of(&mut record.inputs, &mut record.many, &mut self.result)
        }
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
        }
    }

    fn own(&mut self) -> Own<'_> {
        let record = &mut self.record;
        Own::of(&mut record.inputs, &mut record.many, &mut self.result)
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
        }
    }

    fn own(&mut self) -> Own<'_> {
        let record = &mut self.record;
        Own::of(&mut record.inputs, &mut record.many, &mut self.result)
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
        }
    }

    fn own(&mut self) -> Own<'_> {
        Own {
            beside: self.plot.as_mut().into_iter().collect(),
            ..Own::of(&mut self.files, &mut self.many, &mut self.result)
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
        }
    }

    fn own(&mut self) -> Own<'_> {
        Own::of(&mut self.inputs, &mut self.many, &mut self.result)
    }

    fn work(&self) -> Result<Made, Failure> {
        super::simulate::work(self)
    }
}
