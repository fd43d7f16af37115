//! Settings far from the thesis' stand: 0.5 Hz to 5 kHz, lightly to strongly damped, five kinds of input, noise on
//! the applied torque, filters before the recorder, records of 20 periods and more.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::anti_alias::AntiAlias;
use super::catalogue::Variant;
use super::draw::Draw;
use super::excitation::{Excitation, FINER, Line, RATE_HZ, SAMPLES};
use super::kinds::{Hits, Pulse, Random, Steps};
use super::plain_fit::rms;
use super::plant::Constants;
use super::setting::{AppliedNoise, Noise, Setting, target};
use super::span::Span;

/// Nominal natural frequencies, as in the files.
pub const NATURAL_HZ: [f64; 4] = [0.5, 20.0, 590.0, 5000.0];
/// Noise of the applied torque relative to its RMS.
const APPLIED_NOISE: f64 = 0.005;
/// Time constants after which a stand counts as settled, and the maximum waiting time.
const SETTLED: f64 = 12.0;
const LONGEST_S: f64 = 1.6;

const KINDS: [&str; 5] = ["multisine", "sweep", "random", "steps", "hits"];

/// The stand of a case and its time scale.
fn stand(draw: &mut Draw) -> (Constants, Constants, Span) {
    let natural_hz = draw.log_between(330.0, 1600.0);
    let written_hz = draw.one_of(&NATURAL_HZ) * draw.between(0.8, 1.2);
    let ratio = draw.log_between(0.003, 0.3);
    let least = (20.0 * RATE_HZ / natural_hz).max(600.0);
    // A recorder's rate has few digits.
    let rate_hz = RATE_HZ * written_hz / natural_hz;
    let digit = 10_f64.powi(rate_hz.log10().floor() as i32 - 2);
    let slower = RATE_HZ / ((rate_hz / digit).round() * digit);
    let omega = TAU * natural_hz;
    let mut off = || 1.0 + draw.sign() * draw.log_between(0.02, 0.2);
    let declared_n_m = Constants::hertel().stiffness_n_m;
    let stiffness_n_m = declared_n_m * off();
    let inertia_kg_m2 = stiffness_n_m / (omega * omega);
    let damping_n_m_s = 2.0 * ratio * inertia_kg_m2 * omega;
    let declared = Constants {
        inertia_kg_m2: inertia_kg_m2 / off(),
        damping_n_m_s: damping_n_m_s / off(),
        stiffness_n_m: declared_n_m,
    };
    let constants = Constants {
        inertia_kg_m2,
        damping_n_m_s,
        stiffness_n_m,
    };
    let span = Span {
        samples: draw.log_between(least, SAMPLES as f64) as usize,
        settling_s: (SETTLED / (ratio * omega)).max(0.03),
        faster: omega / Constants::hertel().omega(),
        slower,
    };
    (constants, declared, span)
}

/// A multisine with some periods per record.
fn multisine(draw: &mut Draw, rms: f64, top_hz: f64, span: &Span, settled: bool) -> Excitation {
    // Between 12 and 1200 lines.
    let cycles = top_hz * span.length_s();
    let periods: f64 = draw.one_of(&[1.0, 2.0, 4.0, 8.0]);
    let periods = periods.min(cycles / 12.0).max(cycles / 1200.0).max(1.0);
    let spacing_hz = RATE_HZ / (span.samples as f64 / periods).floor();
    let skip = draw.one_of(&[1, 1, 2]);
    let orders = (1..).step_by(skip);
    let frequencies = orders.map(|order: u32| f64::from(order) * spacing_hz);
    let mut lines: Vec<Line> = frequencies
        .take_while(|frequency_hz| *frequency_hz <= top_hz)
        .map(|frequency_hz| Line {
            amplitude: 1.0,
            frequency_hz,
            phase_rad: draw.phase(),
        })
        .collect();
    let amplitude = rms * (2.0 / lines.len() as f64).sqrt();
    lines.iter_mut().for_each(|line| line.amplitude = amplitude);
    Excitation::Multisine {
        lines,
        second_half: 1.0,
        settled,
    }
}

