//! Test for a residual that grows with the motion, as noise of any colour does not.

use super::fit::RecordResidual;
use super::residual_tests::without_mean;
use super::score::ScoredModel;
use torqcomp_dsp::{dot, sort_by_number};

/// Minimum ratio of the powers of the motion, and of the residual.
const LEVELS: f64 = 1.5;
const RESIDUALS: f64 = 1.5;
/// Minimum significance of the latter ratio, in standard deviations.
const SIGNIFICANT: f64 = 3.0;

/// Power of some records together.
struct RecordPower {
    motion: f64,
    residual: f64,
    /// Relative standard deviation of the power of noise with the spectrum of the residual: each line of a
    /// spectrum has an exponentially distributed power, so that it is `√(∑p²/2)/∑p` over the lines' powers `p`.
    scatter: f64,
}

impl ScoredModel {
    /// Whether the residual of the records with the larger motion exceeds that of the others, training and held-out ones
    /// alike, by more than noise of its spectrum does.
    pub fn grows_with_level(&self) -> bool {
        let mut records = [&*self.train(), &*self.compared()].concat();
        let motion = |r: &RecordResidual| {
            let x = without_mean(&r.modelled);
            dot(&x, &x) / x.len() as f64
        };
        sort_by_number(&mut records, motion);
        let (Some(least), Some(most)) = (records.first().map(motion), records.last().map(motion))
        else {
            return false;
        };
        let middle = (least * most).sqrt();
        let quiet = records.partition_point(|r| motion(r) < middle);
        let (quiet, loud) = records.split_at(quiet);
        let Some((quiet, loud)) = RecordPower::of(quiet).zip(RecordPower::of(loud)) else {
            return false;
        };
        let growth = (loud.residual / quiet.residual).ln();
        let std = loud.scatter.hypot(quiet.scatter);
        loud.motion > LEVELS * quiet.motion && growth > RESIDUALS.ln().max(SIGNIFICANT * std)
    }
}

impl RecordPower {
    /// `None` without motion, or without a residual.
    fn of(records: &[RecordResidual]) -> Option<Self> {
        let count = records.iter().map(|r| r.samples.len()).sum::<usize>() as f64;
        let mean_square = |x: &[f64]| dot(x, x) / count;
        let motion = records
            .iter()
            .map(|r| mean_square(&without_mean(&r.modelled)))
            .sum();
        let residual = records.iter().map(|r| mean_square(&r.samples)).sum();
        let (mut power, mut square) = (0.0, 0.0);
        for record in records {
            let mut samples = record.samples.clone();
            let plan = torqcomp_fourier::forward(samples.len());
            let mut spectrum = plan.make_output_vec();
            plan.process(&mut samples, &mut spectrum).ok()?;
            for line in &spectrum {
                power += line.norm_sqr();
                square += line.norm_sqr().powi(2);
            }
        }
        let scatter = (0.5 * square).sqrt() / power;
        let is_measured = motion > 0.0 && residual > 0.0 && scatter.is_finite();
        is_measured.then_some(Self {
            motion,
            residual,
            scatter,
        })
    }
}
