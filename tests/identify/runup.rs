//! Run-ups: coverage of the intervals. The records follow from closed forms.

use torqcomp::identify::{Motion, runup};

use super::{Coverage, Noise, TAU, of};
use crate::util::{Folder, assert_close, codes};

/// A body with viscous and dry friction: `J v' + f v + F sgn v + C = T`.
struct Body {
    inertia: f64,
    viscous: f64,
    dry: f64,
    offset: f64,
}

const BODY: Body = Body {
    inertia: 0.25,
    viscous: 0.4,
    dry: 0.6,
    offset: 0.15,
};

/// Driving sines: amplitude in N m, angular frequency in rad/s, phase.
type Drive = [(f64, f64, f64); 2];

/// An interval in which the body moves in one direction, or stops (way 0).
#[derive(Clone, Copy)]
struct Stretch {
    start: f64,
    way: f64,
    speed: f64,
    angle: f64,
}

impl Body {
    fn torque(drive: &Drive, t: f64) -> f64 {
        drive.iter().map(|(a, w, p)| a * (w * t + p).sin()).sum()
    }

    /// Speed of the steady part and its integral.
    fn steady(&self, drive: &Drive, way: f64, t: f64) -> (f64, f64) {
        let level = -(self.offset + self.dry * way) / self.viscous;
        drive.iter().fold((level, level * t), |(v, x), (a, w, p)| {
            let below = self.viscous.powi(2) + (self.inertia * w).powi(2);
            let (sin, cos) = (w * t + p).sin_cos();
            (
                v + a * (self.viscous * sin - self.inertia * w * cos) / below,
                x - a * (self.viscous * cos / w + self.inertia * sin) / below,
            )
        })
    }

    /// Speed and angle at a time within an interval.
    fn at(&self, drive: &Drive, s: &Stretch, t: f64) -> (f64, f64) {
        if s.way == 0.0 {
            return (0.0, s.angle);
        }
        let rate = self.viscous / self.inertia;
        let (v0, x0) = self.steady(drive, s.way, s.start);
        let (v, x) = self.steady(drive, s.way, t);
        let rest = s.speed - v0;
        let fall = (-rate * (t - s.start)).exp();
        (
            v + rest * fall,
            s.angle + x - x0 + rest * (1.0 - fall) / rate,
        )
    }

    /// Angles at those times, from rest.
    fn angles(&self, drive: &Drive, times: &[f64]) -> Vec<f64> {
        let free = |t: f64| Self::torque(drive, t) - self.offset;
        let leaves = |t: f64| {
            let way = free(t).signum();
            if free(t).abs() > self.dry { way } else { 0.0 }
        };
        let mut now = Stretch {
            start: 0.0,
            way: leaves(0.0),
            speed: 0.0,
            angle: 0.0,
        };
        let mut before = 0.0;
        let mut angles = Vec::with_capacity(times.len());
        for t in times {
            // Small steps to detect a change of direction, halved until the moment is exact.
            while before < *t {
                let to = (before + 1e-4).min(*t);
                let over = |t: f64| match now.way {
                    0.0 => free(t).abs() > self.dry,
                    way => self.at(drive, &now, t).0 * way < 0.0,
                };
                if !over(to) {
                    before = to;
                    continue;
                }
                let (mut low, mut high) = (before, to);
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    if over(middle) {
                        high = middle;
                    } else {
                        low = middle;
                    }
                }
                let angle = self.at(drive, &now, high).1;
                now = Stretch {
                    start: high,
                    way: leaves(high),
                    speed: 0.0,
                    angle,
                };
                before = high + 1e-9;
            }
            angles.push(self.at(drive, &now, *t).1);
        }
        angles
    }
}

/// Angle and torque at 1 kHz for 4 s, with noise on the torque `decibel` below it.
fn record(decibel: f64, noise: &mut Noise) -> (Vec<f64>, Vec<f64>) {
    let drive = [
        (3.0, TAU * 0.7, TAU * noise.uniform()),
        (1.5, TAU * 1.9, TAU * noise.uniform()),
    ];
    let times = super::times(4000, 1000.0);
    let size = 10_f64.powf(-decibel / 20.0) * (0.5_f64 * (9.0 + 2.25)).sqrt();
    let torques = times
        .iter()
        .map(|t| Body::torque(&drive, *t) + size * noise.normal())
        .collect();
    (BODY.angles(&drive, &times), torques)
}

