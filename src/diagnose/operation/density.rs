//! Densities of a record around a resonance, and their fit to a periodogram.

use std::f64::consts::LN_2;
use std::ops::Range;

use nalgebra::{SMatrix, SVector};
use torqcomp_dsp::quality::median;
use torqcomp_dsp::sort_by_number;

use super::periodogram::{MeanLine, MeanLines};

/// Starts of the search: number of peaks, and factors of the damping ratio.
const STARTS: usize = 6;
const DAMPING: [f64; 3] = [0.4, 1.0, 2.5];
/// Distance in half-bandwidths of the power that a peak is compared with.
const FLANK: f64 = 4.0;
/// Fewest points of a fit.
const FEWEST: usize = 40;
/// Blocks of the range in which a law is checked, parameters that a fit moves, and the deviation in standard deviations
/// above which it is no chance.
const BLOCKS: usize = 30;
const MOVED: f64 = 5.0;
const SIGNIFICANT: f64 = 3.0;
/// Largest damping ratio of something called a resonance.
pub const MOST_DAMPED: f64 = 0.4;
/// Steps of a fit, and the change in log-likelihood at which it ends.
const STEPS: usize = 60;
const SETTLED: f64 = 1e-4;
/// Least relative enlargement of the diagonal of the information in a step.
const LEAST_CAUTION: f64 = 1e-8;

/// Parameters of a density, or derivatives of its logarithm with respect to them.
pub type DensityParameters = SVector<f64, 5>;
pub type DensityLaw = fn(&DensityParameters, f64) -> (f64, DensityParameters);

/// A density with a resonance, and the range that it was fitted in.
#[derive(Debug, Clone)]
pub struct DensityInRange {
    pub values: DensityParameters,
    pub range_hz: Range<f64>,
}

/// A fitted density.
#[derive(Clone)]
pub struct DensityFit {
    pub values: DensityParameters,
    /// `∑ ln S + P/S`.
    pub objective: f64,
    pub information: SMatrix<f64, 5, 5>,
}

impl DensityFit {
    pub fn is_resonance(&self) -> bool {
        self.values[1].exp() < MOST_DAMPED
    }

    pub fn half_hz(&self) -> f64 {
        (self.values[0] + self.values[1]).exp()
    }
}

/// Deviation of a record from a density.
pub struct Deviation {
    /// Relative rms beyond chance.
    pub rms: f64,
    /// Its variance over that by chance, at least 1.
    pub variance: f64,
    /// Whether that may be chance.
    pub is_by_chance: bool,
}

/// Logarithm of the density with a resonance, of `ln f₀`, `ln ζ`, `b`, `p` and `c`.
pub fn resonant(values: &DensityParameters, frequency_hz: f64) -> (f64, DensityParameters) {
    let damping = values[1].exp();
    let x = frequency_hz.ln() - values[0];
    let square = (2.0 * x).exp();
    let beside = 1.0 - square;
    let resisting = 4.0 * damping * damping * square;
    let divisor = beside * beside + resisting;
    let torque = (values[2] + values[3] * x).exp() / divisor;
    let noise = values[4].exp();
    let sum = torque + noise;
    let of_frequency = (2.0 * resisting - 4.0 * square * beside) / divisor - values[3];
    let of_damping = -2.0 * resisting / divisor;
    let mut slopes =
        DensityParameters::from([of_frequency, of_damping, 1.0, x, 0.0]) * (torque / sum);
    slopes[4] = noise / sum;
    (sum.ln(), slopes)
}

/// Logarithm of a density without a resonance: a parabola over `ln f`, about the fixed `values[0]`.
pub fn smooth(values: &DensityParameters, frequency_hz: f64) -> (f64, DensityParameters) {
    let x = frequency_hz.ln() - values[0];
    let value = values[2] + values[3] * x + values[4] * x * x;
    (value, DensityParameters::from([0.0, 0.0, 1.0, x, x * x]))
}

impl MeanLines {
    pub fn mean_power(&self) -> f64 {
        let weighted = self.0.iter().map(|point| point.weight * point.power);
        let weight = self.0.iter().map(|point| point.weight).sum::<f64>();
        weighted.sum::<f64>() / weight
    }

    /// Frequencies of the peaks that stand out most from what is beside them, for a half-bandwidth.
    fn peaks_hz(&self, half_hz: f64) -> Vec<f64> {
        let points = &self.0;
        let mut sums = vec![(0.0, 0.0)];
        for point in points {
            let (power, weight) = sums[sums.len() - 1];
            sums.push((power + point.weight * point.power, weight + point.weight));
        }
        let place = |f: f64| points.partition_point(|point| point.frequency_hz < f);
        let mean = |f: f64| {
            let (from, to) = (place(f - 0.5 * half_hz), place(f + 0.5 * half_hz));
            let weight = sums[to].1 - sums[from].1;
            (weight > 0.0).then(|| (sums[to].0 - sums[from].0) / weight)
        };
        let contrast = |f: f64| {
            let flanks = [mean(f - FLANK * half_hz), mean(f + FLANK * half_hz)];
            let flanks: Vec<f64> = flanks.into_iter().flatten().collect();
            let beside = flanks.iter().sum::<f64>() / flanks.len().max(1) as f64;
            mean(f).map_or(0.0, |mean| mean / beside.max(f64::MIN_POSITIVE))
        };
        let mut places: Vec<f64> = points.iter().map(|point| point.frequency_hz).collect();
        sort_by_number(&mut places, |f| -contrast(*f));
        let mut found: Vec<f64> = Vec::new();
        for f in places {
            let is_apart = found.iter().all(|other| (f - other).abs() > half_hz);
            if found.len() < STARTS && is_apart {
                found.push(f);
            }
        }
        found
    }

