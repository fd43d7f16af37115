//! Ordered work on many threads: serial and parallel stages over a stream of jobs.
//!
//! ```text
//! read ──► prepare ──► join ──► work ──► deliver
//! serial   parallel    serial   parallel serial
//! ```
//!
//! The serial stages see the jobs in order, so the delivered results, and the first error that `join`
//! finds, do not depend on the number of threads. Every thread takes the job nearest to the end. Jobs are reused,
//! so their buffers are allocated once, and their number bounds the memory.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// The stages of a stream of jobs `J`; `E`: error that stops it, `S`: scratch of each thread.
pub struct Stages<'a, J, S, E> {
    /// Fills a job; `false` at the end of the stream.
    pub read: Box<Serial<'a, J, bool, E>>,
    /// Work on a job that needs no neighbours.
    pub prepare: Box<dyn Fn(&mut J) + Sync + 'a>,
    /// Takes jobs in order (`None` at the end) and passes on the complete ones, in order.
    pub join: Box<Join<'a, J, E>>,
    /// Work that needs neighbours, with the thread's own scratch.
    pub work: Box<WithScratch<'a, S, J>>,
    /// Takes the finished jobs in order.
    pub deliver: Box<Serial<'a, J, (), E>>,
}

/// A serial stage.
type Serial<'a, J, T, E> = dyn FnMut(&mut J) -> Result<T, E> + Send + 'a;

/// A stage run by any thread, with the thread's own scratch.
type WithScratch<'a, S, J> = dyn Fn(&mut S, &mut J) + Sync + 'a;

/// Takes a job and passes on others.
type Join<'a, J, E> = dyn FnMut(Option<J>, &mut dyn FnMut(J)) -> Result<(), E> + Send + 'a;

/// The stages and their state, shared by all threads.
struct SharedStages<'a, J, S, E> {
    state: Mutex<PipelineState<J, E>>,
    changed: Condvar,
    read: Mutex<Box<Serial<'a, J, bool, E>>>,
    prepare: Box<dyn Fn(&mut J) + Sync + 'a>,
    join: Mutex<Box<Join<'a, J, E>>>,
    work: Box<WithScratch<'a, S, J>>,
    deliver: Mutex<Box<Serial<'a, J, (), E>>>,
}

struct PipelineState<J, E> {
    free: Vec<J>,
    prepared: BTreeMap<usize, J>,
    ready: VecDeque<(usize, J)>,
    worked: BTreeMap<usize, J>,
    next_read: usize,
    next_join: usize,
    next_ready: usize,
    next_deliver: usize,
    reading: bool,
    joining: bool,
    delivering: bool,
    /// Number of jobs currently inside a stage.
    busy: usize,
    read_all: bool,
    joined_all: bool,
    error: Option<E>,
    /// Whether a stage has panicked, so that no thread waits for its job.
    panicked: bool,
}

enum PipelineTask<J> {
    Deliver(J),
    Join(Option<J>),
    Work(usize, J),
    Read(usize, J),
    Leave,
}

/// Runs the stages on `scratch.len()` threads, initially with `jobs` jobs.
///
/// More jobs are created when all of them wait in `join`; this happens only if a job needs more
/// followers than there are jobs.
pub fn run<J, S, E>(jobs: usize, scratch: Vec<S>, stages: Stages<J, S, E>) -> Result<(), E>
where
    J: Default + Send,
    S: Send,
    E: Send,
{
    let line = SharedStages {
        state: Mutex::new(PipelineState::new(jobs)),
        changed: Condvar::new(),
        read: Mutex::new(stages.read),
        prepare: stages.prepare,
        join: Mutex::new(stages.join),
        work: stages.work,
        deliver: Mutex::new(stages.deliver),
    };
    std::thread::scope(|scope| {
        let mut scratch = scratch.into_iter();
        let first = scratch.next();
        for own in scratch {
            let line = &line;
            scope.spawn(move || line.run(own));
        }
        if let Some(own) = first {
            line.run(own);
        }
    });
    let state = line.state.into_inner();
    let error = state.unwrap_or_else(PoisonError::into_inner).error;
    error.map_or(Ok(()), Err)
}

