use super::*;

/// Normally distributed numbers, seeded (Box-Muller over a xorshift generator).
struct Normal(u64);

impl Normal {
    fn next(&mut self) -> f64 {
        let mut uniform = || {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
        };
        (-2.0 * uniform().ln()).sqrt() * (TAU * uniform()).cos()
    }
}

fn waves(rate: f64, start: f64, count: usize, parts: &[(f64, f64, f64)]) -> Vec<f64> {
    (0..count)
        .map(|i| {
            let t = start + i as f64 / rate;
            parts
                .iter()
                .map(|(a, f, p)| a * (TAU * f * t + p).cos())
                .sum()
        })
        .collect()
}

#[test]
fn many_orders_come_back_exactly_from_a_broken_number_of_periods() {
    let parts: Vec<(f64, f64, f64)> = (1..=20)
        .map(|k| {
            (
                1.0 / f64::from(k),
                58.77 * f64::from(k),
                0.1 * f64::from(k) - 1.0,
            )
        })
        .collect();
    let x = waves(20_000.0, 0.25, 4321, &parts);
    let orders: Vec<f64> = (1..=20).map(f64::from).collect();
    let h = fit(&x, 20_000.0, 0.25, Fundamental::given(58.77), &orders).unwrap();
    assert!(h.mean.abs() < 1e-11 && h.residual_rms < 1e-10);
    for (component, (a, f, p)) in h.components.iter().zip(&parts) {
        let want = Complex64::from_polar(*a, *p);
        assert!(
            (component.phasor - want).norm() < 1e-9,
            "{f} Hz: {} {want}",
            component.phasor
        );
    }
}

#[test]
fn agrees_with_plain_normal_equations() {
    // The explicit design matrix solved by singular value decomposition: slow, but independent.
    let mut noise = Normal(3);
    let x: Vec<f64> = (0..301).map(|_| noise.next()).collect();
    let (rate, f1, orders) = (1000.0, 7.3, [0.5, 1.0, 2.0, 7.0]);
    let design = DMatrix::from_fn(301, 9, |i, j| {
        let t = i as f64 / rate;
        match j {
            0 => 1.0,
            _ if j % 2 == 1 => (TAU * f1 * orders[j / 2] * t).cos(),
            _ => (TAU * f1 * orders[j / 2 - 1] * t).sin(),
        }
    });
    let solution = design
        .svd(true, true)
        .solve(&DVector::from_vec(x.clone()), 1e-12)
        .unwrap();
    let h = fit(&x, rate, 0.0, Fundamental::given(f1), &orders).unwrap();
    assert!((h.mean - solution[0]).abs() < 1e-9);
    for (k, component) in h.components.iter().enumerate() {
        let want = Complex64::new(solution[2 * k + 1], -solution[2 * k + 2]);
        assert!((component.phasor - want).norm() < 1e-9);
    }
}

/// Runs many noisy fits; returns the ratio of the estimate's spread to the stated uncertainty.
fn spread_over_stated(colour: f64, refine: bool) -> (f64, f64) {
    let runs = 300;
    let (mut amplitude, mut stated, mut phase, mut stated_phase) = (0.0, 0.0, 0.0, 0.0);
    for run in 0..runs {
        let mut noise = Normal(1000 + run);
        let mut x = waves(2000.0, 0.0, 3000, &[(1.0, 50.2, 0.4)]);
        let mut state = 0.0;
        for value in &mut x {
            // First-order coloured noise: strong at low frequency for colour near 1.
            state = colour * state + noise.next();
            *value += 0.2 * state;
        }
        let f1 = if refine {
            refine_fundamental(&x, 2000.0, 50.0, 0.02, &[1.0]).unwrap()
        } else {
            Fundamental::given(50.2)
        };
        let h = fit(&x, 2000.0, 0.0, f1, &[1.0]).unwrap();
        let c = h.components[0];
        amplitude += (c.phasor.norm() - 1.0).powi(2);
        stated += c.std_amplitude.powi(2);
        phase += (c.phasor.arg() - 0.4).powi(2);
        stated_phase += c.std_phase_rad.unwrap().powi(2);
    }
    ((amplitude / stated).sqrt(), (phase / stated_phase).sqrt())
}

#[test]
fn stated_uncertainty_is_the_spread() {
    // 300 runs give a standard deviation to about 4 %; the bounds are three times that.
    for (colour, refine) in [(0.0, false), (0.9, false), (0.0, true), (0.9, true)] {
        let (amplitude, phase) = spread_over_stated(colour, refine);
        assert!(
            (0.87..1.14).contains(&amplitude),
            "{colour} {refine}: {amplitude}"
        );
        assert!(
            (0.87..1.14).contains(&phase),
            "{colour} {refine}: phase {phase}"
        );
    }
}