fn turning<'a>(angles: &'a [f64], torques: &'a [f64]) -> runup::FreeRun<'a> {
    runup::FreeRun {
        rate_hz: 1000.0,
        motion: angles,
        kind: Motion::Displacement,
        effort: torques,
        body: runup::Body::Turning,
    }
}

const NAMES: [&str; 4] = ["inertia", "viscous_friction", "dry_friction", "offset"];
const TRUTH: [f64; 4] = [BODY.inertia, BODY.viscous, BODY.dry, BODY.offset];

/// Coverage of each parameter over `runs` runs.
fn coverage_at(decibel: f64, seed: u64, runs: usize) -> [Coverage; 4] {
    let mut noise = Noise(seed);
    let mut covered = [0; 4].map(|_| Coverage::default());
    for _ in 0..runs {
        let (angles, torques) = record(decibel, &mut noise);
        let run = turning(&angles, &torques);
        let found = runup::identify(&run, &runup::RunupOptions::default()).unwrap();
        for ((name, truth), coverage) in NAMES.iter().zip(TRUTH).zip(&mut covered) {
            coverage.count(of(&found, name), truth);
        }
        assert_close(of(&found, "inertia").value(), BODY.inertia, 0.05);
    }
    covered
}

/// Each parameter at each noise level: at the lowest, a reversal located wrongly by a hundredth of a sample would
/// show.
#[test]
fn intervals_of_run_ups_cover_the_truth() {
    let levels = [(20.0, 15), (40.0, 16), (60.0, 17)];
    let all = std::thread::scope(|scope| {
        let one = |(decibel, seed)| scope.spawn(move || coverage_at(decibel, seed, 300));
        let handles = levels.map(one);
        handles.map(|h| h.join().expect("the runs are evaluated"))
    });
    for (covered, (decibel, _)) in all.iter().zip(levels) {
        for (coverage, name) in covered.iter().zip(NAMES) {
            coverage.check(&format!("{name} at {decibel} dB"));
        }
    }
}

#[test]
fn a_run_in_one_direction_does_not_invent_a_dry_friction() {
    let speed: Vec<f64> = (0..2000)
        .map(|i| 50.0 * (1.0 - (-1e-3 * f64::from(i)).exp()))
        .collect();
    // 2 N m = J·50 e^{−t} + f·50(1 − e^{−t}) + C with J = f = 0.03, C = 0.5.
    let torque = vec![2.0; 2000];
    let run = runup::FreeRun {
        rate_hz: 1000.0,
        motion: &speed,
        kind: Motion::Speed,
        effort: &torque,
        body: runup::Body::Turning,
    };
    let found = runup::identify(&run, &runup::RunupOptions::default());
    // Constant torque and an exponential speed satisfy θ'' + θ' = 50 throughout: only J/f is
    // identifiable.
    match found {
        Ok(found) => {
            assert!(
                found.get("dry_friction").is_none(),
                "{:?}",
                found.parameters
            );
            assert!(found.warnings.iter().any(|w| w.code == "one-direction"));
            assert!(!found.correlations.is_empty(), "{found:?}");
        }
        Err(error) => assert!(
            error.to_string().contains("not separately identifiable"),
            "{error}"
        ),
    }
}