impl<J: Default, S, E> SharedStages<'_, J, S, E> {
    /// Runs tasks until none are left.
    fn run(&self, mut own: S) {
        let _release = ReleaseOthers(&self.state, &self.changed);
        loop {
            match self.next_task() {
                PipelineTask::Leave => break,
                PipelineTask::Deliver(job) => self.deliver(job),
                PipelineTask::Join(job) => self.join(job),
                PipelineTask::Work(place, mut job) => {
                    (self.work)(&mut own, &mut job);
                    let mut state = lock(&self.state);
                    state.worked.insert(place, job);
                    state.end(Ok(()));
                }
                PipelineTask::Read(place, job) => self.read(place, job),
            }
            self.changed.notify_all();
        }
    }

    fn next_task(&self) -> PipelineTask<J> {
        let mut state = lock(&self.state);
        loop {
            match state.take() {
                Some(task) => return task,
                None => {
                    let waited = self.changed.wait(state);
                    state = waited.unwrap_or_else(PoisonError::into_inner);
                }
            }
        }
    }

    fn deliver(&self, mut job: J) {
        let result = (lock(&self.deliver))(&mut job);
        let mut state = lock(&self.state);
        state.delivering = false;
        state.next_deliver += 1;
        state.free.push(job);
        state.end(result);
    }

    fn join(&self, job: Option<J>) {
        let is_last = job.is_none();
        let mut ready = Vec::new();
        let result = (lock(&self.join))(job, &mut |job| ready.push(job));
        let mut state = lock(&self.state);
        state.joining = false;
        state.joined_all = is_last;
        for job in ready {
            let place = state.next_ready;
            state.next_ready += 1;
            state.ready.push_back((place, job));
        }
        state.end(result);
    }

    fn read(&self, place: usize, mut job: J) {
        let result = (lock(&self.read))(&mut job);
        let mut state = lock(&self.state);
        state.reading = false;
        match result {
            Ok(true) => state.next_read += 1,
            Ok(false) => {
                state.read_all = true;
                state.free.push(job);
                return state.end(Ok(()));
            }
            Err(error) => return state.end(Err(error)),
        }
        drop(state);
        // Another thread can read the next job while this one is prepared.
        self.changed.notify_all();
        (self.prepare)(&mut job);
        let mut state = lock(&self.state);
        state.prepared.insert(place, job);
        state.end(Ok(()));
    }
}

/// Releases the other threads if the owning thread panics.
struct ReleaseOthers<'a, J, E>(&'a Mutex<PipelineState<J, E>>, &'a Condvar);

impl<J, E> Drop for ReleaseOthers<'_, J, E> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            lock(self.0).panicked = true;
            self.1.notify_all();
        }
    }
}

