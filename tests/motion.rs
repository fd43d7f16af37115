//! Motion for tests, integrated by the Runge–Kutta method.

/// Displacement and speed after a step of `h`; `slope` gives the derivatives of both at a time.
pub fn step(
    state: [f64; 2],
    t: f64,
    h: f64,
    slope: impl Fn(f64, [f64; 2]) -> [f64; 2],
) -> [f64; 2] {
    let at = |d: [f64; 2], by: f64| [state[0] + by * d[0], state[1] + by * d[1]];
    let a = slope(t, state);
    let b = slope(t + 0.5 * h, at(a, 0.5 * h));
    let c = slope(t + 0.5 * h, at(b, 0.5 * h));
    let d = slope(t + h, at(c, h));
    std::array::from_fn(|j| state[j] + h / 6.0 * (a[j] + 2.0 * b[j] + 2.0 * c[j] + d[j]))
}
