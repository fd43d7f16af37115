//! Mains hum beside decays that follow each other.

use super::{Noise, TAU, parameter};
use crate::util::Folder;

/// `identify decay -o` of taps at 0.2 s and so on, with hum of a part of the peak.
fn tapped(
    (hz, ratio): (f64, f64),
    (mains_hz, part): (f64, f64),
    taps_s: &[f64],
    (length_s, rate_hz, seed): (f64, f64, u64),
) -> (serde_json::Value, String) {
    let mut noise = Noise(seed);
    let omega = TAU * hz;
    let sample = |i: usize| {
        let t = i as f64 / rate_hz;
        let after = taps_s
            .iter()
            .map(|tap| t - tap)
            .filter(|after| *after >= 0.0);
        let ring = |after: f64| {
            0.6 * (-ratio * omega * after).exp()
                * (omega * (1.0 - ratio * ratio).sqrt() * after).sin()
        };
        let hum = 0.6 * part * (TAU * mains_hz * t + 0.4).sin();
        let volts: f64 = after.map(ring).sum::<f64>() + hum + 5e-4 * noise.normal();
        format!("{t:.6},{volts:.5}\n")
    };
    let rows: String = (0..(length_s * rate_hz) as usize).map(sample).collect();
    let folder = Folder::new();
    folder.write("tap.csv", format!("time_s,bridge [V]\n{rows}"));
    let args = "identify decay tap.csv -o new.toml --json";
    let report = folder.json(&args.split(' ').collect::<Vec<_>>());
    (report, folder.read("new.toml"))
}

#[test]
fn hum_beside_several_decays_is_no_mode() {
    for (stand, hum, taps, record) in [
        (
            (187.3, 0.018),
            (50.0, 0.0067),
            &[0.2, 0.9][..],
            (1.5, 20_000.0, 3),
        ),
        (
            (187.3, 0.018),
            (49.97, 0.03),
            &[0.2, 0.9],
            (1.5, 20_000.0, 4),
        ),
        (
            (143.0, 0.012),
            (60.0, 0.01),
            &[0.05, 0.55],
            (1.0, 5000.0, 5),
        ),
        (
            (388.0, 0.006),
            (60.0, 0.01),
            &[0.05, 0.55],
            (1.0, 10_000.0, 6),
        ),
        (
            (312.0, 0.01),
            (50.0, 0.02),
            &[0.1, 0.6, 1.1],
            (1.6, 10_000.0, 7),
        ),
        (
            (312.0, 0.01),
            (50.0, 0.0067),
            &[0.1, 0.6, 1.1],
            (1.6, 8000.0, 9),
        ),
        (
            (388.0, 0.006),
            (50.0, 0.0067),
            &[0.05, 0.55],
            (1.0, 8000.0, 10),
        ),
        ((187.3, 0.018), (50.0, 0.0067), &[0.2], (1.5, 20_000.0, 8)),
    ] {
        let (report, written) = tapped(stand, hum, taps, record);
        let (hz, std, _) = parameter(&report, "natural_frequency");
        let off = (hz - stand.0).abs();
        assert!(
            off < 5.0 * std.expect("a std") + 1e-4 * hz,
            "{stand:?} {hum:?}: {report}"
        );
        assert!(
            !written.contains("[[modes]]"),
            "{stand:?} {hum:?}: {written}"
        );
    }
}
