//! Run-ups of a body with viscous and dry friction under torques that are constant over a sample, in closed form.

use torqcomp::identify::{Identification, Motion, runup};

use super::{Noise, TAU, of};

const RATE_HZ: f64 = 1000.0;
const RPM: f64 = TAU / 60.0;

#[derive(Clone, Copy)]
struct Body {
    inertia: f64,
    viscous: f64,
    dry: f64,
}

const LIGHT: Body = Body {
    inertia: 0.01,
    viscous: 0.002,
    dry: 0.05,
};
const HEAVY: Body = Body {
    inertia: 0.05,
    ..LIGHT
};

impl Body {
    /// Speed after a time under a torque: `w' = (T − F sgn w − f w)/J` until it stops.
    fn after(&self, speed: f64, torque: f64, time_s: f64) -> f64 {
        if speed == 0.0 && torque.abs() <= self.dry {
            return 0.0;
        }
        let way = if speed == 0.0 { torque } else { speed }.signum();
        let last = (torque - self.dry * way) / self.viscous;
        let next = last + (speed - last) * (-self.viscous * time_s / self.inertia).exp();
        if next * way < 0.0 { 0.0 } else { next }
    }

    /// Speeds at the samples of a torque, each of which acts from half a sample before to half a sample after.
    fn spin(&self, from: f64, torques: &[f64]) -> Vec<f64> {
        let mut speed = from;
        let half_s = 0.5 / RATE_HZ;
        let one = |torque: &f64| {
            let at = self.after(speed, *torque, half_s);
            speed = self.after(at, *torque, half_s);
            at
        };
        torques.iter().map(one).collect()
    }

    /// Names and true values.
    fn truth(&self, is_both: bool) -> Vec<(&'static str, f64)> {
        let mut all = vec![
            ("inertia", self.inertia),
            ("viscous_friction", self.viscous),
        ];
        if is_both {
            all.extend([("dry_friction", self.dry), ("offset", 0.0)]);
        } else {
            all.push(("dry_friction_and_offset", self.dry));
        }
        all
    }
}

fn torques(count: usize, at: impl Fn(f64) -> f64) -> Vec<f64> {
    super::times(count, RATE_HZ).into_iter().map(at).collect()
}

/// Each value with white noise.
fn noisy(values: &[f64], size: f64, seed: u64) -> Vec<f64> {
    let mut noise = Noise(seed);
    values.iter().map(|v| v + size * noise.normal()).collect()
}

fn rounded(values: &[f64], step: f64) -> Vec<f64> {
    values.iter().map(|v| (v / step).round() * step).collect()
}

/// Each speed with hum of 50 Hz.
fn hum(speed: &[f64]) -> Vec<f64> {
    let one = |(i, w): (u32, &f64)| w + 0.1 * (TAU * 0.05 * f64::from(i)).sin();
    (0..).zip(speed).map(one).collect()
}

/// Evaluates a record with noise on the torque.
fn evaluated(
    speed: &[f64],
    torque: &[f64],
    window_s: Option<f64>,
) -> Result<Identification, String> {
    evaluated_as_recorded((speed, Motion::Speed), &noisy(torque, 2e-3, 71), window_s)
}

fn evaluated_as_recorded(
    (motion, kind): (&[f64], Motion),
    torque: &[f64],
    window_s: Option<f64>,
) -> Result<Identification, String> {
    let run = runup::FreeRun {
        rate_hz: RATE_HZ,
        motion,
        kind,
        effort: torque,
        body: runup::Body::Turning,
    };
    let options = runup::RunupOptions {
        half_window_s: window_s,
        ..Default::default()
    };
    runup::identify(&run, &options).map_err(|error| error.to_string())
}

fn warns(found: &Identification, code: &str) -> bool {
    found.warnings.iter().any(|w| w.code == code)
}

/// All constants within 4 standard uncertainties, and the inertia within a fraction of itself.
fn right(found: &Identification, body: Body, within: f64, what: &str) {
    let is_both = found.get("offset").is_some();
    for (name, truth) in body.truth(is_both) {
        let constant = of(found, name);
        let std = constant.std().expect("a std");
        let off = (constant.value() - truth).abs();
        assert!(
            off < 4.0 * std,
            "{what}: {name} {} ± {std}, {truth}",
            constant.value()
        );
    }
    let inertia = of(found, "inertia").value();
    assert!(
        (inertia / body.inertia - 1.0).abs() < within,
        "{what}: {inertia}"
    );
    assert!(!warns(found, "poor-fit"), "{what}: {:?}", found.warnings);
}

