//! Noise floor: the residual of a perfect model of the stand.

use schemars::JsonSchema;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};
use torqcomp_model::{ModalPart, ModalResponse, Mode};

use super::fit::{FittedModel, RecordResidual};
use super::intersample::noise_on_plateaus;
use super::record::{DECAYED, StandRecord};
use super::residual_tests::{autocorrelation, without_mean};
use super::spectra::{ONLY_NOISE, spectra};
use crate::identify::Motion;
use torqcomp_dsp::dot;
use torqcomp_dsp::quality::quantisation::quantisation;

/// The noise of the held-out records.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseFloor {
    pub rms: f64,
    pub from: NoiseFloorSource,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseFloorSource {
    /// Differences between periods of the record.
    Periods,
    /// Frequencies above the signal; white noise is assumed.
    OutOfBand,
    /// The resolution of the record, if the noise is smaller than its rounding error.
    Resolution,
}

/// Allowed relative difference of the input's power between periods.
const SAME: f64 = 1e-5;
/// Length in samples of the piece of the input used to find its period, if it varies enough.
const PIECE: usize = 256;
/// Minimum mean square of that piece about its mean, relative to that of the input: less is repeated at any lag, as in
/// constant intervals.
const VARIES: f64 = 0.25;
/// Shortest period, in samples.
const SHORTEST: usize = 64;
/// Number of sections of a period whose differences are compared.
const SECTIONS: usize = 4;
/// Probability that such differences of the same noise count as different.
const BY_CHANCE: f64 = 1e-5;
/// Power of the undisturbed differences, relative to all, up to which a change is no noise.
const DISTURBED: f64 = 0.5;
/// Largest fraction of the out-of-band power that the signal may have.
const SIGNAL: f64 = 0.2;

/// Ratio of two parts of a spectrum up to which it is flat.
const FLAT: f64 = 1.5;
/// Density of noise on the applied quantity relative to the mean density, up to which it is told from excitation, if the
/// whole upper half of the spectrum is flat.
const SHELF: f64 = 0.01;
/// Maximum noise power gain of a stand: near zero damping the integral corresponds to a decay that never settles.
const MOST_PASSED: f64 = 10.0;

/// Mean square of the noise, and the number of samples used.
type MeanSquare = (f64, usize);

/// Transmission of noise through a stand.
pub struct NoisePassage {
    first: Mode,
    /// For each mode, its fraction of white noise transmitted, per unit rate, and its factor.
    modes: Vec<[f64; 2]>,
}

impl NoisePassage {
    /// For a stand, and its displacement, speed or acceleration.
    pub fn of(stand: &ModalResponse, gain: f64, measures: Motion) -> Self {
        let of_mode = |part: &ModalPart| {
            let Mode {
                omega_rad_s,
                damping_ratio,
            } = part.mode;
            let factor = gain * part.residue * omega_rad_s.powi(measures.order());
            [omega_rad_s / (4.0 * damping_ratio), factor * factor]
        };
        Self {
            first: stand.first(),
            modes: stand.parts().iter().map(of_mode).collect(),
        }
    }

    /// Power of noise after the stand, relative to that of white noise at a rate `f_s` before it: for each mode
    /// `g² r² ω^2m π f₀ / (2 ζ f_s)`, as `∫ |H|² df = π f₀ / (4 ζ)` from 0 on, with `m` for the recorded derivative of
    /// the displacement.
    fn passed(&self, rate_hz: f64) -> f64 {
        let modes = self.modes.iter();
        modes
            .map(|[width_hz, factor]| factor * (width_hz / rate_hz).min(MOST_PASSED))
            .sum()
    }
}

impl FittedModel {
    /// Transmission of noise through its plain stand.
    pub fn passage(&self) -> NoisePassage {
        let context = &self.structure.context;
        let chain = context.chain(&self.stand());
        NoisePassage::of(&chain.stand, chain.gain, context.measures)
    }
}

impl NoiseFloor {
    /// Whether it is the rounding error of the records.
    pub fn is_rounding(self) -> bool {
        self.from == NoiseFloorSource::Resolution
    }

