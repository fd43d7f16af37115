//! The stated uncertainty of a torque at a resonance whose frequency is uncertain.

use crate::noise::Noise;
use crate::util::{Folder, number, sampled};

/// At the resonance the torque is least where the declared frequency is right: to first order it does not depend on it.
#[test]
fn an_uncertain_resonance_makes_the_torque_there_uncertain() {
    let folder = Folder::new();
    folder.write(
        "stand.toml",
        "schema = \"torqcomp.stand/1\"\n[mechanics]\n\
         natural_frequency = { value = \"180 Hz\", std = \"4 Hz\" }\n\
         damping_ratio = { value = \"0.015\", std = \"0.001\" }\n",
    );
    let mut noise = Noise(43);
    let (mut squares, mut stated) = (0.0, 0.0);
    for _ in 0..12 {
        let natural_hz = 180.0 + 4.0 * noise.normal();
        let ratio = 180.0 / natural_hz;
        let gain = 1.0 / (1.0 - ratio * ratio).hypot(0.03 * ratio);
        let wave = |i: usize| {
            let turn = std::f64::consts::TAU * i as f64 / 2000.0;
            1.0 + 0.1 * gain * (180.0 * turn).cos()
        };
        folder.write("in.csv", sampled("torque_Nm", 2000.0, 3000, wave));
        let args = [
            "harmonics",
            "in.csv",
            "--stand",
            "stand.toml",
            "--fundamental",
            "20",
        ];
        let report = folder.json(&[&args[..], &["--orders", "9", "--json"]].concat());
        let component = &report["components"][0];
        squares += (number(&component["torque"]) - 0.1).powi(2);
        let std = component["std_stand"].as_f64();
        stated += std.or(component["std_response"].as_f64()).unwrap().powi(2);
    }
    // 30 times with the first order alone. Twelve runs of a lopsided error.
    let ratio = f64::sqrt(squares / stated);
    assert!(ratio < 2.0, "{ratio}");
}