/// An absolute encoder that begins again after each turn or two.
#[test]
fn an_angle_that_wraps_is_continued() {
    let (angles, torques) = record(40.0, &mut Noise(41));
    let options = runup::RunupOptions::default();
    let whole = runup::identify(&turning(&angles, &torques), &options).unwrap();
    let found = |wrap: f64| {
        let wrapped: Vec<f64> = angles.iter().map(|angle| angle.rem_euclid(wrap)).collect();
        runup::identify(&turning(&wrapped, &torques), &options)
    };
    for turns in [1.0, 2.0] {
        let found = found(turns * TAU).unwrap();
        for name in NAMES {
            let (own, other) = (of(&found, name).value(), of(&whole, name).value());
            assert!((own / other - 1.0).abs() < 1e-6, "{name}: {own} {other}");
        }
        assert!(found.method.iter().any(|line| line.contains("wraps")));
        assert!(found.warnings.iter().all(|w| w.code != "poor-fit"));
    }
    // A single jump of another size is asked about.
    let jumped = |(i, angle): (usize, &f64)| if i > 2000 { angle - 20.0 } else { *angle };
    let jumped: Vec<f64> = angles.iter().enumerate().map(jumped).collect();
    let refused = runup::identify(&turning(&jumped, &torques), &options);
    let refused = refused.unwrap_err().to_string();
    assert!(refused.contains("wraps and cannot be made"), "{refused}");
}

/// A counter that begins again after 8.192 turns, half a turn, or 10 rad; its speed is ten turns per second.
#[test]
fn an_angle_that_wraps_at_any_constant_span_is_continued() {
    let (angles, torques) = record(40.0, &mut Noise(41));
    let turned = |(i, angle): (usize, &f64)| angle + 10.0 * TAU * i as f64 / 1000.0;
    let turned: Vec<f64> = angles.iter().enumerate().map(turned).collect();
    let options = runup::RunupOptions::default();
    let inertia = |angles: &[f64]| {
        let found = runup::identify(&turning(angles, &torques), &options).unwrap();
        (of(&found, "inertia").value(), found)
    };
    let (whole, _) = inertia(&turned);
    for span in [8.192 * TAU, 0.5 * TAU, 10.0] {
        let wrapped: Vec<f64> = turned.iter().map(|angle| angle.rem_euclid(span)).collect();
        let (own, found) = inertia(&wrapped);
        assert!((own / whole - 1.0).abs() < 1e-4, "{span}: {own} {whole}");
        assert!(found.method.iter().any(|line| line.contains("wraps")));
    }
}

/// 8 s of an arm with viscous friction and a torque of gravity, by small steps: angle, speed and torque at 500 Hz.
fn arm([sine, cosine]: [f64; 2], noise: &mut Noise) -> [Vec<f64>; 3] {
    let drive = |t: f64| 2.2 * (2.5 * t).sin() + 0.8 * (6.9 * t + 0.3).sin();
    let (mut angle, mut speed) = (0.0_f64, 0.0_f64);
    let step_s = 1e-5;
    let mut record = [Vec::new(), Vec::new(), Vec::new()];
    for k in 0..800_000 {
        let t = f64::from(k) * step_s;
        if k % 200 == 0 {
            record[0].push(angle + 1e-4 * noise.normal());
            record[1].push(speed + 1e-2 * noise.normal());
            record[2].push(drive(t) + 0.02 * noise.normal());
        }
        let load = |angle: f64, speed: f64, t: f64| {
            (drive(t) - 0.3 * speed - sine * angle.sin() - cosine * angle.cos()) / 0.05
        };
        let half = speed + 0.5 * step_s * load(angle, speed, t);
        let middle = angle + 0.5 * step_s * speed;
        speed += step_s * load(middle, half, t + 0.5 * step_s);
        angle += step_s * half;
    }
    record
}

#[test]
fn gravity_on_an_arm_does_not_bias_its_inertia() {
    let mut noise = Noise(18);
    for gravity in [[0.4, 0.0], [0.1, 0.05], [0.0, 0.0], [0.0, 0.0]] {
        let [angles, speeds, torques] = arm(gravity, &mut noise);
        for (kind, motion) in [(Motion::Displacement, &angles), (Motion::Speed, &speeds)] {
            let run = runup::FreeRun {
                rate_hz: 500.0,
                kind,
                ..turning(motion, &torques)
            };
            let found = runup::identify(&run, &runup::RunupOptions::default()).unwrap();
            let within = |name: &str, truth: f64, most: f64| {
                let own = of(&found, name);
                let std = own.std().unwrap();
                let is_right = (own.value() - truth).abs() < 4.0 * std && std < most;
                assert!(is_right, "{gravity:?} {kind:?}: {:?}", found.parameters);
            };
            within("inertia", 0.05, 2e-3);
            let is_fitted = found.get("gravity_sine").is_some();
            assert_eq!(is_fitted, gravity != [0.0; 2], "{:?}", found.parameters);
            if is_fitted && kind == Motion::Displacement {
                within("gravity_sine", gravity[0], 0.02);
                within("gravity_cosine", gravity[1], 0.02);
            }
        }
    }
}