fn refused(found: Result<Identification, String>, what: &str) {
    match found {
        Ok(found) => panic!("{what}: {:?}", found.parameters),
        Err(error) => assert!(
            error.contains("not separately identifiable"),
            "{what}: {error}"
        ),
    }
}

/// Rest, a run, coasting to rest, and the same backwards; and from one rest to another in one direction.
#[test]
fn a_rest_says_nothing_about_friction() {
    let torque = torques(26_000, |t| match t {
        1.0..4.0 => 0.3,
        13.0..16.0 => -0.3,
        _ => 0.0,
    });
    let speed = LIGHT.spin(0.0, &torque);
    assert!(speed[11_000..12_900].iter().all(|w| *w == 0.0));
    for (size, seed) in [(0.02, 1), (0.05, 2), (0.1, 3), (0.1, 4)] {
        let found = evaluated(&noisy(&speed, size, seed), &torque, None).unwrap();
        right(&found, LIGHT, 0.01, &format!("noise {size}"));
        assert!(
            found.method.iter().any(|line| line.contains("at rest")),
            "{:?}",
            found.method
        );
    }
    let torque = torques(45_000, |t| if (2.0..10.0).contains(&t) { 0.3 } else { 0.0 });
    let speed = HEAVY.spin(0.0, &torque);
    for (size, seed) in [(0.1, 1), (0.1, 2), (1.0, 3)] {
        let found = evaluated(&noisy(&speed, size * RPM, seed), &torque, None).unwrap();
        right(&found, HEAVY, 0.02, &format!("one way, noise {size} rpm"));
    }
}

/// `T = J w' + f w + C` under a constant torque is solved by C = T as well.
#[test]
fn one_constant_torque_determines_nothing() {
    let up = torques(12_000, |_| 0.3);
    let rest = torques(13_000, |t| if t < 1.0 { 0.0 } else { 0.3 });
    let coast = torques(12_000, |_| 0.0);
    let mut seed = 100;
    for (name, from, torque) in [
        ("run-up", 0.0, up),
        ("rest", 0.0, rest),
        ("coasting", 100.0, coast),
    ] {
        for body in [LIGHT, HEAVY] {
            let speed = body.spin(from, &torque);
            for rpm in [0.01, 0.1, 1.0, 3.0] {
                seed += 1;
                let found = evaluated(&noisy(&speed, rpm * RPM, seed), &torque, None);
                refused(found, &format!("{name}, noise {rpm} rpm"));
            }
            for rpm in [1.0, 5.0] {
                let found = evaluated(&rounded(&speed, rpm * RPM), &torque, None);
                refused(found, &format!("{name}, steps of {rpm} rpm"));
            }
            if name != "rest" {
                refused(
                    evaluated(&noisy(&hum(&speed), 0.01, 9), &torque, None),
                    name,
                );
            }
        }
    }
}

/// Two torques are enough, also with ripple or hum on the speed, which outweighs the acceleration in short windows.
#[test]
fn two_torques_determine_all_constants() {
    let torque = torques(14_000, |t| if t < 8.0 { 0.3 } else { 0.15 });
    let speed = HEAVY.spin(0.0, &torque);
    let mut angle = 0.0;
    let ripple = |w: &f64| {
        angle += w / RATE_HZ;
        w + 0.01 * w * (6.0 * angle).sin()
    };
    let ripple: Vec<f64> = speed.iter().map(ripple).collect();
    for (name, speed) in [
        ("white", &speed),
        ("ripple", &ripple),
        ("hum", &hum(&speed)),
    ] {
        let found = evaluated(&noisy(speed, 0.01, 5), &torque, None).unwrap();
        right(&found, HEAVY, 0.02, name);
    }
}

