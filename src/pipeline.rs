//! Ordered work on many threads: serial and parallel stages over a stream of jobs.
//!
//! ```text
//! read ──► prepare ──► join ──► work ──► deliver
//! serial   parallel    serial   parallel serial
//! ```
//!
//! The serial stages see the jobs in order, so what is delivered, and the first error that `join`
//! finds, are the same with any number of threads. Every thread takes whatever job is nearest to the end. Jobs are reused,
//! so their buffers are allocated once, and their number bounds the memory.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Condvar, Mutex, MutexGuard};

/// The stages of a stream of jobs `J`; `E` is what stops it, `S` what each thread owns.
pub struct Stages<Read, Prepare, Join, Work, Deliver> {
    /// Fills a job; `false` at the end of the stream.
    pub read: Read,
    /// Does what needs no neighbour.
    pub prepare: Prepare,
    /// Takes jobs in order (`None` at the end) and hands on those that are complete, in order.
    pub join: Join,
    /// Does what needs neighbours, with the thread's own scratch.
    pub work: Work,
    /// Takes the finished jobs in order.
    pub deliver: Deliver,
}

struct State<J, E> {
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
    /// Jobs inside a stage right now.
    busy: usize,
    read_all: bool,
    joined_all: bool,
    error: Option<E>,
    /// A stage has panicked: nobody is to wait for its job.
    panicked: bool,
}

enum Task<J> {
    Deliver(J),
    Join(Option<J>),
    Work(usize, J),
    Read(usize, J),
    Leave,
}

/// Runs the stages on `scratch.len()` threads with `jobs` jobs to start with.
///
/// More jobs are made when all of them wait in `join`; that happens only if a job needs more
/// followers than there are jobs.
pub fn run<J, S, E, Read, Prepare, Join, Work, Deliver>(
    jobs: usize,
    scratch: Vec<S>,
    stages: Stages<Read, Prepare, Join, Work, Deliver>,
) -> Result<(), E>
where
    J: Default + Send,
    S: Send,
    E: Send,
    Read: FnMut(&mut J) -> Result<bool, E> + Send,
    Prepare: Fn(&mut J) + Sync,
    Join: FnMut(Option<J>, &mut dyn FnMut(J)) -> Result<(), E> + Send,
    Work: Fn(&mut S, &mut J) + Sync,
    Deliver: FnMut(&mut J) -> Result<(), E> + Send,
{
    let state = Mutex::new(State {
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
    });
    let changed = Condvar::new();
    let read = Mutex::new(stages.read);
    let join = Mutex::new(stages.join);
    let deliver = Mutex::new(stages.deliver);
    let (prepare, work) = (&stages.prepare, &stages.work);

    let worker = |mut own: S| {
        let _release = ReleaseOthers(&state, &changed);
        loop {
            let task = {
                let mut guard = lock(&state);
                loop {
                    match guard.take() {
                        Some(task) => break task,
                        None => guard = changed.wait(guard).unwrap_or_else(|e| e.into_inner()),
                    }
                }
            };
            match task {
                Task::Leave => break,
                Task::Deliver(mut job) => {
                    let result = (lock(&deliver))(&mut job);
                    let mut guard = lock(&state);
                    guard.delivering = false;
                    guard.next_deliver += 1;
                    guard.free.push(job);
                    guard.end(result);
                }
                Task::Join(job) => {
                    let last = job.is_none();
                    let mut ready = Vec::new();
                    let result = (lock(&join))(job, &mut |job| ready.push(job));
                    let mut guard = lock(&state);
                    guard.joining = false;
                    guard.joined_all = last;
                    for job in ready {
                        let place = guard.next_ready;
                        guard.next_ready += 1;
                        guard.ready.push_back((place, job));
                    }
                    guard.end(result);
                }
                Task::Work(place, mut job) => {
                    work(&mut own, &mut job);
                    let mut guard = lock(&state);
                    guard.worked.insert(place, job);
                    guard.end(Ok(()));
                }
                Task::Read(place, mut job) => {
                    let result = (lock(&read))(&mut job);
                    {
                        let mut guard = lock(&state);
                        guard.reading = false;
                        match result {
                            Ok(true) => guard.next_read += 1,
                            Ok(false) => guard.read_all = true,
                            Err(error) => {
                                guard.end(Err(error));
                                changed.notify_all();
                                continue;
                            }
                        }
                        if guard.read_all {
                            guard.free.push(job);
                            guard.end(Ok(()));
                            changed.notify_all();
                            continue;
                        }
                    }
                    changed.notify_all();
                    prepare(&mut job);
                    let mut guard = lock(&state);
                    guard.prepared.insert(place, job);
                    guard.end(Ok(()));
                }
            }
            changed.notify_all();
        }
    };

    std::thread::scope(|scope| {
        let mut scratch = scratch.into_iter();
        let first = scratch.next();
        for own in scratch {
            scope.spawn(|| worker(own));
        }
        if let Some(own) = first {
            worker(own);
        }
    });
    match state
        .into_inner()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
        .error
    {
        Some(error) => Err(error),
        None => Ok(()),
    }
}

/// Lets the other threads leave when the thread that holds it panics.
struct ReleaseOthers<'a, J, E>(&'a Mutex<State<J, E>>, &'a Condvar);

impl<J, E> Drop for ReleaseOthers<'_, J, E> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            lock(self.0).panicked = true;
            self.1.notify_all();
        }
    }
}

/// A panicking stage is passed on by the scope; the lock itself is not at fault.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}

impl<J: Default, E> State<J, E> {
    /// The task nearest to the end of the line; `None` if there is nothing to do right now.
    fn take(&mut self) -> Option<Task<J>> {
        if self.panicked
            || self.error.is_some()
            || (self.joined_all && self.next_deliver == self.next_ready)
        {
            return Some(Task::Leave);
        }
        let task = self.pick()?;
        self.busy += 1;
        Some(task)
    }

    fn pick(&mut self) -> Option<Task<J>> {
        if !self.delivering
            && let Some(job) = self.worked.remove(&self.next_deliver)
        {
            self.delivering = true;
            return Some(Task::Deliver(job));
        }
        if !self.joining && !self.joined_all {
            if let Some(job) = self.prepared.remove(&self.next_join) {
                self.joining = true;
                self.next_join += 1;
                return Some(Task::Join(Some(job)));
            }
            if self.read_all && self.next_join == self.next_read {
                self.joining = true;
                return Some(Task::Join(None));
            }
        }
        if let Some((place, job)) = self.ready.pop_front() {
            return Some(Task::Work(place, job));
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
        Some(Task::Read(self.next_read, job))
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
                read: |job: &mut Job| {
                    job.0 = vec![next];
                    next += 1;
                    Ok(next <= count)
                },
                prepare: |job: &mut Job| job.0.push(1),
                join: |job: Option<Job>, ready: &mut dyn FnMut(Job)| {
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
                },
                work: |_: &mut (), job: &mut Job| job.0[0] *= job.0[0],
                deliver: |job: &mut Job| {
                    out.push(job.0[0]);
                    Ok(())
                },
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
                run::<Job, (), (), _, _, _, _, _>(
                    3,
                    vec![(); threads],
                    Stages {
                        read: |_: &mut Job| {
                            count += 1;
                            Ok(count < 100)
                        },
                        prepare: |_: &mut Job| {},
                        join: |job: Option<Job>, ready: &mut dyn FnMut(Job)| {
                            job.into_iter().for_each(ready);
                            Ok(())
                        },
                        work: |_: &mut (), _: &mut Job| panic!("a fault in a stage"),
                        deliver: |_: &mut Job| Ok(()),
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
