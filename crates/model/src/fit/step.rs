//! One damped step within bounds.

use nalgebra::{DMatrix, DVector};

use super::reduce::{Reduced, back_substitute, reduce};

/// Distances of a parameter from its bounds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Room {
    pub down: f64,
    pub up: f64,
}

/// The step d that minimises |R d + c|² + λ|D d|² within the bounds.
///
/// Components beyond a bound are set to it and the others solved again until all are within (active set on the reduced
/// problem). `None` if the problem is singular at this λ.
pub(super) fn step(
    reduced: &Reduced,
    scaling: &[f64],
    lambda: f64,
    room: &[Room],
) -> Option<DVector<f64>> {
    let n = scaling.len();
    let gradient = reduced.r.tr_mul(&reduced.c);
    let mut found = DVector::zeros(n);
    // A component at a bound that is pushed outwards stays there.
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

/// The damped step of the free components; the others have the steps in `taken`.
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