#[test]
fn steps_of_the_speed_are_averaged_over() {
    let torque = torques(12_000, |t| 0.4 + 0.2 * (TAU * 0.5 * t).sin());
    let speed = LIGHT.spin(0.0, &torque);
    for rpm in [1.0, 3.0, 5.0, 8.0] {
        let found = evaluated(&rounded(&speed, rpm * RPM), &torque, None).unwrap();
        right(&found, LIGHT, 0.01, &format!("steps of {rpm} rpm"));
        assert!(!warns(&found, "coarse-quantisation"), "{rpm}");
    }
    // In a window of one step, the error of a step does not average out.
    let found = evaluated(&rounded(&speed, 5.0 * RPM), &torque, Some(0.03)).unwrap();
    assert!(warns(&found, "coarse-quantisation"), "{:?}", found.warnings);
}

/// Sixty counts a turn, of which one takes up to a few hundred samples.
#[test]
fn counts_of_an_encoder_are_no_rests() {
    let torque = torques(12_000, |t| if t < 6.0 { 0.3 } else { 0.1 });
    let body = Body {
        inertia: 0.2,
        ..LIGHT
    };
    let mut angle = 0.0;
    let count = |w: f64| {
        angle += w / RATE_HZ;
        (60.0 * angle / TAU).floor() * TAU / 60.0
    };
    let angles: Vec<f64> = body.spin(0.0, &torque).into_iter().map(count).collect();
    let recorded = noisy(&torque, 2e-3, 73);
    let found = evaluated_as_recorded((&angles, Motion::Displacement), &recorded, None).unwrap();
    right(&found, body, 0.02, "counts");
}

#[test]
fn a_torque_that_is_held_is_right_if_it_acts_and_late_if_not() {
    let smooth = torques(40_000, |t| {
        0.5 * (TAU * 0.25 * t).sin() + 0.2 * (TAU * 0.9 * t).sin()
    });
    for hold in [20, 50] {
        let held = |values: &[f64]| -> Vec<f64> {
            (0..values.len()).map(|i| values[i / hold * hold]).collect()
        };
        let recorded = held(&noisy(&smooth, 2e-3, 72));
        let identified = |acts: &[f64], window_s: Option<f64>| {
            let speed = noisy(&LIGHT.spin(0.0, acts), 0.01, 7);
            evaluated_as_recorded((&speed, Motion::Speed), &recorded, window_s).unwrap()
        };
        let late = identified(&smooth, None);
        assert!(
            warns(&late, "channels-shifted"),
            "{hold}: {:?}",
            late.warnings
        );
        let acting = identified(&held(&smooth), None);
        right(&acting, LIGHT, 0.01, &format!("held for {hold}"));
        assert!(
            !warns(&acting, "channels-shifted"),
            "{hold}: {:?}",
            acting.warnings
        );
        // Windows of one and a half new values on each side.
        let short = identified(&smooth, Some(1.5e-3 * hold as f64));
        assert!(
            warns(&short, "repeated-samples"),
            "{hold}: {:?}",
            short.warnings
        );
    }
}

/// A fan: drag of 2e-4 N m s²/rad² beside the viscous friction, which would absorb it.
#[test]
fn drag_is_named() {
    let torque = torques(4000, |t| match t {
        t if t < 2.0 => 3.0,
        _ => -3.0,
    });
    let fan = |drag: f64| {
        let mut speed = 0.0_f64;
        let step = |torque: &f64| {
            for _ in 0..10 {
                let friction = 0.02 * speed + drag * speed * speed.abs() + 0.05 * speed.signum();
                speed += (torque - friction) / 0.008 * 1e-4;
            }
            speed
        };
        noisy(&torque.iter().map(step).collect::<Vec<_>>(), 0.1, 5)
    };
    let found = |drag| evaluated(&fan(drag), &noisy(&torque, 0.02, 6), None).unwrap();
    let with = found(2e-4);
    let warning = with.warnings.iter().find(|w| w.code == "drag");
    let message = &warning.expect("a warning").message;
    let viscous = message.split("viscous_friction ").nth(1).unwrap();
    let viscous: f64 = viscous.split(' ').next().unwrap().parse().unwrap();
    assert!((viscous / 0.02 - 1.0).abs() < 0.05, "{message}");
    assert!(!message.contains("check the signs"), "{message}");
    assert!(!warns(&found(0.0), "drag"));
}