fn sweep(draw: &mut Draw, amplitude: f64, top_hz: f64, natural_hz: f64, span: &Span) -> Excitation {
    let low_hz = natural_hz * draw.log_between(0.005, 0.05);
    let (from_hz, to_hz) = match draw.chance(0.8) {
        true => (low_hz, top_hz),
        false => (top_hz, low_hz),
    };
    let fade_s = span.length_s() * draw.one_of(&[0.003, 0.0125, 0.03]);
    Excitation::Sweep {
        amplitude,
        from_hz,
        to_hz,
        logarithmic: draw.chance(0.4),
        fade_s: fade_s.max(0.5 / natural_hz),
    }
}

fn steps(draw: &mut Draw, rms: f64, natural_hz: f64, span: &Span, settled: bool) -> Excitation {
    let period = RATE_HZ / natural_hz;
    let before = if settled {
        (span.settling_s * RATE_HZ) as usize
    } else {
        0
    };
    // At least a dozen plateaus per record.
    let each = (period * draw.log_between(1.0, 10.0)).min(span.samples as f64 / 12.0);
    Excitation::Steps(Steps {
        plateaus: Steps::drawn(draw, rms, before + span.samples + 8, each),
        settled,
        top_hz: 3.0 * natural_hz,
    })
}

fn hits(draw: &mut Draw, height: f64, natural_hz: f64, span: &Span) -> Excitation {
    let period = RATE_HZ / natural_hz;
    let width = (period * draw.between(0.2, 1.0)).max(8.0);
    // A half-sine has corners: at least 30 samples, so that the record resolves it.
    let smooth = width < 30.0 || draw.chance(0.5);
    let apart = (period * draw.between(6.0, 30.0)).max(3.0 * width);
    let both = draw.chance(0.5);
    let mut pulses = Vec::new();
    let mut at = period * draw.between(1.0, 4.0);
    while at + width < span.samples as f64 {
        let sign = if both { draw.sign() } else { 1.0 };
        pulses.push(Pulse {
            node: (at * FINER as f64) as usize,
            nodes: (width * FINER as f64) as usize,
            height: height * sign * draw.between(0.5, 1.0),
            smooth,
        });
        at += apart.max(span.samples as f64 / 40.0) * draw.between(0.7, 1.3);
    }
    let top_hz = 1.2 * RATE_HZ / width;
    Excitation::Hits(Hits {
        pulses,
        top_hz: top_hz.clamp(1.7 * natural_hz, 3.7 * natural_hz),
    })
}

/// Training and held-out input: the same kind, usually at another level, or another kind.
fn excitations(
    draw: &mut Draw,
    natural_hz: f64,
    span: &Span,
    alike: bool,
    plateaus: bool,
) -> [Excitation; 2] {
    let rms = draw.log_between(1.0, 8.0);
    let top_hz = natural_hz * draw.between(1.7, 3.7);
    let settled = draw.chance(0.6) && span.settling_s <= LONGEST_S;
    let kinds = if plateaus {
        &KINDS[..]
    } else {
        &["multisine", "sweep", "random", "hits"][..]
    };
    let kind = draw.one_of(kinds);
    let other = if draw.chance(0.7) || alike {
        kind
    } else {
        draw.one_of(kinds)
    };
    let drawn = if draw.chance(0.8) {
        draw.between(0.4, 0.8)
    } else {
        draw.between(1.2, 1.5)
    };
    let level = if alike { 1.0 } else { drawn };
    let again = draw.chance(0.4);
    let mut of = |kind: &str, rms: f64| match kind {
        "multisine" => multisine(draw, rms, top_hz, span, settled),
        "sweep" => sweep(draw, 1.5 * rms, top_hz, natural_hz, span),
        "random" => Excitation::Random(Random {
            rms,
            top_hz,
            settled,
            seed: (draw.unit() * 9e15) as u64,
        }),
        "steps" => steps(draw, rms, natural_hz, span, settled),
        _ => hits(draw, 3.0 * rms, natural_hz, span),
    };
    let first = of(kind, rms);
    let second = match kind == other && again {
        true => first.at_level(level),
        false => of(other, rms * level),
    };
    [first, second]
}

