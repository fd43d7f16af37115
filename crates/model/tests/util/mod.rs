//! Helpers shared by the tests.

/// Fails with got, want and difference unless both agree to a relative tolerance.
#[track_caller]
pub fn assert_close(got: f64, want: f64, relative: f64) {
    let difference = (got - want).abs() / want.abs();
    assert!(
        difference <= relative,
        "got {got:e}, want {want:e}, relative difference {difference:e}"
    );
}

/// SplitMix64, a small generator of pseudo-random numbers with a fixed seed.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Even distribution over 0 < x < 1.
    pub fn uniform(&mut self) -> f64 {
        ((self.next() >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    /// Normal distribution with mean 0 and standard deviation 1 (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// Mean and standard deviation of a sample.
pub fn mean_and_std(sample: &[f64]) -> (f64, f64) {
    let n = sample.len() as f64;
    let mean = sample.iter().sum::<f64>() / n;
    let variance = sample.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, variance.sqrt())
}

/// State (angle, speed) of J θ'' + f θ' + K θ = T(t) after one Runge-Kutta step of fourth order.
pub fn step(
    [j, f, k]: [f64; 3],
    torque: impl Fn(f64) -> f64,
    t: f64,
    dt: f64,
    [angle, speed]: [f64; 2],
) -> [f64; 2] {
    let slope = |t: f64, [a, s]: [f64; 2]| [s, (torque(t) - f * s - k * a) / j];
    let ahead = |d: [f64; 2], h: f64| [angle + h * d[0], speed + h * d[1]];
    let k1 = slope(t, [angle, speed]);
    let k2 = slope(t + dt / 2.0, ahead(k1, dt / 2.0));
    let k3 = slope(t + dt / 2.0, ahead(k2, dt / 2.0));
    let k4 = slope(t + dt, ahead(k3, dt));
    std::array::from_fn(|i| {
        [angle, speed][i] + dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
    })
}
