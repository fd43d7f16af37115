//! Linear effects: modes, material damping, filters, delay, coupling.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

use super::draw::Draw;
use super::excitation::{RATE_HZ, SAMPLES};
use super::integrate::{DENSE, Dense, Dynamics, State};
use super::plant::{Built, Constants, Place, Plain, Scene};

/// A second inertia on a spring and damper; the torque acts on the first, which the gage measures.
struct Coupled {
    constants: Constants,
    inertia: f64,
    stiffness: f64,
    damping: f64,
    /// Dry friction in the joint, smoothed over a speed (not listed).
    joint_friction: f64,
    joint_speed: f64,
}

impl Dynamics for Coupled {
    fn states(&self) -> usize {
        4
    }

    fn rates(&self, _: i8, _: f64, torque: f64, state: &State, rates: &mut State) {
        let slip = state[1] - state[3];
        let joint = self.stiffness * (state[0] - state[2])
            + self.damping * slip
            + self.joint_friction * (slip / self.joint_speed).tanh();
        rates[0] = state[1];
        rates[1] = self.constants.acceleration(torque - joint, state);
        rates[2] = state[3];
        rates[3] = joint / self.inertia;
    }

    fn shown(&self, _: i8, _: f64, _: f64, state: &State) -> f64 {
        self.constants.stiffness_n_m * state[0]
    }
}

/// Frequency of a second mode within the band, distinct from the first.
fn second_frequency_hz(scene: &Scene, draw: &mut Draw) -> f64 {
    let first = scene.constants.omega() / TAU;
    loop {
        let frequency_hz = draw.log_between(150.0 * scene.span.faster, 0.9 * scene.top_hz);
        if !(0.8..1.25).contains(&(frequency_hz / first)) {
            return frequency_hz;
        }
    }
}

fn coupled(scene: &Scene, size: f64, rubbing: bool, draw: &mut Draw) -> Built {
    let omega = TAU * second_frequency_hz(scene, draw);
    let ratio = draw.log_between(0.008, 0.05);
    let inertia = size * scene.constants.inertia_kg_m2;
    let friction = if rubbing {
        draw.log_between(0.03, 0.3)
    } else {
        0.0
    };
    let system = Coupled {
        constants: scene.constants,
        inertia,
        stiffness: inertia * omega * omega,
        damping: 2.0 * ratio * inertia * omega,
        joint_friction: friction * size * scene.applied_rms * 3.0,
        joint_speed: 0.03 * scene.speed_rms,
    };
    Built::dynamics(
        system,
        &[
            ("frequency_hz", omega / TAU),
            ("damping_ratio", ratio),
            ("inertia_ratio", size),
            ("joint_friction", friction),
        ],
    )
}

/// Two inertias in series.
pub fn second_mode_coupled(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    coupled(scene, size, false, draw)
}

/// The joint of the second inertia rubs (not listed).
pub fn rubbing_resonance(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    coupled(scene, size, true, draw)
}

/// `y = (1 − n) K θ + r q`, `q̈ + 2 ζ ω q̇ + ω² q = ω² T`: an additional mode that the gage also
/// shows.
struct Additional {
    constants: Constants,
    omega: f64,
    ratio: f64,
    share: f64,
    /// Whether the static gain stays 1.
    kept_static: bool,
}

impl Dynamics for Additional {
    fn states(&self) -> usize {
        4
    }

    fn rates(&self, _: i8, _: f64, torque: f64, state: &State, rates: &mut State) {
        rates[0] = state[1];
        rates[1] = self.constants.acceleration(torque, state);
        rates[2] = state[3];
        rates[3] = self.omega * (self.omega * (torque - state[2]) - 2.0 * self.ratio * state[3]);
    }

    fn shown(&self, _: i8, _: f64, _: f64, state: &State) -> f64 {
        let first = self.constants.stiffness_n_m * state[0];
        let rest = if self.kept_static {
            1.0 - self.share
        } else {
            1.0
        };
        rest * first + self.share * state[2]
    }
}

fn additional(scene: &Scene, size: f64, kept_static: bool, draw: &mut Draw) -> Built {
    let system = Additional {
        constants: scene.constants,
        omega: TAU * second_frequency_hz(scene, draw),
        ratio: draw.log_between(0.008, 0.05),
        share: size * draw.sign(),
        kept_static,
    };
    let parameters = [
        ("frequency_hz", system.omega / TAU),
        ("damping_ratio", system.ratio),
        ("share", system.share),
    ];
    Built::dynamics(system, &parameters)
}

/// Modal sum, static gain kept.
pub fn second_mode_modal(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    additional(scene, size, true, draw)
}

/// Modal sum, the second mode adds to the static gain.
pub fn second_mode_added(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    additional(scene, size, false, draw)
}

