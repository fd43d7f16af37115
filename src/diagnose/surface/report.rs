//! Report of a surface: its curves with their uncertainties, and the laws that they resemble.

use schemars::JsonSchema;
use serde::Serialize;
use torqcomp_dsp::rms;

use super::basis::{KNOTS, Knots, SurfacePart};
use super::line::clear_line;
use super::shape::{Resemblance, of_displacement, of_speed};
use super::{PLAIN, Surface, SurfacePlace, seen};
use crate::diagnose::describe::shows_torque;
use crate::diagnose::score::ScoredModel;

/// Minimum share of a part of the surface that is mentioned.
const SPOKEN_OF: f64 = 0.1;

/// The torque that follows from the motion, that of accepted laws included, as a surface over displacement and speed, with a
/// memory.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ForceSurface {
    /// Where the torque acts.
    pub place: SurfacePlace,
    /// Whether no law is named because this explains far more than the best of them.
    pub outdoes_laws: bool,
    /// Residual rms of training samples not used in its fit, given the motion measured there; in the unit of `error`.
    pub train_rms: f64,
    /// Residual rms of the hold-out records, given the motion measured there.
    pub holdout_rms: f64,
    /// What each part of it explains.
    pub shares: SurfaceShares,
    /// Torque over displacement, both in the unit of `error`, without its straight line.
    pub over_displacement: Vec<SurfacePoint>,
    /// Torque over the rate of change of displacement per s, without its straight line.
    pub over_speed: Vec<SurfacePoint>,
    /// What its parts look like.
    pub looks_like: Vec<String>,
    /// Closest effects and laws: hypotheses, not findings.
    pub nearest: Vec<&'static str>,
}

/// By how much the squared error grows without each part of the surface, over the sum of all four.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct SurfaceShares {
    /// Displacement.
    pub displacement: f64,
    /// Speed.
    pub speed: f64,
    /// Products of displacement and speed.
    pub both: f64,
    /// Elements that slip, and a slow one.
    pub history: f64,
}

/// A point of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct SurfacePoint {
    /// Displacement, or its rate of change.
    pub at: f64,
    /// Torque there.
    pub torque: f64,
    /// Standard uncertainty of the torque.
    pub std: f64,
}

impl ForceSurface {
    /// The record that would decide between the closest laws.
    pub fn experiment(&self) -> &'static str {
        let shares = &self.shares;
        let of_displacement = shares.displacement.max(shares.history);
        shows_torque(of_displacement >= shares.speed.max(shares.both))
    }
}

impl Surface {
    /// The surface on the records used for comparison; `None` if these do not confirm it.
    pub fn report(&self, model: &ScoredModel, outdoes_laws: bool) -> Option<ForceSurface> {
        let left = rms(&self.left_of_compared(model)?);
        if left >= rms(&seen(&model.compared())) {
            return None;
        }
        let unit = model.fitted.structure.context.units.per_printed;
        let omega = model.fitted.mode().omega_rad_s;
        let curve = |first: usize, knots: &Knots, scale: f64| -> Vec<SurfacePoint> {
            let torques = self.solution.with_std(|coefficients| {
                let own = coefficients.rows(first, knots.at.len());
                let mut torques: Vec<f64> = own.iter().map(|c| c * self.grid.size()).collect();
                clear_line(&mut torques, &knots.at, |k| knots.share[k]);
                torques
            });
            let point = |(at, [torque, std]): (&f64, [f64; 2])| SurfacePoint {
                at: at * scale / unit,
                torque: torque / unit,
                std: std / unit,
            };
            knots.at.iter().zip(torques).map(point).collect()
        };
        let over_displacement = curve(PLAIN, &self.grid.x, 1.0);
        let over_speed = curve(PLAIN + KNOTS[0], &self.grid.speed, omega);
        let [displacement, speed, both, history] = self.shares;
        let mut resemblances = Vec::new();
        for (part, share) in SurfacePart::ALL.into_iter().zip(self.shares) {
            let most = self.shares.iter().copied().fold(0.0, f64::max);
            if share > 0.0 && share >= SPOKEN_OF.min(most) {
                resemblances.push(match part {
                    SurfacePart::Displacement => of_displacement(&over_displacement, self.place),
                    SurfacePart::Speed => of_speed(&over_speed),
                    SurfacePart::Both => Resemblance::damping_over_displacement(),
                    SurfacePart::History => Resemblance::loop_of_history(),
                });
            }
        }
        let mut nearest: Vec<&'static str> = Vec::new();
        for name in resemblances.iter().flat_map(|r| r.nearest) {
            if !nearest.contains(name) {
                nearest.push(name);
            }
        }
        Some(ForceSurface {
            place: self.place,
            outdoes_laws,
            train_rms: self.unseen_rms() / unit,
            holdout_rms: left / unit,
            shares: SurfaceShares {
                displacement,
                speed,
                both,
                history,
            },
            over_displacement,
            over_speed,
            looks_like: resemblances.into_iter().map(|r| r.words).collect(),
            nearest,
        })
    }
}