    /// The best resonance from some starts; `None` if it is at an end of the range.
    pub fn search(&self, half_hz: f64) -> Option<DensityFit> {
        let ends = self.0.first().zip(self.0.last())?;
        let range = ends.0.frequency_hz..ends.1.frequency_hz;
        let mut powers: Vec<f64> = self.0.iter().map(|point| point.power).collect();
        let noise = median(&mut powers)?.ln();
        let peaks_hz = self.peaks_hz(half_hz);
        let starts = peaks_hz.iter().flat_map(|natural_hz| {
            DAMPING.map(|factor| {
                let damping = (factor * half_hz / natural_hz).min(0.5 * MOST_DAMPED).ln();
                let torque = noise + 2.0 * (LN_2 + damping);
                DensityParameters::from([natural_hz.ln(), damping, torque, 0.0, noise])
            })
        });
        let fits = starts.filter_map(|start| self.fit(resonant, start));
        let fits = fits.filter(|fit| fit.is_resonance() && range.contains(&fit.values[0].exp()));
        fits.min_by(|a, b| a.objective.total_cmp(&b.objective))
    }

    /// How the ratio of power to density differs from 1 over blocks of the range.
    pub fn deviation(&self, values: &DensityParameters, correlated: f64) -> Deviation {
        let blocks = self.0.chunks(self.0.len().div_ceil(BLOCKS));
        let count = blocks.len() as f64;
        let (mut excess, mut ratio, mut lines) = (0.0, 0.0, 0.0);
        for block in blocks {
            let (mut sum, mut weight) = (0.0, 0.0);
            for point in block {
                sum += point.weight * point.power / resonant(values, point.frequency_hz).0.exp();
                weight += point.weight;
            }
            let by_chance = correlated / weight;
            let square = (sum / weight - 1.0).powi(2);
            excess += (square - by_chance) / count;
            ratio += square / by_chance / (count - MOVED).max(1.0);
            lines += weight / count;
        }
        // A mean of exponentially distributed lines has the kurtosis 3 + 6/n.
        let scatter = ((2.0 + 6.0 * correlated / lines) / count).sqrt();
        Deviation {
            rms: excess.max(0.0).sqrt(),
            variance: ratio.max(1.0),
            is_by_chance: ratio < 1.0 + SIGNIFICANT * scatter,
        }
    }

    /// The parameters of a law by Fisher scoring: steps `F⁻¹ ∑ (P/S − 1) d`, `F = ∑ d dᵀ`, with `d` the derivatives of
    /// `ln S`. `None` if there are too few points.
    pub fn fit(&self, law: DensityLaw, start: DensityParameters) -> Option<DensityFit> {
        if self.0.len() < FEWEST {
            return None;
        }
        let objective = |values: &DensityParameters| {
            let term = |point: &MeanLine| {
                let logarithm = law(values, point.frequency_hz).0;
                point.weight * (logarithm + point.power * (-logarithm).exp())
            };
            self.0.iter().map(term).sum::<f64>()
        };
        let mut values = start;
        let mut present = objective(&values);
        let mut caution = 1e-3;
        for _ in 0..STEPS {
            let (gradient, information) = self.scores(law, &values);
            let before = present;
            while caution < 1e9 {
                let mut damped = information;
                damped.set_diagonal(&(information.diagonal() * (1.0 + caution)));
                let step = damped.cholesky().map(|factors| factors.solve(&gradient));
                let next = step.map(|step| values + step);
                let next = next.map(|next| (next, objective(&next)));
                if let Some(better) = next.filter(|(_, there)| *there <= present) {
                    (values, present) = better;
                    caution = (0.1 * caution).max(LEAST_CAUTION);
                    break;
                }
                caution *= 10.0;
            }
            if before - present < SETTLED {
                break;
            }
        }
        let (_, information) = self.scores(law, &values);
        present.is_finite().then_some(DensityFit {
            values,
            objective: present,
            information,
        })
    }

    /// Sum of the scores of the parameters of a law, and their information.
    fn scores(
        &self,
        law: DensityLaw,
        values: &DensityParameters,
    ) -> (DensityParameters, SMatrix<f64, 5, 5>) {
        let mut gradient = DensityParameters::zeros();
        // A parameter without influence stays.
        let mut information = SMatrix::identity() * f64::EPSILON;
        for point in &self.0 {
            let (logarithm, slopes) = law(values, point.frequency_hz);
            gradient += slopes * (point.weight * (point.power * (-logarithm).exp() - 1.0));
            information += slopes * slopes.transpose() * point.weight;
        }
        (gradient, information)
    }
}
