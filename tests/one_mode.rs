//! Records of a stand with one mode and an arbitrary additional torque.

use std::f64::consts::TAU;

use crate::motion::step;
use crate::noise::Noise;

pub const NATURAL_HZ: f64 = 20.0;
pub const DAMPING_RATIO: f64 = 0.05;
pub const RATE_HZ: f64 = 800.0;
pub const SAMPLES: usize = 6_000;
/// Integration steps per sample.
const STEPS: usize = 16;
/// Noise relative to the RMS of the record.
const NOISE: f64 = 0.003;

/// An inertia that hangs on the stand's own by a spring and a damper: its frequency and damping ratio alone, and its
/// size relative to the stand's.
#[derive(Clone, Copy)]
pub struct Hung {
    pub natural_hz: f64,
    pub damping_ratio: f64,
    pub inertia_ratio: f64,
}

/// Applied and recorded torque of a stand with a torque in N m, a function of time, displacement and speed divided by
/// `ω`, in addition to a spring of 1, under forty sines; and the RMS of the noise.
pub fn record(
    law: impl Fn(f64, f64, f64) -> f64,
    excited: (f64, f64),
    noise: &mut Noise,
) -> (String, f64) {
    let nothing = Hung {
        natural_hz: 0.0,
        damping_ratio: 0.0,
        inertia_ratio: 0.0,
    };
    record_with(law, nothing, excited, noise)
}

/// The same with a second inertia.
pub fn record_with(
    law: impl Fn(f64, f64, f64) -> f64,
    hung: Hung,
    (level, to_hz): (f64, f64),
    noise: &mut Noise,
) -> (String, f64) {
    let omega = TAU * NATURAL_HZ;
    let lines: Vec<[f64; 2]> = (0..40)
        .map(|k| {
            let hz = (0.04 + 0.96 * (f64::from(k) + noise.uniform()) / 40.0) * to_hz;
            [TAU * hz, TAU * noise.uniform()]
        })
        .collect();
    let torque = |t: f64| -> f64 {
        let lines = lines.iter();
        level * lines.map(|[w, phase]| (w * t + phase).sin()).sum::<f64>()
    };
    let own = TAU * hung.natural_hz;
    let slope = |t: f64, [x, v, y, w]: [f64; 4]| {
        let pull = torque(t) - x - law(t, x, v / omega);
        let back = own * own * (y - x) + 2.0 * hung.damping_ratio * own * (w - v);
        let alone = omega * omega * pull - 2.0 * DAMPING_RATIO * omega * v;
        [v, alone + hung.inertia_ratio * back, w, -back]
    };
    let h = 1.0 / (RATE_HZ * STEPS as f64);
    let (mut state, mut motion) = ([0.0; 4], Vec::new());
    for i in 0..SAMPLES * STEPS {
        if i % STEPS == 0 {
            motion.push(state[0]);
        }
        state = step(state, i as f64 * h, h, slope);
    }
    let rms = (motion.iter().map(|x| x * x).sum::<f64>() / SAMPLES as f64).sqrt();
    let mut text = String::from("time_s,applied_n_m,measured_n_m\n");
    for (i, x) in motion.iter().enumerate() {
        let t = i as f64 / RATE_HZ;
        let seen = x + NOISE * rms * noise.normal();
        text += &format!("{t:.6},{:.9},{seen:.9}\n", torque(t));
    }
    (text, NOISE * rms)
}
