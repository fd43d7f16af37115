//! One damped step within bounds.

use nalgebra::{DMatrix, DVector};

use super::reduce::{Reduced, back_substitute, reduce};

/// Room of a parameter to both sides, as a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Room {
    pub down: f64,
    pub up: f64,
}

/// The step d that makes |R d + c|² + λ|D d|² least, each part of it within its room.
///
/// Parts that would leave it are set to its edge and the others solved for again, until all fit:
/// an active-set rule on the small reduced problem. `None` if the problem is singular at this λ.
pub(super) fn step(
    reduced: &Reduced,
    scaling: &[f64],
    lambda: f64,
    room: &[Room],
) -> Option<DVector<f64>> {
    let n = scaling.len();
    let gradient = reduced.r.tr_mul(&reduced.c);
    let mut found = DVector::zeros(n);
    // At an edge and pushed outwards: stays there.
    let mut open: Vec<usize> = (0..n)
        .filter(|i| {
            let downhill = -gradient[*i];
            !(downhill < 0.0 && room[*i].down <= 0.0 || downhill > 0.0 && room[*i].up <= 0.0)
        })
        .collect();
    while !open.is_empty() {
        let part = solve(reduced, scaling, lambda, &open, &found)?;
        let outside = |k: &usize| {
            let room = room[open[*k]];
            part[*k] > room.up || part[*k] < -room.down
        };
        let over: Vec<usize> = (0..open.len()).filter(outside).collect();
        if over.is_empty() {
            open.iter()
                .zip(part.iter())
                .for_each(|(i, d)| found[*i] = *d);
            break;
        }
        for k in over.into_iter().rev() {
            let i = open.remove(k);
            found[i] = part[k].clamp(-room[i].down, room[i].up);
        }
    }
    Some(found)
}

/// The damped step of the open parts, the others having the steps in `taken`.
fn solve(
    reduced: &Reduced,
    scaling: &[f64],
    lambda: f64,
    open: &[usize],
    taken: &DVector<f64>,
) -> Option<DVector<f64>> {
    let n = scaling.len();
    let k = open.len();
    let mut fixed = taken.clone();
    open.iter().for_each(|i| fixed[*i] = 0.0);
    let right = -(&reduced.c + &reduced.r * fixed);
    let mut stacked = DMatrix::zeros(n + k, k);
    for (j, i) in open.iter().enumerate() {
        stacked
            .view_mut((0, j), (n, 1))
            .copy_from(&reduced.r.column(*i));
        stacked[(n + j, j)] = lambda.sqrt() * scaling[*i];
    }
    let mut b = right.as_slice().to_vec();
    b.resize(n + k, 0.0);
    let small = reduce(&stacked, &b);
    back_substitute(&small.r, &small.c)
}
