//! Decaying phasors `e^{(−σ+jω)t}` at many moments.

use num_complex::Complex64;

use crate::identify::Pole;

/// Number of successive multiplications of a phasor on a uniform grid before rounding errors accumulate; elsewhere each
/// phasor costs a sine, a cosine and an exponential.
const BLOCK: usize = 64;
/// Error of a phasor, in addition to the rounding of its time, up to which times count as uniform.
const SAME: f64 = 1e-11;
/// Relative rounding error of a time for the comparison with a grid.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Calls a function with the index of each moment and the phasor there.
pub(super) fn turns(times_s: &[f64], pole: Pole, mut each: impl FnMut(usize, Complex64)) {
    let exponent = Complex64::new(-pole.rate_per_s, pole.omega_rad_per_s);
    let at = |time_s: f64| {
        let (sin, cos) = (exponent.im * time_s).sin_cos();
        (exponent.re * time_s).exp() * Complex64::new(cos, sin)
    };
    for (block, times_s) in times_s.chunks(BLOCK).enumerate() {
        let (first, last) = (times_s[0], times_s[times_s.len() - 1]);
        let step_s = (last - first) / (times_s.len() - 1).max(1) as f64;
        let is_on_grid = |(k, time_s): (usize, &f64)| {
            let off_s = (time_s - first - k as f64 * step_s).abs() - ROUNDING * last.abs();
            off_s * exponent.norm() < SAME
        };
        let is_uniform = times_s.iter().enumerate().all(is_on_grid);
        let (mut turn, step) = (at(first), at(if is_uniform { step_s } else { 0.0 }));
        for (k, time_s) in times_s.iter().enumerate() {
            if !is_uniform {
                turn = at(*time_s);
            }
            each(block * BLOCK + k, turn);
            turn *= step;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_of_many_moments_are_those_of_each() {
        let pole = Pole {
            rate_per_s: 0.4,
            omega_rad_per_s: 4000.0,
        };
        let uniform = |i: usize| i as f64 / 5000.0;
        // Every thousandth stamp is late.
        let uneven = |i: usize| uniform(i) + if i % 1000 == 7 { 1e-5 } else { 0.0 };
        for time_s in [&uniform as &dyn Fn(usize) -> f64, &uneven] {
            let times: Vec<f64> = (0..32_868).map(time_s).collect();
            let mut seen = 0;
            turns(&times, pole, |i, turn| {
                let t = times[i];
                let want = Complex64::from_polar((-0.4 * t).exp(), 4000.0 * t);
                assert!((turn - want).norm() < 3e-11, "{i}");
                seen += 1;
            });
            assert_eq!(seen, times.len());
        }
    }
}
