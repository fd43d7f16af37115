//! Responses to excitations that do not reach the resonance, and hammers recorded in volts.

use super::{Noise, TAU, parameter};
use crate::util::{Folder, Ran, assert_close, codes};

const RATE_HZ: f64 = 10_000.0;
const COUNT: usize = 30_000;
const LONG: usize = 80_000;

/// The response of modes (Hz, damping ratio, V/(N m)) to a torque, by the recursion of their free motion.
fn shown(torque: &[f64], modes: &[(f64, f64, f64)]) -> Vec<f64> {
    let mut sum = vec![0.0; torque.len()];
    for (hz, ratio, gain) in modes {
        let omega = TAU * hz / RATE_HZ;
        let decay = (-ratio * omega).exp();
        let cos = (omega * (1.0 - ratio * ratio).sqrt()).cos();
        let (a, b) = (2.0 * decay * cos, -decay * decay);
        let (mut y, mut before) = ([0.0; 2], 0.0);
        for (to, now) in sum.iter_mut().zip(torque) {
            let next = 0.5 * (1.0 - a - b) * gain * (now + before) + a * y[0] + b * y[1];
            (y, before) = ([next, y[0]], *now);
            *to += next;
        }
    }
    sum
}

/// Three hits of `sin²` shape.
fn hits(width_s: f64) -> Vec<f64> {
    let hit = |t: f64, (at, size): (f64, f64)| match (t - at) / width_s {
        part if (0.0..1.0).contains(&part) => size * (TAU * 0.5 * part).sin().powi(2),
        _ => 0.0,
    };
    let all = [(0.1, 40.0), (1.1, 25.0), (2.1, 33.0)];
    let one = |i: usize| all.iter().map(|of| hit(i as f64 / RATE_HZ, *of)).sum();
    (0..COUNT).map(one).collect()
}

/// Steps of 10 N m, rounded over 50 ms, once a second.
fn smooth_steps() -> Vec<f64> {
    let level = |t: f64| {
        let risen = (t % 1.0 / 0.05).min(1.0);
        let part = 0.5 - 0.5 * (0.5 * TAU * risen).cos();
        let up = (t as usize).is_multiple_of(2);
        10.0 * if up { part } else { 1.0 - part }
    };
    (0..LONG).map(|i| level(i as f64 / RATE_HZ)).collect()
}

/// `identify response -o` of a torque with noise, and of what the bridge shows.
fn identified(
    heading: &str,
    torque: &[f64],
    modes: &[(f64, f64, f64)],
    more: &[&str],
) -> (Folder, Ran) {
    let mut noise = Noise(71);
    let bridge = shown(torque, modes);
    let largest = torque.iter().fold(0.0_f64, |m, t| m.max(t.abs()));
    let row = |i: usize| {
        let at = i as f64 / RATE_HZ;
        let [applied, measured] = [torque[i] + 5e-4 * largest * noise.normal(), bridge[i]];
        format!(
            "{at:.4},{applied:.6},{:.7}\n",
            measured + 2e-4 * noise.normal()
        )
    };
    let rows: String = (0..torque.len()).map(row).collect();
    let folder = Folder::new();
    folder.write("in.csv", format!("time_s,{heading},bridge [V]\n{rows}"));
    let args = "identify response in.csv --applied 1 --measured bridge -o new.toml --json";
    let args: Vec<&str> = args.split(' ').collect();
    let ran = folder.run(&[&args[..], more].concat());
    (folder, ran)
}

/// Pulses of 20 ms and steps of 50 ms show the static response of a stand of 412 Hz, and those of 8 ms its ringing, but no
/// excitation at it.
#[test]
fn a_resonance_beyond_the_excitation_is_not_made_up() {
    let stand = [(412.0, 0.012, 0.08)];
    let excitations = [hits(0.02), hits(0.008), smooth_steps()];
    for (kind, torque) in excitations.iter().enumerate() {
        for more in [&[][..], &["--modes", "1"], &["--modes", "2"]] {
            let (folder, ran) = identified("torque [N m]", torque, &stand, more);
            assert_eq!(ran.code, 1, "{kind} {more:?}: {}{}", ran.stdout, ran.stderr);
            let said = [
                "shows no resonance up to",
                "identify decay",
                "identify static",
            ];
            let is_said = said.iter().all(|part| ran.stdout.contains(part));
            assert!(is_said, "{kind} {more:?}: {}", ran.stdout);
            assert!(!folder.names().contains(&"new.toml".to_owned()));
        }
    }
}

/// Up to 1.3 times the highest line a resonance follows from its lines; a second one beyond that is left out.
#[test]
fn a_resonance_that_the_excitation_reaches_is_found() {
    for (hz, ratio, width_s) in [
        (412.0, 0.012, 0.005),
        (412.0, 0.012, 0.002),
        (90.0, 0.05, 0.02),
        (800.0, 0.004, 0.002),
    ] {
        for second in [0.0, 0.01] {
            let modes = [(hz, ratio, 0.08), (2.6 * hz, ratio, second)];
            let (folder, ran) = identified("torque [N m]", &hits(width_s), &modes, &[]);
            let report: serde_json::Value = serde_json::from_str(&ran.stdout).expect("JSON");
            let names = ["natural_frequency", "mode_1_natural_frequency"];
            let all = report["parameters"].as_array().expect("parameters");
            let first = names
                .iter()
                .find(|name| all.iter().any(|p| p["name"] == **name));
            let first = first.unwrap_or_else(|| panic!("{hz} {width_s} {second}: {report}"));
            assert_close(parameter(&report, first).0, hz, 0.01);
            let written = folder.read("new.toml");
            assert!(written.contains("damping_ratio"), "{written}");
        }
    }
}

/// A hammer of 2.25 mV/N at 0.25 m.
#[test]
fn a_hammer_in_volts_is_scaled_by_its_factor() {
    let torque = hits(0.002);
    let volts: Vec<f64> = torque.iter().map(|t| t / 0.25 * 2.25e-3).collect();
    let stand = [(412.0, 0.012, 0.08 * 0.25 / 2.25e-3)];
    let radius = ["--radius", "0.25 m"];
    let (_, refused) = identified("hammer [V]", &volts, &stand, &radius);
    assert_eq!(refused.code, 2, "{}", refused.stdout);
    assert!(
        refused.stdout.contains("--torque-factor"),
        "{}",
        refused.stdout
    );
    let factor = ["--torque-factor", "444.444 N/V", "--radius", "0.25 m"];
    let (_, ran) = identified("hammer [V]", &volts, &stand, &factor);
    let report: serde_json::Value = serde_json::from_str(&ran.stdout).expect("JSON");
    assert!(!codes(&report).contains(&"channels-shifted"), "{report}");
    assert_close(parameter(&report, "torque_per_volt").0, 12.5, 0.02);
    let of_frequency = ["--torque-factor", "444.444 Hz/V"];
    let (_, wrong) = identified("hammer [V]", &volts, &stand, &of_frequency);
    assert_eq!(wrong.code, 2, "{}", wrong.stdout);
}
