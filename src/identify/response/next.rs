//! Start values for one more mode.

use super::{Data, Modal};
use crate::identify::Pole;

impl Data {
    /// Start values for one more mode: the strongest line of the residual that is not within a relative distance
    /// `apart` of a mode.
    pub fn next_pole(&self, so_far: &Modal, apart: f64) -> Option<Pole> {
        let left: Vec<f64> = (0..self.omega.len())
            .map(|i| self.weight[i] * (self.response[i] - so_far.response[i]).norm())
            .collect();
        let near = |omega: f64| {
            so_far
                .poles
                .iter()
                .any(|p| (omega / p.omega_rad_per_s - 1.0).abs() < apart)
        };
        let open = (0..left.len()).filter(|i| !near(self.omega[*i]));
        let best = open.max_by(|a, b| left[*a].total_cmp(&left[*b]))?;
        let below = |i: &usize| left[*i] < std::f64::consts::FRAC_1_SQRT_2 * left[best];
        let from = (0..best).rev().find(below).unwrap_or(0);
        let to = (best + 1..left.len()).find(below).unwrap_or(left.len() - 1);
        let wide = 0.5 * (self.omega[to] - self.omega[from]);
        let rest = Data {
            response: self
                .response
                .iter()
                .zip(&so_far.response)
                .map(|(a, b)| a - b)
                .collect(),
            ..self.clone()
        };
        let mut found: Option<(f64, Pole)> = None;
        for (rate, shift) in [0.1, 0.3, 0.6, 1.0, 2.0]
            .iter()
            .flat_map(|r| [-0.5, 0.0, 0.5].map(|s| (*r, s)))
        {
            let pole = Pole {
                rate_per_s: (rate * wide - self.added_rate).max(1e-3 * wide),
                omega_rad_per_s: self.omega[best] + shift * wide,
            };
            let Ok(solved) = rest.solve(&[pole], so_far.delay_s) else {
                continue;
            };
            if found.is_none_or(|(least, _)| solved.sum_of_squares < least) {
                found = Some((solved.sum_of_squares, pole));
            }
        }
        found.map(|(_, pole)| pole)
    }
}
