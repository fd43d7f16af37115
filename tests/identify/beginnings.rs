//! Decays that begin anew or late: second taps, soft pushes, hits that noise hides.

use torqcomp::identify::Identification;

use super::{Noise, TAU, of, of_decay, ramped, times};

const RATE_HZ: f64 = 5000.0;
const NATURAL_HZ: f64 = 120.0;

/// A second of a stand's motion, by steps of 1/400 of a sample; the torque over time, and what drags beside viscous damping.
fn driven(torque: impl Fn(f64) -> f64, (damping_ratio, drag): (f64, f64)) -> Vec<f64> {
    let (omega, step_s) = (TAU * NATURAL_HZ, 0.0025 / RATE_HZ);
    let (mut x, mut speed) = (0.0, 0.0_f64);
    let mut record = Vec::new();
    for k in 0..2_000_000 {
        if k % 400 == 0 {
            record.push(x);
        }
        let load = torque(f64::from(k) * step_s);
        let damping = 2.0 * damping_ratio * omega * speed + drag * speed * speed.abs();
        speed += step_s * (omega * omega * (load - x) - damping);
        x += step_s * speed;
    }
    let largest = record.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    record.iter().map(|x| x / largest).collect()
}

/// Half a sine from a moment on.
fn pulse(t: f64, (at_s, length_s): (f64, f64)) -> f64 {
    match (at_s..at_s + length_s).contains(&t) {
        true => (0.5 * TAU * (t - at_s) / length_s).sin(),
        false => 0.0,
    }
}

fn identified(mut record: Vec<f64>, noise: &mut Noise, size: f64) -> Identification {
    record.iter_mut().for_each(|x| *x += size * noise.normal());
    of_decay(&record, RATE_HZ)
}

fn codes(found: &Identification) -> Vec<&str> {
    found.warnings.iter().map(|w| w.code).collect()
}

/// Fails unless frequency and damping are those of the stand, within their uncertainties.
fn check(found: &Identification, damping_ratio: f64, what: &str) {
    for (name, truth) in [
        ("natural_frequency", NATURAL_HZ),
        ("damping_ratio", damping_ratio),
    ] {
        let (value, std) = (of(found, name).value(), of(found, name).std().unwrap());
        assert!(
            (value - truth).abs() < 4.0 * std && std < 0.2 * truth,
            "{what}: {name} {value} ± {std}, {:?}",
            codes(found)
        );
    }
}

#[test]
fn a_second_tap_is_a_decay_of_its_own() {
    let mut noise = Noise(11);
    for trial in 0..12 {
        let later_s = 0.05 + 0.02 * f64::from(trial);
        let size = 0.2 + 0.03 * f64::from(trial);
        let damping_ratio = 0.006 + 0.002 * f64::from(trial % 6);
        let taps = |t: f64| pulse(t, (0.1, 1.5e-3)) + size * pulse(t, (0.1 + later_s, 1.5e-3));
        let record = driven(taps, (damping_ratio, 0.0));
        let found = identified(record, &mut noise, 0.002 * f64::from(1 + trial % 5));
        let what = format!("{size} of the first after {later_s} s");
        check(&found, damping_ratio, &what);
        // A tap that is larger than what rings still is a hit of its own.
        let is_hit = found.method.iter().any(|line| line.contains("2 stretches"));
        let is_told = codes(&found).contains(&"restart-in-decay");
        assert!(is_hit || is_told, "{what}: {:?}", codes(&found));
    }
}

#[test]
fn a_soft_push_is_no_ringing() {
    let mut noise = Noise(12);
    for length_s in [0.012, 0.05] {
        let record = driven(|t| pulse(t, (0.1, length_s)), (0.01, 0.0));
        let found = identified(record, &mut noise, 0.003);
        check(&found, 0.01, &format!("a push of {length_s} s"));
        assert!(
            codes(&found).contains(&"driven-at-first"),
            "{:?}",
            codes(&found)
        );
    }
}

#[test]
fn noise_does_not_hide_where_a_decay_begins() {
    let mut noise = Noise(13);
    for size in [0.05, 0.07, 0.1, 0.15] {
        let record = driven(|t| pulse(t, (0.1, 1.5e-3)), (0.01, 0.0));
        let found = identified(record, &mut noise, size);
        check(&found, 0.01, &format!("noise of {size}"));
    }
}

/// A decay that is not viscous, with one beginning.
#[test]
fn drag_is_no_second_tap() {
    let mut noise = Noise(14);
    for drag in [0.005, 0.02] {
        let record = driven(|t| pulse(t, (0.1, 1.5e-3)), (0.005, drag));
        let found = identified(record, &mut noise, 0.003);
        let told = codes(&found);
        let is_cut = ["restart-in-decay", "driven-at-first"];
        assert!(
            !told.iter().any(|code| is_cut.contains(code)),
            "{drag}: {told:?}"
        );
        assert!(told.contains(&"amplitude-dependent"), "{drag}: {told:?}");
    }
}

/// A load taken off over 2.5 and 3.6 periods, as by hand: what looks like a baseline is the load.
#[test]
fn a_load_let_go_slowly_is_no_free_decay() {
    let mut noise = Noise(15);
    for length_s in [0.014, 0.02] {
        for _ in 0..3 {
            let taken = |t: f64| ramped(181.4, 0.0135, t - 0.05) / length_s;
            let load = |t: f64| 1.0 - taken(t) + taken(t - length_s);
            let record = times(4000, RATE_HZ).into_iter().map(load).collect();
            let found = identified(record, &mut noise, 0.003);
            let ratio = of(&found, "damping_ratio");
            let off = (ratio.value() - 0.0135).abs();
            assert!(off < 4.0 * ratio.std().unwrap(), "{length_s}: {ratio:?}");
        }
    }
}

/// A hammer that bounces: once, after a while, or twice in quick succession.
#[test]
fn a_rebound_is_a_restart_and_no_damping() {
    let mut noise = Noise(16);
    for (later_s, size) in [(0.05, 0.4), (0.06, 0.3), (0.1, 0.5)] {
        let hit = |t: f64, at_s: f64| pulse(t, (at_s, 4e-3)).powi(2);
        let record = driven(|t| hit(t, 0.1) + size * hit(t, 0.1 + later_s), (0.015, 0.0));
        let found = identified(record, &mut noise, 0.003);
        let what = format!("{size} of the first after {later_s} s");
        check(&found, 0.015, &what);
        let told = codes(&found);
        assert!(told.contains(&"restart-in-decay"), "{what}: {told:?}");
    }
}
