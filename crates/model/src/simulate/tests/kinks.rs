//! A signal with kinks through a filter: it is filtered before it is sampled.

use super::*;

const GAP: f64 = 0.3;
const CUTOFF_HZ: f64 = 6000.0;

/// A gap in the load path, whose signal has kinks, and a first-order low-pass.
#[test]
fn a_signal_with_kinks_is_filtered_before_it_is_sampled() {
    let w = MODE.omega_rad_s;
    let truth = oracle(|t, [filtered, x, v]| {
        let shown = x - x.clamp(-GAP, GAP);
        let acceleration = w * w * (input_at(t) - shown) - 2.0 * MODE.damping_ratio * w * v;
        [TAU * CUTOFF_HZ * (shown - filtered), v, acceleration]
    });
    let gap: (&str, &str, &[f64]) = ("backlash", "gap", &[GAP]);
    let low_pass: (&str, &str, &[f64]) = ("recorder-lowpass", "order-1", &[CUTOFF_HZ]);
    let input = input(24);
    // The samples alone, filtered.
    let sampled = chain(&[gap]).simulate(&input, MotionState::default());
    let lines = input.transform(&sampled).into_iter().enumerate();
    let filtered = lines.map(|(k, y)| {
        let ratio = input.omega_rad_s(k) / (TAU * CUTOFF_HZ);
        y / num_complex::Complex64::new(1.0, ratio)
    });
    let sampled = input.samples_of(filtered.collect());
    let off = |found: &[f64]| rms(found.iter().zip(&truth).map(|(a, b)| a - b));
    let model = chain(&[gap, low_pass]);
    let found = model.simulate(&input, MotionState::default());
    let relative = off(&found) / rms(truth.iter().copied());
    assert!(relative < 5e-4, "{relative:e}");
    assert!(off(&found) < 0.2 * off(&sampled), "{:e}", off(&sampled));

    let mut in_pieces = Vec::new();
    let mut pieces = crate::simulate::Pieces::new(&model, RATE_HZ, Between::BandLimited);
    pieces.push(input.samples(), &mut in_pieces).unwrap();
    pieces.finish(&mut in_pieces).unwrap();
    assert!(
        off(&in_pieces) < 0.4 * off(&sampled),
        "{:e}",
        off(&in_pieces)
    );
}
