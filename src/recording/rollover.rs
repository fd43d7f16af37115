//! Counters that start again at zero after their largest number: `micros()` of an Arduino after 71.6 minutes.

/// Bits of counters, and the duration of their ticks in s.
const BITS: [i32; 3] = [16, 24, 32];
const TICKS_S: [f64; 4] = [1e-9, 1e-6, 1e-3, 1.0];
/// Largest deviation of the step across the end from the usual one.
const USUAL: f64 = 0.25;
/// Minimum number of steps before a counter starts again.
const STEPS: f64 = 20.0;

/// Number of bits of the counter that starts again between two stamps, if the step is then a usual one.
pub(crate) fn rolled_over(before_s: f64, after_s: f64, step_s: f64) -> Option<i32> {
    let is_it = |bits: &i32| {
        TICKS_S.iter().any(|tick_s| {
            let span_s = 2.0_f64.powi(*bits) * tick_s;
            let step = (after_s + span_s - before_s) / step_s;
            let is_end = before_s < span_s && (0.0..2.0 * step_s).contains(&after_s);
            is_end && span_s > STEPS * step_s && (step - 1.0).abs() < USUAL
        })
    };
    BITS.into_iter().find(is_it)
}

#[cfg(test)]
mod tests {
    use super::rolled_over;

    #[test]
    fn a_counter_that_starts_again_is_told_from_a_clock_set_back() {
        assert_eq!(rolled_over(4_294.967_196, 0.0, 1e-4), Some(32));
        assert_eq!(rolled_over(65.535, 0.0, 1e-3), Some(16));
        assert_eq!(rolled_over(4_294.967_196, 0.001, 1e-4), None);
        assert_eq!(rolled_over(12.0, 0.0, 1e-4), None);
        assert_eq!(rolled_over(4294.0, 0.0, 1e-4), None);
    }
}