/// Noise on the applied torque as recorded, and the response of the true plain stand to it.
fn applied_noise(constants: Constants, recorded: [&[f64]; 2], seed: u64) -> AppliedNoise {
    let made = [0, 1].map(|index: usize| {
        let mut draw = Draw::new(
            seed,
            ["noise on applied", "noise on applied of holdout"][index],
        );
        let size = APPLIED_NOISE * rms(recorded[index]);
        let noise: Vec<f64> = recorded[index]
            .iter()
            .map(|_| size * draw.normal())
            .collect();
        let through = rms(&answered(constants, &noise));
        (noise, through)
    });
    let [(train, through_train), (holdout, through_holdout)] = made;
    AppliedNoise {
        share_of_rms: APPLIED_NOISE,
        samples: [train, holdout],
        through_n_m: [through_train, through_holdout],
    }
}

/// Response of a plain stand to samples that repeat periodically.
pub fn answered(constants: Constants, samples: &[f64]) -> Vec<f64> {
    let length = samples.len();
    let (forward, inverse) = (
        torqcomp_fourier::forward(length),
        torqcomp_fourier::inverse(length),
    );
    let mut values = samples.to_vec();
    let mut spectrum = forward.make_output_vec();
    forward
        .process(&mut values, &mut spectrum)
        .expect("lengths agree");
    for (bin, value) in spectrum.iter_mut().enumerate() {
        let omega = TAU * RATE_HZ * bin as f64 / length as f64;
        let resists = Complex64::new(
            constants.stiffness_n_m - constants.inertia_kg_m2 * omega * omega,
            constants.damping_n_m_s * omega,
        );
        *value *= constants.stiffness_n_m / resists / length as f64;
    }
    spectrum[0].im = 0.0;
    if length.is_multiple_of(2) {
        spectrum[length / 2].im = 0.0;
    }
    inverse
        .process(&mut spectrum, &mut values)
        .expect("lengths agree");
    values
}

fn filter(draw: &mut Draw, plateaus: bool) -> Option<AntiAlias> {
    let (order, part) = match plateaus {
        // The remainder of a jump above the Nyquist frequency shows as ringing that no sample of the input explains.
        true => (4, draw.between(0.25, 0.3)),
        false => (draw.one_of(&[2, 4]), draw.between(0.25, 0.4)),
    };
    draw.chance(0.25).then_some(AntiAlias {
        order,
        corner_hz: part * RATE_HZ,
    })
}

/// Draws the setting of a case.
pub fn setting(seed: u64, number: usize, alike: bool, plateaus: bool) -> Setting {
    let mut draw = Draw::new(seed, "wide setting");
    let (constants, declared, span) = stand(&mut draw);
    let noise = Noise::drawn(&mut draw);
    let target = target(&mut draw, number);
    let natural_hz = constants.omega() / TAU;
    let excitations = excitations(&mut draw, natural_hz, &span, alike, plateaus);
    let inputs = [0, 1].map(|k: usize| excitations[k].input_over(&span));
    let jumps = excitations.iter().any(|e| e.kind() == "steps");
    let filter = filter(&mut draw, jumps);
    let filtered = filter.map(|filter| [0, 1].map(|k: usize| inputs[k].filtered(&filter)));
    let mut setting = Setting {
        constants,
        excitations,
        inputs,
        noise,
        target,
        span,
        declared: Some(declared),
        filter,
        filtered,
        applied_noise: None,
    };
    if draw.chance(0.5) {
        let recorded = [0, 1].map(|k: usize| setting.recorded(k).samples());
        let recorded = [&recorded[0][..], &recorded[1][..]];
        setting.applied_noise = Some(applied_noise(constants, recorded, seed));
    }
    setting
}

/// Whether a definition permits plateaus: the derivative of a jump cannot be recorded, and a non-causal response has no
/// record to begin in.
pub fn takes_plateaus(variants: &[&Variant]) -> bool {
    !variants.iter().any(|variant| {
        [
            ("capacitive-coupling", "derivative"),
            ("structural-damping", "complex"),
        ]
        .contains(&(variant.effect, variant.name))
    })
}

/// Whether records of a setting could show a definition: the mains have a fixed frequency.
pub fn suits(setting: &Setting, variants: &[&Variant]) -> bool {
    let mains = variants.iter().any(|v| v.effect == "mains-pickup");
    let span = &setting.span;
    !mains || 50.0 * span.slower * span.length_s() >= 4.0 && 60.0 * span.slower <= 0.3 * RATE_HZ
}