/// The scope propagates the panic of a stage; the poisoned lock itself can be used.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl<J: Default, E> PipelineState<J, E> {
    fn new(jobs: usize) -> Self {
        Self {
            free: (0..jobs).map(|_| J::default()).collect(),
            prepared: BTreeMap::new(),
            ready: VecDeque::new(),
            worked: BTreeMap::new(),
            next_read: 0,
            next_join: 0,
            next_ready: 0,
            next_deliver: 0,
            reading: false,
            joining: false,
            delivering: false,
            busy: 0,
            read_all: false,
            joined_all: false,
            error: None,
            panicked: false,
        }
    }

    /// The task nearest to the end of the pipeline; `None` if there is nothing to do at the moment.
    fn take(&mut self) -> Option<PipelineTask<J>> {
        if self.panicked
            || self.error.is_some()
            || (self.joined_all && self.next_deliver == self.next_ready)
        {
            return Some(PipelineTask::Leave);
        }
        let task = self.pick()?;
        self.busy += 1;
        Some(task)
    }

    fn pick(&mut self) -> Option<PipelineTask<J>> {
        if !self.delivering
            && let Some(job) = self.worked.remove(&self.next_deliver)
        {
            self.delivering = true;
            return Some(PipelineTask::Deliver(job));
        }
        if !self.joining && !self.joined_all {
            if let Some(job) = self.prepared.remove(&self.next_join) {
                self.joining = true;
                self.next_join += 1;
                return Some(PipelineTask::Join(Some(job)));
            }
            if self.read_all && self.next_join == self.next_read {
                self.joining = true;
                return Some(PipelineTask::Join(None));
            }
        }
        if let Some((place, job)) = self.ready.pop_front() {
            return Some(PipelineTask::Work(place, job));
        }
        if self.reading || self.read_all {
            return None;
        }
        let all_wait_in_join = self.busy == 0;
        let job = match self.free.pop() {
            None if all_wait_in_join => J::default(),
            other => other?,
        };
        self.reading = true;
        Some(PipelineTask::Read(self.next_read, job))
    }

    fn end(&mut self, result: Result<(), E>) {
        self.busy -= 1;
        if let Err(error) = result
            && self.error.is_none()
        {
            self.error = Some(error);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Default)]
    struct Job(Vec<u64>);

    /// Squares numbers; `join` holds each job back until `held` more have arrived.
    fn squares(
        count: u64,
        threads: usize,
        held: usize,
        fail_at: Option<u64>,
    ) -> (Vec<u64>, Option<u64>) {
        let mut next = 0;
        let mut waiting = VecDeque::new();
        let mut out = Vec::new();
        let result = run(
            3,
            vec![(); threads],
            Stages {
                read: Box::new(|job: &mut Job| {
                    job.0 = vec![next];
                    next += 1;
                    Ok(next <= count)
                }),
                prepare: Box::new(|job: &mut Job| job.0.push(1)),
                join: Box::new(|job: Option<Job>, ready: &mut dyn FnMut(Job)| {
                    let end = job.is_none();
                    if let Some(job) = &job
                        && Some(job.0[0]) == fail_at
                    {
                        return Err(job.0[0]);
                    }
                    waiting.extend(job);
                    while waiting.len() > if end { 0 } else { held } {
                        ready(waiting.pop_front().unwrap());
                    }
                    Ok(())
                }),
                work: Box::new(|_: &mut (), job: &mut Job| job.0[0] *= job.0[0]),
                deliver: Box::new(|job: &mut Job| {
                    out.push(job.0[0]);
                    Ok(())
                }),
            },
        );
        (out, result.err())
    }

    #[test]
    fn order_is_kept_whatever_the_threads() {
        let expected: Vec<u64> = (0..500).map(|n| n * n).collect();
        for threads in [1, 2, 5] {
            for held in [0, 1, 20] {
                let (out, error) = squares(500, threads, held, None);
                assert_eq!(out, expected, "{threads} threads, {held} held");
                assert_eq!(error, None);
            }
        }
    }

    #[test]
    fn nothing_to_read_is_fine() {
        assert_eq!(squares(0, 2, 1, None), (vec![], None));
    }

    #[test]
    fn a_panic_does_not_leave_the_others_waiting() {
        for threads in [1, 3] {
            let result = std::panic::catch_unwind(|| {
                let mut count = 0;
                run::<Job, (), ()>(
                    3,
                    vec![(); threads],
                    Stages {
                        read: Box::new(|_: &mut Job| {
                            count += 1;
                            Ok(count < 100)
                        }),
                        prepare: Box::new(|_: &mut Job| {}),
                        join: Box::new(|job: Option<Job>, ready: &mut dyn FnMut(Job)| {
                            job.into_iter().for_each(ready);
                            Ok(())
                        }),
                        work: Box::new(|_: &mut (), _: &mut Job| panic!("a fault in a stage")),
                        deliver: Box::new(|_: &mut Job| Ok(())),
                    },
                )
            });
            assert!(result.is_err());
        }
    }

    #[test]
    fn an_error_stops_the_stream() {
        for threads in [1, 3] {
            let (out, error) = squares(1000, threads, 0, Some(40));
            assert_eq!(error, Some(40));
            assert!(out.len() <= 40);
        }
    }
}
