//! Fault injection: tests make any one system call fail and examine the result. Optimised builds have none of this.
//!
//! `TORQCOMP_FAULT="write 2 28"` makes the third write fail with the error number 28, `"write * 28"` every one. Instead of
//! the error number, `short` moves one byte only, and `abort` ends the process immediately. `TORQCOMP_FAULT_LOG` names a file that lists the
//! calls of a run.

use std::io;

/// A system call that may fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Call {
    Open,
    Create,
    /// Of a file without a name, which not every system has.
    #[cfg_attr(not(target_os = "linux"), allow(dead_code))]
    Unnamed,
    Read,
    Write,
    Sync,
    Link,
    Rename,
}

/// Number of bytes a call may move, or its failure.
#[cfg(not(debug_assertions))]
#[inline(always)]
pub fn limit(_: Call, bytes: usize) -> io::Result<usize> {
    Ok(bytes)
}

/// Number of bytes a call may move, or its failure.
#[cfg(debug_assertions)]
pub fn limit(call: Call, bytes: usize) -> io::Result<usize> {
    use std::sync::LazyLock;
    use std::sync::atomic::{AtomicUsize, Ordering};

    static COUNTS: [AtomicUsize; Call::Rename as usize + 1] =
        [const { AtomicUsize::new(0) }; Call::Rename as usize + 1];
    static PLAN: LazyLock<(Option<String>, Option<String>)> = LazyLock::new(|| {
        let variable = |name| std::env::var(name).ok();
        (variable("TORQCOMP_FAULT"), variable("TORQCOMP_FAULT_LOG"))
    });
    let (fault, log) = &*PLAN;
    let name = format!("{call:?}").to_lowercase();
    if let Some(path) = log {
        let mut file = std::fs::File::options()
            .append(true)
            .create(true)
            .open(path)?;
        io::Write::write_all(&mut file, format!("{name}\n").as_bytes())?;
    }
    let Some(fault) = fault else {
        return Ok(bytes);
    };
    let count = COUNTS[call as usize].fetch_add(1, Ordering::Relaxed);
    let ending = fault.strip_prefix(&name).and_then(|fault| {
        let this = fault.strip_prefix(&format!(" {count} "));
        this.or_else(|| fault.strip_prefix(" * "))
    });
    match ending {
        None => Ok(bytes),
        Some("short") => Ok(bytes.min(1)),
        Some("abort") => std::process::abort(),
        Some(number) => {
            let number = number.parse().expect("an error number, short or abort");
            Err(io::Error::from_raw_os_error(number))
        }
    }
}

/// Failure of a call that moves no bytes.
pub fn check(call: Call) -> io::Result<()> {
    limit(call, 0).map(|_| ())
}
