//! Displacement from a gage signal that includes a torque of the stand: `y = x + n(x)`, solved for `x` in time
//! order, as the torque may have memory.

use std::ops::Range;

use crate::effects::{Memory, Torque, bridge};

/// Bisections of a bracket.
const HALVINGS: usize = 60;
/// Doublings of a bracket's width.
const WIDENINGS: usize = 40;
/// Threshold in standard deviations of the noise below which a signal counts as zero.
const NOTHING: f64 = 3.0;

/// Torques that the gage shows in addition to the displacement.
pub struct GagePath<'a> {
    torques: Vec<&'a dyn Torque>,
    shift: f64,
    /// Half-width of the displacement range in which the gage shows nothing.
    hidden: f64,
    /// Signal below which the gage counts as showing nothing.
    nothing: f64,
    state: GageState,
}

/// State carried from window to window.
#[derive(Debug, Clone, Default)]
pub struct GageState {
    memories: Vec<Memory>,
    /// Displacements at the end of the previous block.
    kept: Option<Vec<f64>>,
}

impl<'a> GagePath<'a> {
    /// Torques that see a displacement offset by `shift` from that in the signal; `noise_std` is the standard deviation
    /// of a sample.
    #[must_use]
    pub fn new(torques: Vec<&'a dyn Torque>, shift: f64, noise_std: f64) -> Self {
        Self {
            hidden: torques.iter().map(|torque| torque.hidden()).sum(),
            torques,
            shift,
            nothing: NOTHING * noise_std,
            state: GageState::default(),
        }
    }

    /// Continues from a state.
    #[must_use]
    pub fn from(mut self, state: GageState) -> Self {
        self.state = state;
        self
    }

    /// State after the last window.
    #[must_use]
    pub fn state(&self) -> GageState {
        self.state.clone()
    }

    /// Whether there is no torque, so that the signal is the displacement.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.torques.is_empty()
    }

    /// Displacement over a window of the signal, and the indices within `inner` at which the signal does not determine
    /// it. Windows must come in order of time; the torques' memory advances with them.
    pub fn displacement(&mut self, signal: &[f64], inner: Range<usize>) -> (Vec<f64>, Vec<usize>) {
        let mut x = signal.to_vec();
        let mut unknown = vec![false; signal.len()];
        let mut last = signal[inner.start];
        if self.state.memories.is_empty() {
            let begin = |torque: &&dyn Torque| torque.begin(last + self.shift);
            self.state.memories = self.torques.iter().map(begin).collect();
        }
        let mut memories = std::mem::take(&mut self.state.memories);
        let mut after = Vec::new();
        for i in inner.start..signal.len() {
            if i == inner.end {
                after = memories.clone();
            }
            let found = self.solve(&memories, signal[i], last);
            unknown[i] = found.is_none();
            last = found.unwrap_or(last);
            x[i] = last;
            let _ = self.sum(&mut memories, last);
        }
        self.state.memories = if after.is_empty() { memories } else { after };
        self.before(&mut x, signal, inner.start);
        if self.hidden > 0.0 {
            let shifted: Vec<f64> = signal.iter().map(|y| y + self.shift).collect();
            bridge(&mut x, &mut unknown, &shifted, self.nothing);
        }
        self.state.kept = Some(x[inner.end - inner.start..inner.end].to_vec());
        (x, inner.filter(|i| unknown[*i]).collect())
    }

    /// Displacement before the solved part: from the previous block; in the first, offset like the first sample.
    fn before(&self, x: &mut [f64], signal: &[f64], start: usize) {
        match &self.state.kept {
            Some(kept) => x[..start].copy_from_slice(kept),
            None => {
                let off = x[start] - signal[start];
                x[..start].iter_mut().for_each(|x| *x += off);
            }
        }
    }

    /// Sum of the torques at a displacement; advances their memory.
    fn sum(&self, memories: &mut [Memory], x: f64) -> f64 {
        let pairs = self.torques.iter().zip(memories);
        pairs
            .map(|(torque, memory)| torque.value(memory, x + self.shift, 0.0))
            .sum()
    }

    /// The root of `x + n(x) = y` nearest to the previous displacement, if there is one.
    fn solve(&self, memories: &[Memory], y: f64, near: f64) -> Option<f64> {
        if self.hidden > 0.0 {
            let shifted = y + self.shift;
            let x = shifted + self.hidden.copysign(shifted) - self.shift;
            return Some(x);
        }
        let over = |x: f64| x + self.sum(&mut memories.to_vec(), x) - y;
        let here = over(near);
        if here == 0.0 {
            return Some(near);
        }
        // The root lies in the direction opposite to the sign of the excess.
        let mut width = here.abs();
        let (mut a, mut fa) = (near, here);
        for _ in 0..WIDENINGS {
            let b = near - width.copysign(here);
            let fb = over(b);
            if fb == 0.0 || (fb > 0.0) != (here > 0.0) {
                return Some(root(over, (a, fa), (b, fb)));
            }
            if fb.abs() > fa.abs() {
                // The curve turns back: no displacement beyond gives this signal.
                return None;
            }
            (a, fa) = (b, fb);
            width *= 2.0;
        }
        None
    }
}

/// The root within a bracket, by the Illinois method.
fn root(f: impl Fn(f64) -> f64, mut a: (f64, f64), mut b: (f64, f64)) -> f64 {
    for _ in 0..HALVINGS {
        if b.1 == 0.0 || (b.0 - a.0).abs() <= 4.0 * f64::EPSILON * b.0.abs() {
            break;
        }
        let c = b.0 - b.1 * (b.0 - a.0) / (b.1 - a.1);
        let fc = f(c);
        if (fc > 0.0) == (b.1 > 0.0) {
            a.1 *= 0.5;
        } else {
            a = b;
        }
        b = (c, fc);
    }
    b.0
}
