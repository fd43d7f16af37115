//! Significance of the difference between two models with autocorrelated residuals.

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::spectra::energy_spectrum;

/// Number of blocks of the residuals.
const BLOCKS: usize = 64;
/// Number of bootstrap draws.
const DRAWS: usize = 2000;

/// Block sums of two models' residuals on the same samples.
pub struct Comparison {
    /// Squares of the first model's residual.
    before: Vec<f64>,
    /// Squares of the second model's.
    after: Vec<f64>,
    /// Products of the second residual with the difference of the two.
    product: Vec<f64>,
    /// Variance of the sum of these products in noise with the spectrum of the second residual.
    coloured: f64,
}

/// Compares the residuals of two models on the same samples.
pub fn compare(before: &[f64], after: &[f64]) -> Comparison {
    let length = before.len().div_ceil(BLOCKS).max(1);
    let sums = |f: fn(f64, f64) -> f64| -> Vec<f64> {
        let blocks = before.chunks(length).zip(after.chunks(length));
        let sum = |(b, a): (&[f64], &[f64])| b.iter().zip(a).map(|(b, a)| f(*b, *a)).sum();
        blocks.map(sum).collect()
    };
    Comparison {
        before: sums(|b, _| b * b),
        after: sums(|_, a| a * a),
        product: sums(|b, a| a * (b - a)),
        coloured: coloured(before, after),
    }
}

/// Number of frequencies on each side over which the spectrum of a residual is averaged, as a fit removes its own part
/// from a few of them.
const AROUND: usize = 3;

/// Variance of `Σ d r` for the change `d` of a residual, in stationary noise `r` with the spectrum of the second
/// residual: `Σ_f |D(f)|² S(f)`.
fn coloured(before: &[f64], after: &[f64]) -> f64 {
    let change: Vec<f64> = before.iter().zip(after).map(|(b, a)| b - a).collect();
    let change = energy_spectrum(&change, 0);
    let noise = energy_spectrum(after, AROUND);
    // For white noise of variance σ², the energies of all frequencies sum to n σ², and the result is
    // σ² Σ d².
    let sum: f64 = change.iter().zip(&noise).map(|(d, s)| d * s).sum();
    sum * (change.len() as f64) / after.len().max(1) as f64
}

impl Comparison {
    /// Reduction of the sum of squares.
    pub fn gain(&self) -> f64 {
        self.before.iter().sum::<f64>() - self.after.iter().sum::<f64>()
    }

    /// Expected reduction of the sum of squares, without the contribution of noise, and its standard deviation due to
    /// noise.
    pub fn expected_gain(&self) -> [f64; 2] {
        let noise = 2.0 * self.product.iter().sum::<f64>();
        [self.gain() - noise, self.std()]
    }

    /// Sums of squares of both residuals.
    pub fn sums(&self) -> [f64; 2] {
        [&self.before, &self.after].map(|squares| squares.iter().sum())
    }

    fn std(&self) -> f64 {
        let scatter: f64 = self.product.iter().map(|p| p * p).sum();
        2.0 * scatter.max(self.coloured).sqrt()
    }

    /// The gain in standard deviations due to noise.
    ///
    /// With `d` the difference of the residuals and `r` the second one, the gain is `Σ d² + 2 Σ d r`. If `r` is noise,
    /// only the second sum varies. Its variance is the larger of two estimates: from the scatter of blocks, valid if
    /// the residual has most of its power in a few places, as in a sweep, and from the spectra of both, valid if the
    /// noise is correlated over more than a block.
    pub fn significance(&self) -> f64 {
        let std = self.std();
        if std > 0.0 { self.gain() / std } else { 0.0 }
    }

    /// Products of the blocks, normalised by the root of the sum of their squares.
    fn scaled_products(&self) -> Vec<f64> {
        let size = self.product.iter().map(|p| p * p).sum::<f64>().sqrt();
        let over = |product: &f64| if size > 0.0 { product / size } else { 0.0 };
        self.product.iter().map(over).collect()
    }

    /// Probability of an equal or larger gain by chance, if the second model were no better.
    pub fn p_value(&self) -> Option<f64> {
        let law = StudentsT::new(0.0, 1.0, self.before.len() as f64 - 1.0).ok()?;
        Some(law.sf(self.significance()))
    }

    /// 95 % confidence interval of the relative reduction of the RMS, by bootstrap over the blocks.
    pub fn improvement_ci95(&self) -> [f64; 2] {
        let mut random = SplitMix64(0x9E37_79B9_7F4A_7C15);
        let count = self.before.len();
        let mut draw = || {
            let (mut before, mut after) = (0.0, 0.0);
            for _ in 0..count {
                let k = random.below(count);
                before += self.before[k];
                after += self.after[k];
            }
            match before > 0.0 {
                true => 1.0 - (after / before).sqrt(),
                false => 0.0,
            }
        };
        let mut reductions: Vec<f64> = (0..DRAWS).map(|_| draw()).collect();
        reductions.sort_by(f64::total_cmp);
        [reductions[DRAWS / 40], reductions[DRAWS - 1 - DRAWS / 40]]
    }
}