/// `K (1 + jη)`: constant loss factor, through the transform of the input.
pub fn structural_complex(scene: &Scene, size: f64, _: &mut Draw) -> Built {
    let constants = scene.constants;
    let change = move |place: &mut Place, samples: &mut [f64]| {
        samples.copy_from_slice(&complex_stiffness(constants, size, place));
    };
    Built::samples(scene, change, &[("loss_factor", size)])
}

/// Response of a stand with complex stiffness. It is non-causal, so the input must continue after the
/// record; the wrap-around of the transform falls into zeros.
fn complex_stiffness(constants: Constants, loss: f64, place: &Place) -> Vec<f64> {
    let before = place.input.before / super::excitation::FINER;
    let mut padded = place.input.all_samples();
    let length = 4 * SAMPLES;
    padded.resize(length, 0.0);
    let (forward, inverse) = (
        torqcomp_fourier::forward(length),
        torqcomp_fourier::inverse(length),
    );
    let mut spectrum = forward.make_output_vec();
    forward
        .process(&mut padded, &mut spectrum)
        .expect("lengths agree");
    for (bin, value) in spectrum.iter_mut().enumerate() {
        let omega = TAU * RATE_HZ * bin as f64 / length as f64;
        let twist = if bin == 0 { 0.0 } else { loss };
        let stiffness = constants.stiffness_n_m * Complex64::new(1.0, twist);
        let rest = Complex64::new(
            -constants.inertia_kg_m2 * omega * omega,
            constants.damping_n_m_s * omega,
        );
        *value *= constants.stiffness_n_m / (stiffness + rest) / length as f64;
    }
    spectrum[length / 2].im = 0.0;
    inverse
        .process(&mut spectrum, &mut padded)
        .expect("lengths agree");
    padded[before..before + place.input.samples].to_vec()
}

/// Springs and dampers in series, log-spaced in time constant, parallel to the spring: a causal loss
/// factor that is constant within a few per cent from 1 Hz to 10 kHz.
struct Ladder {
    constants: Constants,
    each: f64,
    rates_s: Vec<f64>,
}

impl Ladder {
    /// With equal stiffness `g` per branch and `n` branches per decade the loss is
    /// `g n π / (2 ln 10)`.
    fn new(constants: Constants, loss: f64) -> Self {
        let per_decade = 4.0;
        let each = loss * 2.0 * std::f64::consts::LN_10 / (PI * per_decade);
        let rates_s = (0..20)
            .map(|i| TAU * 10_f64.powf(-0.5 + f64::from(i) / per_decade))
            .collect();
        Self {
            constants,
            each,
            rates_s,
        }
    }
}

impl Dynamics for Ladder {
    fn states(&self) -> usize {
        2 + self.rates_s.len()
    }

    fn rates(&self, _: i8, _: f64, torque: f64, state: &State, rates: &mut State) {
        let branch = self.each * self.constants.stiffness_n_m;
        let mut carried = 0.0;
        for (i, rate) in self.rates_s.iter().enumerate() {
            let stretch = state[0] - state[2 + i];
            carried += branch * stretch;
            rates[2 + i] = rate * stretch;
        }
        rates[0] = state[1];
        rates[1] = self.constants.acceleration(torque - carried, state);
    }

    fn shown(&self, _: i8, _: f64, _: f64, state: &State) -> f64 {
        self.constants.stiffness_n_m * state[0]
    }
}

/// A causal material with almost constant loss factor.
pub fn structural_ladder(scene: &Scene, size: f64, _: &mut Draw) -> Built {
    Built::dynamics(Ladder::new(scene.constants, size), &[("loss_factor", size)])
}

/// A filter of the recorder.
#[derive(Clone, Copy)]
enum Filter {
    /// One RC low-pass.
    Low1,
    /// Two equal RC low-passes in series.
    Low1Twice,
    /// Butterworth low-pass of second order.
    Low2,
    /// One RC high-pass (AC coupling).
    High1,
    /// A share of the signal is delayed by one RC low-pass.
    Creep(f64),
}

struct Filtered {
    inner: Plain,
    filter: Filter,
    omega: f64,
}

const FIRST: usize = 2;

impl Dynamics for Filtered {
    fn states(&self) -> usize {
        4
    }

    fn rates(&self, mode: i8, time_s: f64, torque: f64, state: &State, rates: &mut State) {
        self.inner.rates(mode, time_s, torque, state, rates);
        let signal = self.inner.shown(mode, time_s, torque, state);
        let (w, a, b) = (self.omega, state[FIRST], state[FIRST + 1]);
        match self.filter {
            Filter::Low1 | Filter::High1 | Filter::Creep(_) => rates[FIRST] = w * (signal - a),
            Filter::Low1Twice => {
                rates[FIRST] = w * (signal - a);
                rates[FIRST + 1] = w * (a - b);
            }
            Filter::Low2 => {
                rates[FIRST] = b;
                rates[FIRST + 1] = w * (w * (signal - a) - std::f64::consts::SQRT_2 * b);
            }
        }
    }

