//! Motion for tests, integrated by the Runge–Kutta method.

/// State after a step of `h`, such as displacement and speed; `slope` gives its derivatives at a time.
pub fn step<const N: usize>(
    state: [f64; N],
    t: f64,
    h: f64,
    slope: impl Fn(f64, [f64; N]) -> [f64; N],
) -> [f64; N] {
    let at = |d: [f64; N], by: f64| std::array::from_fn(|j| state[j] + by * d[j]);
    let a = slope(t, state);
    let b = slope(t + 0.5 * h, at(a, 0.5 * h));
    let c = slope(t + 0.5 * h, at(b, 0.5 * h));
    let d = slope(t + h, at(c, h));
    std::array::from_fn(|j| state[j] + h / 6.0 * (a[j] + 2.0 * b[j] + 2.0 * c[j] + d[j]))
}
