//! Work shared among threads; results do not depend on the number of threads.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{LazyLock, Mutex};

/// Number of threads beyond which more bring no gain.
const MOST_THREADS: usize = 8;

/// Threads available for one job.
pub fn threads() -> usize {
    cores().min(MOST_THREADS)
}

/// Cores available to this process: those that Slurm assigns to the task, limited by the system (including its cgroup).
pub fn cores() -> usize {
    // On Linux, this reads files of the cgroup.
    static SYSTEM: LazyLock<usize> =
        LazyLock::new(|| std::thread::available_parallelism().map_or(1, usize::from));
    let system = *SYSTEM;
    let slurm = std::env::var("SLURM_CPUS_PER_TASK").ok();
    let slurm = slurm.and_then(|text| text.parse::<usize>().ok());
    slurm
        .filter(|count| *count > 0)
        .map_or(system, |count| count.min(system))
}

/// Runs a job for each part of a number of items, with at most `most` items per part; results in order.
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

/// Runs jobs on all threads; results in job order.
pub fn parallel<T: Send>(count: usize, threads: usize, run: impl Fn(usize) -> T + Sync) -> Vec<T> {
    if threads.min(count) < 2 {
        return (0..count).map(run).collect();
    }
    let next = AtomicUsize::new(0);
    let results: Vec<Mutex<Option<T>>> = (0..count).map(|_| Mutex::new(None)).collect();
    let work = || {
        loop {
            let job = next.fetch_add(1, Ordering::Relaxed);
            if job >= count {
                break;
            }
            let result = run(job);
            *results[job].lock().unwrap_or_else(|e| e.into_inner()) = Some(result);
        }
    };
    // This thread works, too: the memory that a thread has freed serves no other thread.
    std::thread::scope(|scope| {
        for _ in 1..threads.min(count) {
            scope.spawn(work);
        }
        work();
    });
    results
        .into_iter()
        .filter_map(|slot| slot.into_inner().unwrap_or_else(|e| e.into_inner()))
        .collect()
}
