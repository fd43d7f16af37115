//! Work that is shared among threads, with results that do not depend on how many there are.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{LazyLock, Mutex};

/// Threads beyond which sharing pays no more.
const MOST_THREADS: usize = 8;

/// Threads that the machine has for one job.
#[must_use]
pub fn threads() -> usize {
    cores().min(MOST_THREADS)
}

/// Cores that this process may use: as many as Slurm gives the task, and no more than the system (its cgroup included) has.
#[must_use]
pub fn cores() -> usize {
    // Linux reads files of the cgroup to tell.
    static SYSTEM: LazyLock<usize> =
        LazyLock::new(|| std::thread::available_parallelism().map_or(1, usize::from));
    let system = *SYSTEM;
    let slurm = std::env::var("SLURM_CPUS_PER_TASK").ok();
    let slurm = slurm.and_then(|text| text.parse::<usize>().ok());
    slurm
        .filter(|count| *count > 0)
        .map_or(system, |count| count.min(system))
}

/// Runs a job for each part of so many things, at most `most` of them together; results in their order.
pub fn in_parts<T: Send>(
    count: usize,
    most: usize,
    threads: usize,
    run: impl Fn(Range<usize>) -> T + Sync,
) -> Vec<T> {
    parallel(count.div_ceil(most), threads, |k| {
        run(k * most..((k + 1) * most).min(count))
    })
}

/// Runs jobs on all threads; results in the order of the jobs.
pub fn parallel<T: Send>(count: usize, threads: usize, run: impl Fn(usize) -> T + Sync) -> Vec<T> {
    if threads.min(count) < 2 {
        return (0..count).map(run).collect();
    }
    let next = AtomicUsize::new(0);
    let results: Vec<Mutex<Option<T>>> = (0..count).map(|_| Mutex::new(None)).collect();
    std::thread::scope(|scope| {
        for _ in 0..threads.min(count) {
            scope.spawn(|| {
                loop {
                    let job = next.fetch_add(1, Ordering::Relaxed);
                    if job >= count {
                        break;
                    }
                    let result = run(job);
                    *results[job].lock().unwrap_or_else(|e| e.into_inner()) = Some(result);
                }
            });
        }
    });
    results
        .into_iter()
        .filter_map(|slot| slot.into_inner().unwrap_or_else(|e| e.into_inner()))
        .collect()
}
