//! Transforms planned before, so that their tables of sines are not computed again.

use std::cell::RefCell;

use realfft::RealFftPlanner;

/// Sum of the lengths whose tables a thread keeps: about 16 bytes per sample for each direction.
const MOST_KEPT: usize = 1 << 18;

/// A planner, and the lengths whose transforms it keeps.
#[derive(Default)]
struct Plans {
    planner: RealFftPlanner<f64>,
    lengths: Vec<usize>,
}

thread_local! {
    static PLANS: RefCell<Plans> = RefCell::default();
}

/// The transform of a planner that remembers earlier ones, unless the length is too large to be kept.
pub fn with_planner<T>(length: usize, plan: impl FnOnce(&mut RealFftPlanner<f64>) -> T) -> T {
    if length > MOST_KEPT {
        return plan(&mut RealFftPlanner::new());
    }
    PLANS.with_borrow_mut(|plans| {
        if !plans.lengths.contains(&length) {
            if plans.lengths.iter().sum::<usize>() + length > MOST_KEPT {
                *plans = Plans::default();
            }
            plans.lengths.push(length);
        }
        plan(&mut plans.planner)
    })
}
