//! Decays of stands with viscous damping and dry friction, which stop at a displaced zero.

use torqcomp::identify::{Identification, ModalPole, decay};

use super::{Noise, TAU, of, of_decay, times};

const RATE_HZ: f64 = 5000.0;
const NATURAL_HZ: f64 = 180.0;
const DAMPING_RATIO: f64 = 0.015;
/// Steps per sample.
const STEPS: u32 = 400;

/// 0.6 s of a stand's motion by small steps, held at 1 until a moment and released then, with dry friction as the displacement
/// that balances it. Where the speed changes sign within the friction, the stand sticks.
fn released(friction: f64, at_s: f64) -> Vec<f64> {
    moved((NATURAL_HZ, DAMPING_RATIO), (friction, at_s), 3000)
}

/// A number of samples of the same motion of another stand.
fn moved((hz, damping_ratio): (f64, f64), (friction, at_s): (f64, f64), count: u32) -> Vec<f64> {
    let (omega, step_s) = (TAU * hz, 1.0 / (RATE_HZ * f64::from(STEPS)));
    let (mut x, mut speed, mut sticks) = (1.0_f64, 0.0_f64, false);
    let mut record = Vec::new();
    for k in 0..count * STEPS {
        if k % STEPS == 0 {
            record.push(x);
        }
        if sticks || f64::from(k) * step_s < at_s {
            continue;
        }
        let way = if speed == 0.0 {
            -x.signum()
        } else {
            speed.signum()
        };
        let torque = -omega * omega * (x + friction * way) - 2.0 * damping_ratio * omega * speed;
        let next = speed + step_s * torque;
        if next * speed < 0.0 {
            sticks = x.abs() <= friction;
            speed = 0.0;
            continue;
        }
        speed = next;
        x += step_s * speed;
    }
    record
}

fn identified(mut record: Vec<f64>, noise: &mut Noise) -> Identification {
    record
        .iter_mut()
        .for_each(|x| *x += 0.3 + 1e-3 * noise.normal());
    of_decay(&record, RATE_HZ)
}

/// Several modes, a restart at the stop, or a part that is driven.
const FALSE: [&str; 5] = [
    "driven-at-first",
    "restart-in-decay",
    "mains-taken-off",
    "tone-taken-off",
    "poor-fit",
];

#[test]
fn dry_friction_is_neither_several_modes_nor_a_restart() {
    let mut noise = Noise(15);
    // The last three begin within a period of a preload.
    for (friction, at_s) in [
        (0.005, 0.0833),
        (0.01, 0.0833),
        (0.02, 0.0833),
        (0.05, 0.0833),
        (0.01, 0.0006),
        (0.02, 0.0012),
        (0.05, 0.0006),
    ] {
        let found = identified(released(friction, at_s), &mut noise);
        let told: Vec<&str> = found.warnings.iter().map(|w| w.code).collect();
        let what = format!("{friction} after {at_s} s: {told:?}");
        assert_eq!(found.modes.len(), 1, "{what}");
        let frequency_hz = of(&found, "natural_frequency").value();
        assert!(
            (frequency_hz / NATURAL_HZ - 1.0).abs() < 1e-3,
            "{what}: {frequency_hz}"
        );
        assert!(told.contains(&"not-viscous"), "{what}");
        assert!(!told.iter().any(|code| FALSE.contains(code)), "{what}");
        let best = &found.laws[0];
        assert_eq!(best.law, decay::Law::ViscousAndDry, "{what}");
        let constants = [
            (best.damping_ratio, DAMPING_RATIO),
            (best.dry_friction, friction),
        ];
        for (constant, truth) in constants {
            let value = constant.unwrap().value;
            assert!(
                (value / truth - 1.0).abs() < 0.05,
                "{what}: {value} for {truth}"
            );
        }
    }
}

/// A weak second mode is not friction, nor is the beat of two modes a stop.
#[test]
fn two_modes_are_no_dry_friction() {
    let mut noise = Noise(16);
    for (size, hz) in [(0.02, 250.0), (0.2, 210.0), (0.9, 196.0)] {
        let mode = |t: f64, hz: f64| (-0.015 * TAU * hz * t).exp() * (TAU * hz * t).cos();
        let t = times(3000, RATE_HZ);
        let record = t.iter().map(|t| mode(*t, NATURAL_HZ) + size * mode(*t, hz));
        let found = identified(record.collect(), &mut noise);
        assert_eq!(
            found.modes.len(),
            2,
            "{size} at {hz} Hz: {:?}",
            found.warnings
        );
    }
}