/// A reaction torque that rings at 180 Hz with a damping ratio of 0.015 after each change, beside a stand file.
#[test]
fn a_run_up_that_rings_elsewhere_than_the_stand_file_says_is_questioned() {
    let folder = Folder::new();
    let (rate, omega) = (5000.0, TAU * 180.0);
    let mut noise = Noise(17);
    let mut speed = 0.0;
    let mut angle = 0.0;
    let mut text = "time_s,angle_rad,torque_Nm\n".to_owned();
    for i in 0..20_000 {
        let t = f64::from(i) / rate;
        let since = t % 1.0;
        let level: f64 = if t % 2.0 < 1.0 { 1.0 } else { -0.9 };
        let change = if t < 1.0 { 1.0 } else { 1.9 * level.signum() };
        let rings = change * (-0.015 * omega * since).exp() * (omega * since).cos();
        text += &format!(
            "{t:.5},{angle:.7},{:.6}\n",
            level - rings + 2e-3 * noise.normal()
        );
        speed += (level - 0.01 * speed) / 0.01 / rate;
        angle += speed / rate;
    }
    folder.write("in.csv", text);
    let command = "identify runup in.csv --motion angle --torque torque --stand stand.toml --json";
    for (frequency, ratio, code) in [
        (170, 0.015, Some("resonance-elsewhere")),
        (180, 0.1, Some("damping-differs")),
        (180, 0.015, None),
    ] {
        let mechanics =
            format!("natural_frequency = \"{frequency} Hz\"\ndamping_ratio = {ratio}\n");
        let stand = format!("schema = \"torqcomp.stand/1\"\n[mechanics]\n{mechanics}");
        folder.write("stand.toml", stand);
        let report = folder.json(&command.split(' ').collect::<Vec<_>>());
        let said = ["resonance-elsewhere", "damping-differs"].into_iter();
        let mut said = said.filter(|code| codes(&report).contains(code));
        assert_eq!(said.next(), code, "{report}");
    }
}

/// Units of a speed that can be read in two ways are asked about.
#[test]
fn units_of_speeds_are_read_or_asked() {
    let folder = Folder::new();
    let per_turn = TAU / 60.0;
    for (heading, size, says) in [
        ("n [krpm]", 1e3 * per_turn, None),
        ("n_krpm", 1e3 * per_turn, None),
        ("n [gon/s]", TAU / 400.0, None),
        ("n [rpm x1000]", 1e3 * per_turn, Some("krpm")),
        ("n [1/s]", TAU, Some("rev/s")),
    ] {
        let row = |i: i32| {
            let t = f64::from(i) / 1000.0;
            let up = if t < 2.0 { 1.0 } else { -1.0 };
            let speed = if t < 2.0 { 10.0 * t } else { 40.0 - 10.0 * t };
            format!(
                "{t:.4},{:.9},{}\n",
                speed / size,
                0.1 * up + 1e-3 * (1.7 * f64::from(i)).sin()
            )
        };
        let rows: String = (0..4000).map(row).collect();
        folder.write("in.csv", format!("time_s,{heading},torque_Nm\n{rows}"));
        let command = "identify runup in.csv --motion n --torque torque --json";
        let command: Vec<&str> = command.split(' ').collect();
        if let Some(says) = says {
            folder.run(&command).says(1, &[says]);
            continue;
        }
        let report = folder.json(&command);
        let (inertia, _, _) = super::parameter(&report, "inertia");
        assert_close(inertia, 0.01, 1e-3);
    }
}