    /// Noise of the records: from the differences between periods if every input is periodic, otherwise from the top of
    /// the spectrum, where the plain stand predicts no signal. The noise on the applied quantity, filtered by the
    /// stand, is added to either: it is not in the records, but in the response of a model to the recorded input.
    pub fn of(residuals: &[RecordResidual], passage: &NoisePassage) -> Option<Self> {
        Some(Self::measured(residuals, &passage.first)?.with_applied(residuals, passage))
    }

    /// The noise of the measured quantity alone.
    pub fn measured(residuals: &[RecordResidual], mode: &Mode) -> Option<Self> {
        let periods = residuals.iter().map(|r| {
            let record = &r.record;
            of_periods(record, record.measured_in_range(), mode)
        });
        let found = Self::pooled(periods, NoiseFloorSource::Periods).or_else(|| {
            let found = residuals.iter().filter_map(out_of_band);
            Self::pooled(found.map(Some), NoiseFloorSource::OutOfBand)
        })?;
        Some(found.or_rounding(residuals))
    }

    /// At least the rounding error of the records, `q²/12` for steps `q`: where noise is smaller than a step, the error
    /// follows the signal, and is the same in every period (B. Widrow, *IRE Trans. Circuit Theory* 3 (1956), 266).
    fn or_rounding(self, residuals: &[RecordResidual]) -> Self {
        let rounding = residuals.iter().map(|r| {
            let step = quantisation(r.record.measured_in_range()).map_or(0.0, |found| found.step);
            Some((step * step / 12.0, r.record.count()))
        });
        let rounding = Self::pooled(rounding, NoiseFloorSource::Resolution);
        rounding
            .filter(|rounding| rounding.rms > self.rms)
            .unwrap_or(self)
    }

    /// Noise in the residuals of a model, from differences between periods: disturbances that are not periodic with the
    /// input, such as mains pickup, are excluded if the model includes them.
    pub fn of_residuals(residuals: &[RecordResidual], passage: &NoisePassage) -> Option<Self> {
        let found = residuals.iter();
        let found = found.map(|r| of_periods(&r.record, &r.samples, &passage.first));
        let floor = Self::pooled(found, NoiseFloorSource::Periods)?.or_rounding(residuals);
        Some(floor.with_applied(residuals, passage))
    }

    /// Adds the noise on the applied quantity, filtered by the stand, except where the residual is weighted for it.
    fn with_applied(self, residuals: &[RecordResidual], passage: &NoisePassage) -> Self {
        let passed = |residual: &RecordResidual| {
            let record = &residual.record;
            let noise = match record.whitening {
                Some(_) => 0.0,
                None => noise_of_input(record.input.samples()),
            };
            let mean_square = noise * passage.passed(record.rate_hz());
            Some((mean_square, residual.samples.len()))
        };
        let applied = Self::pooled(residuals.iter().map(passed), self.from);
        let rms = applied.map_or(self.rms, |applied| self.rms.hypot(applied.rms));
        Self { rms, ..self }
    }

    /// Pooled noise of several records; `None` if it is unknown for one of them.
    fn pooled(
        found: impl Iterator<Item = Option<MeanSquare>>,
        from: NoiseFloorSource,
    ) -> Option<Self> {
        let found: Vec<MeanSquare> = found.collect::<Option<_>>()?;
        let count: usize = found.iter().map(|(_, n)| n).sum();
        let sum: f64 = found.iter().map(|(s, n)| s * *n as f64).sum();
        let rms = (sum / count as f64).sqrt();
        (count > 0).then_some(Self { rms, from })
    }
}

/// Mean square of the white noise on an applied quantity: from the changes on its plateaus, or the flat top of its
/// spectrum, if that is too low to be part of the excitation; otherwise 0.
pub fn noise_of_input(input: &[f64]) -> f64 {
    if let Some(noise) = noise_on_plateaus(input) {
        return noise;
    }
    let length = (input.len() / 16).next_power_of_two().clamp(64, 2048);
    let power = spectra(input, length.min(input.len())).power();
    let lines = power.len();
    let mean = |range: std::ops::Range<usize>| {
        let count = range.len().max(1) as f64;
        power[range].iter().sum::<f64>() / count
    };
    let part = |from: usize, to: usize| mean(lines * from / 100..lines * to / 100);
    let is_flat = |parts: &[f64]| {
        let least = parts.iter().copied().fold(f64::INFINITY, f64::min);
        parts.iter().all(|power| *power < FLAT * least)
    };
    let [below, top] = [part(80, 88), part(88, 97)];
    let is_shelf = is_flat(&[part(50, 65), part(65, 80), below, top]);
    let most = if is_shelf { SHELF } else { ONLY_NOISE };
    match is_flat(&[below, top]) && top < most * mean(0..lines) {
        true => top * lines as f64,
        false => 0.0,
    }
}