/// A mode without friction beside it, as of a part that bends: many modes in place of one do not go unsaid.
#[test]
fn dry_friction_beside_another_mode_is_said() {
    let mut noise = Noise(17);
    let clean = released(0.02, 0.0);
    let mut crowds = 0;
    for phase in [0.0, 1.0, 2.0, 3.0, 4.0] {
        let beside = |t: f64| (-0.01 * TAU * 530.0 * t).exp() * (TAU * 530.0 * t + phase).cos();
        let pairs = clean.iter().zip(times(3000, RATE_HZ));
        let found = identified(
            pairs.map(|(x, t)| x + 0.02 * beside(t)).collect(),
            &mut noise,
        );
        let near =
            |mode: &ModalPole| (mode.pole().omega_rad_per_s / (TAU * NATURAL_HZ) - 1.0).abs() < 0.2;
        let count = found.modes.iter().filter(|mode| near(mode)).count();
        let is_said = found.warnings.iter().any(|w| w.code == "crowded-modes");
        assert!(
            is_said || count < 5,
            "{phase}: {count} modes, {:?}",
            found.warnings
        );
        crowds += usize::from(is_said);
    }
    assert!(crowds > 0);
}

/// One mode is asked for: dry friction is found also where nothing but the law of the decay shows it.
#[test]
fn the_one_mode_asked_for_has_its_friction() {
    let mut noise = Noise(18);
    let clean = moved((121.5, 0.01), (0.02, 0.0), 4000);
    for _ in 0..24 {
        let record: Vec<f64> = clean.iter().map(|x| x + 1e-3 * noise.normal()).collect();
        let ringing = decay::Ringing {
            name: "simulated",
            times_s: &times(record.len(), RATE_HZ),
            rate_hz: Some(RATE_HZ),
            values: &record,
        };
        let options = decay::DecayOptions {
            modes: Some(1),
            ..decay::DecayOptions::default()
        };
        let (found, _) = decay::identify(&[ringing], &options).unwrap();
        let damping_ratio = of(&found, "damping_ratio").value();
        assert!(
            (damping_ratio / 0.01 - 1.0).abs() < 0.05,
            "{damping_ratio}: {:?}",
            found.method
        );
    }
}

/// Two modes at 180 and 184 Hz beat: their envelope falls to zero as at a stop.
#[test]
fn two_modes_that_beat_are_no_dry_friction() {
    let mut noise = Noise(17);
    let mut found_as_two = 0;
    for (hz, ratio, size) in [(184.0, 0.012, 0.5), (183.0, 0.01, 0.3)] {
        let mode = |hz: f64, ratio: f64, t: f64| {
            let omega = TAU * hz;
            (-ratio * omega * t).exp() * (omega * (1.0 - ratio * ratio).sqrt() * t).sin()
        };
        let at = |t: f64| match t < 0.1 {
            true => 0.0,
            false => mode(180.0, 0.015, t - 0.1) + size * mode(hz, ratio, t - 0.1),
        };
        let record = times(4000, 2000.0).into_iter().map(at);
        let record: Vec<f64> = record.map(|x| x + 0.002 * noise.normal()).collect();
        let found = of_decay(&record, 2000.0);
        let named = found.parameters.iter();
        let named = named.filter(|p| p.name.ends_with("natural_frequency"));
        let mut modes: Vec<f64> = named.map(|p| p.value()).collect();
        modes.sort_by(f64::total_cmp);
        let told = found.warnings.iter();
        let is_asked = told.map(|w| w.code).any(|code| code == "close-lines");
        let is_two =
            modes.len() == 2 && (modes[0] - 180.0).abs() < 0.1 && (modes[1] - hz).abs() < 0.1;
        assert!(is_two || is_asked, "{hz} Hz, {size}: {modes:?}");
        found_as_two += usize::from(is_two);
    }
    assert!(found_as_two > 0);
}
