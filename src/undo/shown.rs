//! The displacement behind a gage that shows a torque of the stand beside it: `y = x + n(x)`, solved for `x` in time
//! order, as the torque may have memory.

use std::ops::Range;

use torqcomp_model::effects::Memory;

use super::motion::{Link, View};

/// Halvings of a bracket.
const HALVINGS: usize = 60;
/// Doublings of a bracket's width.
const WIDENINGS: usize = 40;
/// Noise, in standard deviations, within which a signal counts as nothing.
const NOTHING: f64 = 3.0;

/// The torques that a gage shows, and where they are.
pub struct Shown<'a> {
    links: Vec<&'a Link<'a>>,
    memories: Vec<Memory>,
    shift: f64,
    /// Half the range in which nothing is shown.
    hidden: f64,
    /// Signal that counts as nothing.
    nothing: f64,
    /// Displacements of the end of the block before.
    kept: Option<Vec<f64>>,
}

impl<'a> Shown<'a> {
    pub fn new(links: &'a [Link<'a>], view: &View) -> Self {
        let links: Vec<&Link> = links.iter().filter(|link| link.shown).collect();
        let hidden = links.iter().map(|link| link.torque.hidden()).sum();
        Self {
            links,
            memories: Vec::new(),
            shift: view.shift,
            hidden,
            nothing: NOTHING * view.noise_std,
            kept: None,
        }
    }

    pub fn is_there(&self) -> bool {
        !self.links.is_empty()
    }

    /// Displacement over a window of the signal, and the places within `inner` where the signal does not tell it.
    pub fn displacement(&mut self, signal: &[f64], inner: Range<usize>) -> (Vec<f64>, Vec<usize>) {
        let mut x = signal.to_vec();
        let mut untold = vec![false; signal.len()];
        let mut last = signal[inner.start];
        if self.memories.is_empty() {
            let begin = |link: &&Link| link.torque.begin(last + self.shift);
            self.memories = self.links.iter().map(begin).collect();
        }
        let mut memories = std::mem::take(&mut self.memories);
        let mut after = Vec::new();
        for i in inner.start..signal.len() {
            if i == inner.end {
                after = memories.clone();
            }
            let found = self.solve(&memories, signal[i], last);
            untold[i] = found.is_none();
            last = found.unwrap_or(last);
            x[i] = last;
            let _ = self.sum(&mut memories, last);
        }
        self.memories = if after.is_empty() { memories } else { after };
        self.before(&mut x, signal, inner.start);
        if self.hidden > 0.0 {
            self.bridge(&mut x, &mut untold, signal);
        }
        self.kept = Some(x[inner.end - inner.start..inner.end].to_vec());
        (x, inner.filter(|i| untold[*i]).collect())
    }

    /// What comes before the part that is solved: from the block before, or as far off as the first.
    fn before(&self, x: &mut [f64], signal: &[f64], start: usize) {
        match &self.kept {
            Some(kept) => x[..start].copy_from_slice(kept),
            None => {
                let off = x[start] - signal[start];
                x[..start].iter_mut().for_each(|x| *x += off);
            }
        }
    }

    /// Torques at a displacement; memory moves on.
    fn sum(&self, memories: &mut [Memory], x: f64) -> f64 {
        let pairs = self.links.iter().zip(memories);
        pairs
            .map(|(link, memory)| link.torque.value(memory, x + self.shift, 0.0))
            .sum()
    }

    /// The root of `x + n(x) = y` nearest to the displacement before, if there is one.
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
        // The root lies against the sign of what is over.
        let mut width = here.abs();
        let (mut a, mut fa) = (near, here);
        for _ in 0..WIDENINGS {
            let b = near - width.copysign(here);
            let fb = over(b);
            if fb == 0.0 || (fb > 0.0) != (here > 0.0) {
                return Some(root(over, (a, fa), (b, fb)));
            }
            if fb.abs() > fa.abs() {
                // The curve turns back: beyond, no displacement belongs to this signal.
                return None;
            }
            (a, fa) = (b, fb);
            width *= 2.0;
        }
        None
    }

    /// Where nothing is shown, leads from side to side by a cubic with the slopes at both ends.
    fn bridge(&self, x: &mut [f64], untold: &mut [bool], signal: &[f64]) {
        let inside = |y: &f64| (y + self.shift).abs() <= self.nothing;
        let mut i = 0;
        while i < x.len() {
            if !inside(&signal[i]) {
                i += 1;
                continue;
            }
            let first = i;
            let end = (first..x.len())
                .find(|k| !inside(&signal[*k]))
                .unwrap_or(x.len());
            untold[first..end].fill(true);
            if first >= 2 && end + 1 < x.len() {
                cubic(x, first - 1, end);
            }
            i = end;
        }
    }
}

/// A root between two points of different sign, by the Illinois method.
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

/// The cubic between two places with the slopes at both of them.
fn cubic(x: &mut [f64], from: usize, to: usize) {
    let length = (to - from) as f64;
    let (a, b) = (x[from], x[to]);
    let (slope_a, slope_b) = (
        (a - x[from - 1]) * length,
        (x[(to + 1).min(x.len() - 1)] - b) * length,
    );
    for (i, x) in x[from + 1..to].iter_mut().enumerate() {
        let t = (i + 1) as f64 / length;
        let (u, t2) = (1.0 - t, t * t);
        *x = u * u * ((1.0 + 2.0 * t) * a + t * slope_a) + t2 * ((3.0 - 2.0 * t) * b - u * slope_b);
    }
}
