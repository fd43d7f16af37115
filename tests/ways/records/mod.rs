//! Recordings of the five worked examples in `docs/ways`, made by integrating the stand's equation of motion,
//! independent of torqcomp.

mod bag;
mod bridge;
mod gage;
mod hammer;
mod stand;
mod transducer;

/// One worked example: its recordings and the torque that they were made from.
pub struct Way {
    /// Name of the page and of the folder.
    pub name: &'static str,
    pub files: Vec<(&'static str, Vec<u8>)>,
    /// Sampling rate of the run.
    pub rate_hz: f64,
    /// Torque on the stand while the run was recorded, N m, sample by sample.
    pub applied_n_m: Vec<f64>,
}

/// All five, in the order of the pages.
pub fn ways() -> [Way; 5] {
    [
        bridge::way(),
        transducer::way(),
        hammer::way(),
        gage::way(),
        bag::way(),
    ]
}