#[test]
fn a_strong_line_that_is_not_fitted_counts() {
    // The leakage of 3 at 588 Hz into 1 at 60 Hz within 0.3 s far exceeds the noise.
    let mut square = 0.0;
    let mut stated = 0.0;
    for run in 0..40 {
        let phase = 0.7 * f64::from(run);
        let parts = [(1.0, 60.0, 0.2), (1.0, 120.0, 1.0), (3.0, 588.3, phase)];
        let mut noise = Normal(50 + run as u64);
        let mut x = waves(20_000.0, 0.0, 6010, &parts);
        x.iter_mut().for_each(|v| *v += 0.001 * noise.next());
        let h = fit(&x, 20_000.0, 0.0, Fundamental::given(60.0), &[1.0, 2.0]).unwrap();
        square += (h.components[0].phasor - Complex64::from_polar(1.0, 0.2)).norm_sqr() / 2.0;
        stated += h.components[0].std_amplitude.powi(2);
    }
    let ratio = (square / stated).sqrt();
    assert!((0.3..1.6).contains(&ratio), "{ratio}");
}

#[test]
fn fundamental_is_found_over_many_periods() {
    let parts = [(0.2, 59.87, 0.0), (1.0, 119.74, 1.0), (0.4, 598.7, -0.5)];
    let mut noise = Normal(11);
    let mut x = waves(5000.0, 0.0, 300_000, &parts);
    x.iter_mut().for_each(|v| *v += 0.1 * noise.next() + 2.0);
    let found = refine_fundamental(&x, 5000.0, 60.0, 0.01, &[1.0, 2.0, 10.0]).unwrap();
    let std = found.std_hz.unwrap();
    assert!((found.frequency_hz - 59.87).abs() < 4.0 * std, "{found:?}");
    assert!(std < 1e-6, "{found:?}");
}

#[test]
fn a_fundamental_outside_the_span_is_refused() {
    let x = waves(1000.0, 0.0, 5000, &[(1.0, 55.0, 0.0)]);
    let refused = refine_fundamental(&x, 1000.0, 60.0, 0.01, &[1.0]);
    assert!(
        matches!(refused, Err(Error::NotRefined { .. })),
        "{refused:?}"
    );
}

#[test]
fn what_cannot_be_told_apart_is_refused() {
    let x = waves(1000.0, 0.0, 100, &[(1.0, 50.0, 0.0)]);
    let close = fit(&x, 1000.0, 0.0, Fundamental::given(50.0), &[1.0, 1.001]);
    assert!(
        matches!(close, Err(Error::NotSeparable { .. })),
        "{close:?}"
    );
    let same = fit(&x, 1000.0, 0.0, Fundamental::given(50.0), &[1.0, 1.0]);
    assert!(matches!(same, Err(Error::NotSeparable { .. })));
    // A tenth of a period cannot be separated from the constant.
    let slow = fit(&x, 1000.0, 0.0, Fundamental::given(0.1), &[1.0]);
    assert!(matches!(slow, Err(Error::NotSeparable { .. })));
    let high = fit(&x, 1000.0, 0.0, Fundamental::given(250.0), &[2.0]);
    assert!(matches!(high, Err(Error::AboveNyquist { .. })));
    let few = fit(&x[..3], 1000.0, 0.0, Fundamental::given(250.0), &[1.0]);
    assert!(matches!(few, Err(Error::TooShort { .. })));
}

/// 1 N m at 25 Hz for 4 s has side lobes between 30 and 40 Hz, where nothing turns.
#[test]
fn side_lobes_are_no_fundamental() {
    let rate_hz = 5000.0;
    let sample = |i: usize| {
        let turn = TAU * 25.0 * i as f64 / rate_hz;
        turn.cos() + 0.5 * (2.0 * turn).cos() + 0.2 * (6.0 * turn).cos()
    };
    let samples: Vec<f64> = (0..20_000).map(sample).collect();
    let refined = |start_hz: f64| {
        let found = refine_fundamental(&samples, rate_hz, start_hz, 0.02, &[1.0, 2.0, 3.0]);
        found.map(|found| found.frequency_hz)
    };
    for start_hz in [20.0, 28.0, 30.0, 31.0, 33.0, 35.0, 40.0, 45.0] {
        let found = refined(start_hz);
        assert!(found.is_err(), "{start_hz}: {found:?}");
    }
    assert!((refined(25.2).unwrap() - 25.0).abs() < 1e-3);
}