/// For each of several gains over the same model, the probability that the largest of all is as large by chance.
///
/// If no model is better, the product of each block has a random sign; the same signs are drawn for all models, so that
/// similar models count as one (P. H. Westfall, S. S. Young, Resampling-based multiple testing, Wiley (1993)). If no
/// draw reaches a gain, its own probability times the number of models is the bound (Bonferroni).
pub fn family_p_values(comparisons: &[Comparison]) -> Vec<Option<f64>> {
    let scaled: Vec<Vec<f64>> = comparisons
        .iter()
        .map(Comparison::scaled_products)
        .collect();
    let blocks = scaled.iter().map(Vec::len).max().unwrap_or(0);
    let mut random = SplitMix64(0x9E37_79B9_7F4A_7C15);
    let mut largest = || {
        let signs: Vec<f64> = (0..blocks).map(|_| [1.0, -1.0][random.below(2)]).collect();
        let sum = |products: &Vec<f64>| -> f64 {
            let pairs = products.iter().zip(&signs);
            pairs.map(|(product, sign)| product * sign).sum()
        };
        scaled.iter().map(sum).fold(f64::NEG_INFINITY, f64::max)
    };
    let maxima: Vec<f64> = (0..DRAWS).map(|_| largest()).collect();
    let of = |comparison: &Comparison| {
        let own = comparison.p_value()? * comparisons.len() as f64;
        let significance = comparison.significance();
        let above = maxima.iter().filter(|m| **m >= significance).count();
        let among_all = (1 + above) as f64 / (1 + DRAWS) as f64;
        Some(own.min(among_all))
    };
    comparisons.iter().map(of).collect()
}

/// Reproducible pseudo-random numbers (SplitMix64; G. Steele et al., OOPSLA 2014).
pub struct SplitMix64(pub u64);

impl SplitMix64 {
    /// A number of unit variance, approximately normal: the sum of twelve in [0, 1), minus 6.
    pub fn normal(&mut self) -> f64 {
        let uniform = |r: &mut Self| r.below(1 << 20) as f64 / f64::from(1 << 20);
        (0..12).map(|_| uniform(self)).sum::<f64>() - 6.0
    }

    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % limit as u64) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(random: &mut SplitMix64, count: usize) -> Vec<f64> {
        (0..count).map(|_| random.normal()).collect()
    }

    /// If none of twenty models is better than the first, the best has p < 5 % in 5 % of 200 cases: 10, and hardly ever
    /// more than 20. With p-values for a single model, it would be 1 − 0.95²⁰ = 64 %.
    #[test]
    fn the_best_of_many_is_no_better_by_chance() {
        let mut random = SplitMix64(3);
        let mut alone = 0;
        let mut found = 0;
        for _ in 0..200 {
            let before = noise(&mut random, 640);
            // A small change unrelated to the residual; at its optimum size it only fits noise.
            let comparisons: Vec<Comparison> = (0..20)
                .map(|_| {
                    let change = noise(&mut random, 640);
                    let after: Vec<f64> = before
                        .iter()
                        .zip(&change)
                        .map(|(b, c)| b - 1e-3 * c)
                        .collect();
                    compare(&before, &after)
                })
                .collect();
            let least = |p: &mut dyn Iterator<Item = Option<f64>>| p.flatten().fold(1.0, f64::min);
            found += usize::from(least(&mut family_p_values(&comparisons).into_iter()) < 0.05);
            alone += usize::from(least(&mut comparisons.iter().map(Comparison::p_value)) < 0.05);
        }
        assert!(found <= 20, "{found} of 200");
        assert!(alone > 80, "{alone} of 200");
    }

    /// Noise correlated over more than a block, and the best of 200 lines: judged by the scatter of the blocks alone,
    /// 36 of 40 would be significant.
    #[test]
    fn a_line_fitted_to_ringing_noise_is_not_significant() {
        let mut random = SplitMix64(11);
        let mut seen = 0;
        for _ in 0..40 {
            let mut before = noise(&mut random, 3000);
            let (decay, turn) = (1.0 - 1.0 / 250.0, 0.2_f64);
            for i in 2..before.len() {
                before[i] +=
                    2.0 * decay * turn.cos() * before[i - 1] - decay * decay * before[i - 2];
            }
            let lines = (0..200).map(|k| line(&before, turn + 1e-4 * f64::from(k - 100)));
            let best = lines
                .max_by(|a, b| a.gain().total_cmp(&b.gain()))
                .expect("a line");
            seen += usize::from(best.significance() >= 3.0);
        }
        assert!(seen <= 4, "{seen} of 40");
    }

    /// A residual compared with itself minus its line at a frequency.
    fn line(before: &[f64], rad_per_sample: f64) -> Comparison {
        let phases = (0..before.len()).map(|i| rad_per_sample * i as f64);
        let (cosine, sine): (Vec<f64>, Vec<f64>) = phases.map(|p| (p.cos(), p.sin())).unzip();
        let size = |wave: &[f64]| {
            let product: f64 = wave.iter().zip(before).map(|(w, b)| w * b).sum();
            product / wave.iter().map(|w| w * w).sum::<f64>()
        };
        let (c, s) = (size(&cosine), size(&sine));
        let waves = cosine.iter().zip(&sine).map(|(x, y)| c * x + s * y);
        let after: Vec<f64> = before.iter().zip(waves).map(|(b, w)| b - w).collect();
        compare(before, &after)
    }
}