/// Noise from differences between periods, over the samples before which the input has been periodic for long
/// enough that the motion has settled.
fn of_periods(record: &StandRecord, y: &[f64], mode: &Mode) -> Option<MeanSquare> {
    let u = record.applied_in_range();
    let period = period(u)?;
    let small = SAME * dot(u, u) / u.len() as f64;
    let time_constant_s = 1.0 / (mode.damping_ratio * mode.omega_rad_s);
    let settled = (DECAYED * time_constant_s * record.rate_hz()) as usize;
    let mut run = 0;
    let mut differences = Vec::new();
    for i in period..u.len() {
        let repeats = (u[i] - u[i - period]).powi(2) < 100.0 * small;
        run = if repeats { run + 1 } else { 0 };
        if run > settled {
            differences.push(y[i] - y[i - period]);
        }
    }
    let count = differences.len();
    (count >= period).then(|| {
        let sections: Vec<&[f64]> = differences.chunks_exact(period / SECTIONS).collect();
        let squares = undisturbed(&sections).unwrap_or_else(|| mean_square(&[&differences]));
        (0.5 * squares, count)
    })
}

fn mean_square(sections: &[&[f64]]) -> f64 {
    let count: usize = sections.iter().map(|section| section.len()).sum();
    let squares = sections.iter().map(|section| dot(section, section));
    squares.sum::<f64>() / count as f64
}

/// Mean square of the sections whose power is not significantly above that of the quietest one, if it is much less than of
/// all: a change of the stand makes some periods differ, which is no noise. Neighbouring samples are correlated: `n` of them
/// have `n / Σ ρ²` degrees of freedom (M. S. Bartlett, *Suppl. J. R. Stat. Soc.* 8 (1946), 27).
fn undisturbed(sections: &[&[f64]]) -> Option<f64> {
    let power = |section: &&[f64]| mean_square(&[section]);
    let quietest = sections
        .iter()
        .min_by(|a, b| power(a).total_cmp(&power(b)))?;
    let (least, most) = (power(quietest), DISTURBED * mean_square(sections));
    if least >= most {
        return None;
    }
    let freedom = degrees_of_freedom(quietest);
    let is_alike = |section: &&&[f64]| {
        let law = FisherSnedecor::new(degrees_of_freedom(section), freedom);
        law.is_ok_and(|law| power(section) <= law.inverse_cdf(1.0 - BY_CHANCE) * least)
    };
    let alike: Vec<&[f64]> = sections.iter().filter(is_alike).copied().collect();
    Some(mean_square(&alike)).filter(|squares| *squares < most)
}

fn degrees_of_freedom(section: &[f64]) -> f64 {
    let sums = autocorrelation(section, section.len() / 2);
    let squares = sums[1..].iter().map(|r| (r / sums[0].max(1e-300)).powi(2));
    (section.len() as f64 / (1.0 + 2.0 * squares.sum::<f64>())).max(1.0)
}

/// Period of an input that is periodic over most of its length.
fn period(u: &[f64]) -> Option<usize> {
    let energy = dot(u, u) / u.len() as f64;
    if energy == 0.0 {
        return None;
    }
    // A piece from the middle is searched for in the second half.
    let from = u.len() / 2;
    let piece = varying_piece(u, from)?;
    let near = |lag: &usize| {
        let there = u[from + lag..].iter().zip(piece);
        there.map(|(a, b)| (a - b).powi(2)).sum::<f64>() < SAME * energy * piece.len() as f64
    };
    (SHORTEST..(u.len() - from).saturating_sub(piece.len())).find(near)
}