    fn shown(&self, mode: i8, time_s: f64, torque: f64, state: &State) -> f64 {
        let signal = self.inner.shown(mode, time_s, torque, state);
        match self.filter {
            Filter::Low1 | Filter::Low2 => state[FIRST],
            Filter::Low1Twice => state[FIRST + 1],
            Filter::High1 => signal - state[FIRST],
            Filter::Creep(share) => signal + share * state[FIRST],
        }
    }
}

fn filtered(scene: &Scene, filter: Filter, corner_hz: f64) -> Built {
    let system = Filtered {
        inner: Plain(scene.constants),
        filter,
        omega: TAU * corner_hz,
    };
    Built::dynamics(system, &[("corner_hz", corner_hz)])
}

/// Corner of a low-pass of size 1: that of the thesis' stand, lower for a slower stand. For a faster one it stays,
/// below the Nyquist frequency.
fn corner_hz(scene: &Scene) -> f64 {
    600.0 * scene.span.faster.min(1.0)
}

/// RC low-pass; size 1 puts its corner at 600 Hz.
pub fn low_pass_1(scene: &Scene, size: f64, _: &mut Draw) -> Built {
    filtered(scene, Filter::Low1, corner_hz(scene) / size)
}

/// Two RC low-passes.
pub fn low_pass_twice(scene: &Scene, size: f64, _: &mut Draw) -> Built {
    filtered(scene, Filter::Low1Twice, corner_hz(scene) / size)
}

/// Butterworth of second order.
pub fn low_pass_2(scene: &Scene, size: f64, _: &mut Draw) -> Built {
    filtered(scene, Filter::Low2, corner_hz(scene) / size)
}

/// AC coupling; size 1 puts its corner at 5 Hz.
pub fn ac_coupling(scene: &Scene, size: f64, _: &mut Draw) -> Built {
    filtered(scene, Filter::High1, 5.0 * size / scene.span.longer())
}

/// The gage creeps after a load.
pub fn creep(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let corner_hz = draw.log_between(2.0, 20.0) / scene.span.longer();
    let share = size * draw.sign();
    let mut built = filtered(scene, Filter::Creep(share), corner_hz);
    built.parameters.push(("share", share));
    built
}

/// The drive couples into the signal leads: `c dT/dt` is added.
pub fn feedthrough(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let seconds = size * draw.sign() / (TAU * 1000.0 * scene.span.faster);
    let change = move |place: &mut Place, samples: &mut [f64]| {
        for (sample, rate) in samples.iter_mut().zip(place.input.rates()) {
            *sample += seconds * rate;
        }
    };
    Built::samples(scene, change, &[("seconds", seconds)])
}

/// The same through an RC high-pass with its corner in the band.
struct Leak {
    inner: Plain,
    omega: f64,
    share: f64,
}

impl Dynamics for Leak {
    fn states(&self) -> usize {
        3
    }

    fn rates(&self, mode: i8, time_s: f64, torque: f64, state: &State, rates: &mut State) {
        self.inner.rates(mode, time_s, torque, state, rates);
        rates[2] = self.omega * (torque - state[2]);
    }

    fn shown(&self, mode: i8, time_s: f64, torque: f64, state: &State) -> f64 {
        self.inner.shown(mode, time_s, torque, state) + self.share * (torque - state[2])
    }
}

/// The drive couples in through capacitance and resistance.
pub fn feedthrough_rc(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let corner_hz = draw.log_between(1000.0, 8000.0) * scene.span.faster.min(1.0);
    let leak = Leak {
        inner: Plain(scene.constants),
        omega: TAU * corner_hz,
        share: size * draw.sign(),
    };
    let parameters = [("corner_hz", corner_hz), ("share", leak.share)];
    Built::dynamics(leak, &parameters)
}

/// A pure delay; size 1 is one sample.
pub fn delay(scene: &Scene, size: f64, _: &mut Draw) -> Built {
    let delay_s = size / RATE_HZ;
    let whole = scene.filtered;
    let change = move |dense: Dense| stretched(&dense, whole, move |time_s| time_s - delay_s);
    Built::dense(scene, change, &[("delay_s", delay_s)])
}

/// The recorder's two channels have separate clocks (not listed); size 1 is one sample in total.
pub fn clock_drift(scene: &Scene, size: f64, draw: &mut Draw) -> Built {
    let rate = size * draw.sign() / scene.span.samples as f64;
    let whole = scene.filtered;
    let change = move |dense: Dense| stretched(&dense, whole, move |time_s| time_s * (1.0 + rate));
    Built::dense(scene, change, &[("relative_rate", rate)])
}

/// The signal at other times; between the samples only if a filter follows.
fn stretched(dense: &Dense, whole: bool, time: impl Fn(f64) -> f64) -> Dense {
    let values = (0..dense.values.len())
        .map(|point| {
            if !whole && point % DENSE != dense.before % DENSE {
                return 0.0; // only the samples are read
            }
            dense.at(time((point as f64 - dense.before as f64) * dense.step_s))
        })
        .collect();
    Dense { values, ..*dense }
}
