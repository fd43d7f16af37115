//! Whether the caller closed standard output: before `main`, Rust's runtime opens `/dev/null` in place of a closed one, and
//! results would vanish there.

use std::io;

/// Fails if there was no standard output at the start.
pub(super) fn is_there() -> io::Result<()> {
    match was_closed() {
        false => Ok(()),
        true => Err(io::Error::other(
            "it is closed; redirect it to a file or to /dev/null, or give -o FILE",
        )),
    }
}

#[cfg(not(target_os = "linux"))]
fn was_closed() -> bool {
    false
}

#[cfg(target_os = "linux")]
fn was_closed() -> bool {
    before_main::WAS_CLOSED.load(std::sync::atomic::Ordering::Relaxed)
}

#[cfg(target_os = "linux")]
mod before_main {
    use std::sync::atomic::{AtomicBool, Ordering};

    pub(super) static WAS_CLOSED: AtomicBool = AtomicBool::new(false);

    extern "C" fn look() {
        let flags = rustix::io::fcntl_getfd(rustix::stdio::stdout());
        WAS_CLOSED.store(flags.is_err(), Ordering::Relaxed);
    }

    /// The C library calls the functions of this section before `main`. `look` makes one system call and needs nothing
    /// of the runtime.
    #[used]
    #[allow(unsafe_code)]
    #[unsafe(link_section = ".init_array")]
    static LOOK: extern "C" fn() = look;
}