/// As many samples from an index as vary like the whole input.
fn varying_piece(u: &[f64], from: usize) -> Option<&[f64]> {
    let variance = |u: &[f64]| {
        let varying = without_mean(u);
        dot(&varying, &varying) / u.len() as f64
    };
    let least = VARIES * variance(u);
    let lengths = std::iter::successors(Some(PIECE), |length| Some(2 * length));
    let mut pieces = lengths.map_while(|length| u.get(from..from + length));
    pieces.find(|piece| variance(piece) >= least)
}

/// White noise at the level of the top of the spectrum.
fn out_of_band(residual: &RecordResidual) -> Option<MeanSquare> {
    let y = residual.record.measured_in_range();
    let length = (y.len() / 16).next_power_of_two().clamp(64, 2048);
    let length = length.min(y.len());
    let [measured, signal] = [y, &residual.modelled].map(|x| spectra(x, length).power());
    let lines = measured.len();
    let top = lines * 7 / 10..lines * 97 / 100;
    let is_noise = |k: &usize| signal[*k] < SIGNAL * measured[*k];
    let mut quiet: Vec<f64> = top.clone().filter(is_noise).map(|k| measured[k]).collect();
    if quiet.len() * 2 < top.len() || quiet.is_empty() {
        return None;
    }
    quiet.sort_by(f64::total_cmp);
    // The mean without the highest tenth, which may be lines.
    let kept = &quiet[..(quiet.len() * 9).div_ceil(10)];
    let level = kept.iter().sum::<f64>() / kept.len() as f64;
    Some((level * (lines - 1) as f64, y.len()))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    const RATE_HZ: f64 = 1000.0;
    const NOISE: f64 = 1e-3;

    /// A stand at 2 Hz: its time constant is 1.6 s.
    fn mode() -> Mode {
        Mode {
            omega_rad_s: 4.0 * PI,
            damping_ratio: 0.05,
        }
    }

    fn passage() -> NoisePassage {
        NoisePassage::of(&mode().into(), 1.0, Motion::Displacement)
    }

    #[test]
    fn noise_through_a_stand() {
        // π f₀/(2 ζ f_s) = π 2/(0.1 · 1000), and a second mode of half the part at 6 Hz, ζ = 0.1: a quarter of π 6/(0.2
        // · 1000).
        let one = PI * 2.0 / 100.0;
        assert!((passage().passed(RATE_HZ) - one).abs() < 1e-12);
        let part = |mode: Mode, residue| ModalPart {
            mode,
            residue,
            quadrature: 0.0,
            at_gage: None,
        };
        let second = Mode {
            omega_rad_s: 12.0 * PI,
            damping_ratio: 0.1,
        };
        let stand = ModalResponse::new(vec![part(mode(), 1.0), part(second, 0.5)]);
        let both = NoisePassage::of(&stand.expect("modes"), 1.0, Motion::Displacement);
        let want = one + 0.25 * PI * 6.0 / 200.0;
        assert!((both.passed(RATE_HZ) - want).abs() < 1e-12);
    }

    /// Response of the stand to steps of ±1 at these times: `1 − e^(−ζωt) (cos ω_d t + ζω/ω_d sin ω_d t)` for
    /// each.
    fn steps(times_s: &[f64], count: usize) -> RecordResidual {
        let mode = mode();
        let decay = mode.damping_ratio * mode.omega_rad_s;
        let swing = mode.omega_rad_s * (1.0 - mode.damping_ratio.powi(2)).sqrt();
        let answer = |t: f64| {
            let (sine, cosine) = (swing * t).sin_cos();
            1.0 - (-decay * t).exp() * (cosine + decay / swing * sine)
        };
        let sum = |i: usize, of: &dyn Fn(f64) -> f64| -> f64 {
            let time_s = i as f64 / RATE_HZ;
            let past = times_s.iter().enumerate().filter(|(_, at)| **at <= time_s);
            past.map(|(k, at)| [1.0, -1.0][k % 2] * of(time_s - at))
                .sum()
        };
        let applied = (0..count).map(|i| sum(i, &|_| 1.0)).collect();
        let clean: Vec<f64> = (0..count).map(|i| sum(i, &answer)).collect();
        // Numbers from −√3 to √3 have a standard deviation of 1; multiples of the golden ratio fill any range evenly,
        // and using squares removes their order.
        let noise = |i: usize| 12_f64.sqrt() * ((0.618_034 * (i * i) as f64).fract() - 0.5);
        let noisy = clean.iter().enumerate().map(|(i, y)| y + NOISE * noise(i));
        let mut residual = RecordResidual::made(applied, noisy.collect(), Vec::new());
        residual.modelled = clean;
        residual
    }

    #[test]
    fn the_floor_after_a_step_is_the_noise() {
        // The plateaus are constant; the stand oscillates on them for 20 s.
        for times_s in [&[5.0][..], &[5.0, 20.0], &[1.0, 9.0, 17.0, 25.0]] {
            let floor = NoiseFloor::of(&[steps(times_s, 32_000)], &passage()).expect("a floor");
            let ratio = floor.rms / NOISE;
            assert!((0.9..1.1).contains(&ratio), "{times_s:?}: {ratio}");
        }
    }

    #[test]
    fn noise_on_the_input_is_told_from_excitation() {
        let noise = |i: usize| 12_f64.sqrt() * ((0.618_034 * (i * i) as f64).fract() - 0.5);
        let line = |i: usize| (1..9).map(move |k| (0.03 * (k * i) as f64 + (k * k) as f64).sin());
        let made = |value: &dyn Fn(usize) -> f64| (0..20_000).map(value).collect::<Vec<_>>();
        let smooth = |i: usize| line(i).sum::<f64>() / 2.0;
        let level = |i: usize| ((i / 90 * 7) % 11) as f64 / 3.0 - 1.5;
        for clean in [&smooth as &dyn Fn(usize) -> f64, &level] {
            let found = noise_of_input(&made(&|i| clean(i) + 0.005 * noise(i))).sqrt();
            assert!((0.0045..0.0055).contains(&found), "{found}");
            assert!(noise_of_input(&made(clean)).sqrt() < 1e-4);
        }
        // Twice the noise that a short range of frequencies at the top would tell.
        let found = noise_of_input(&made(&|i| smooth(i) + 0.04 * noise(i))).sqrt();
        assert!((0.036..0.044).contains(&found), "{found}");
        // White excitation is not noise.
        assert!(noise_of_input(&made(&noise)) < 1e-12);
    }

    #[test]
    fn steps_that_repeat_give_the_noise_once_the_stand_has_settled() {
        // The input is periodic from the second period on; 12 time constants, 19.1 s, later the motion is, too.
        let times_s: Vec<f64> = (0..40).map(|k| 1.5 * f64::from(k)).collect();
        let floor = NoiseFloor::of(&[steps(&times_s, 64_000)], &passage()).expect("a floor");
        assert_eq!(floor.from, NoiseFloorSource::Periods);
        assert!((0.9..1.1).contains(&(floor.rms / NOISE)), "{}", floor.rms);
    }

    #[test]
    fn a_change_of_the_stand_is_no_noise() {
        let times_s: Vec<f64> = (0..50).map(|k| 1.5 * f64::from(k)).collect();
        let mut record = steps(&times_s, 72_000);
        let measured = record.record.measured.iter().enumerate();
        let changed = measured.map(|(i, y)| if i < 55_000 { *y } else { 1.1 * y });
        record.record.measured = std::sync::Arc::new(changed.collect());
        let floor = NoiseFloor::of(&[record], &passage()).expect("a floor");
        assert!((0.9..1.1).contains(&(floor.rms / NOISE)), "{}", floor.rms);
    }

    #[test]
    fn the_rounding_error_is_noise() {
        let times_s: Vec<f64> = (0..40).map(|k| 1.5 * f64::from(k)).collect();
        let mut record = steps(&times_s, 64_000);
        let measured = record.record.measured.iter();
        let rounded = measured.map(|y| 0.05 * (y / 0.05).round());
        record.record.measured = std::sync::Arc::new(rounded.collect());
        let floor = NoiseFloor::of(&[record], &passage()).expect("a floor");
        let expected = 0.05 / 12.0_f64.sqrt();
        assert_eq!(floor.from, NoiseFloorSource::Resolution);
        assert!(
            (0.95..1.05).contains(&(floor.rms / expected)),
            "{}",
            floor.rms
        );
    }
}
