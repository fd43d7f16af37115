//! `harmonics` on records with a line beside an order that is no order.

use crate::noise::Noise;
use crate::util::{Folder, HARMONICS, codes, number, record, steady};

/// Orders 1 and 2 of a shaft at 23 Hz and a line of 0.2 N m near order 3, for 4 s.
fn beside_third(line_hz: f64, noise: &mut Noise) -> String {
    let parts = [
        (1.0, 0.0, 0.0),
        (0.3, 23.0, 6.0 * noise.uniform()),
        (0.1, 46.0, 6.0 * noise.uniform()),
        (0.2, line_hz, 6.0 * noise.uniform()),
    ];
    let (shown, _) = steady(&parts, 2000.0, 8000);
    let shown: Vec<f64> = shown.iter().map(|x| x + 1e-3 * noise.normal()).collect();
    record(&shown, 2000.0)
}

#[test]
fn a_line_beside_an_order_is_said_and_does_not_decide_the_speed() {
    let folder = Folder::new();
    let mut noise = Noise(41);
    for line_hz in [68.8, 69.15, 68.5] {
        folder.write("in.csv", beside_third(line_hz, &mut noise));
        let json = |more: &[&str]| {
            let args = [&HARMONICS[..], more, &["--json"]].concat();
            folder.json(&args)
        };
        let report = json(&["23", "--orders", "1-4"]);
        let told = codes(&report);
        assert!(told.contains(&"line-beside-order"), "{line_hz}: {report}");
        assert!(!told.contains(&"fundamental-off"), "{line_hz}: {report}");
        for given in ["23", "23.04"] {
            let refined = json(&[given, "--orders", "1-4", "--refine"]);
            let found = number(&refined["fundamental_hz"]);
            assert!((found - 23.0).abs() < 1e-3, "{line_hz}: {refined}");
            let first = number(&refined["components"][0]["torque"]);
            assert!((first - 0.3).abs() < 2e-3, "{line_hz}: {refined}");
        }
        // What the message advises.
        let orders = format!("1-4,{:.6}", line_hz / 23.0);
        let report = json(&["23", "--orders", &orders]);
        let components = report["components"].as_array().unwrap();
        let third = components.iter().find(|c| number(&c["order"]) == 3.0);
        assert!(number(&third.unwrap()["torque"]) < 1e-3, "{report}");
        assert!(!codes(&report).contains(&"line-beside-order"), "{report}");
    }
}

#[test]
fn orders_of_one_speed_have_no_lines_beside_them() {
    let folder = Folder::new();
    let mut noise = Noise(42);
    for trial in 0..20 {
        let speed_hz = 20.0 + 15.0 * noise.uniform();
        let (drift, sway) = (0.1 * noise.uniform(), 0.02 * noise.uniform());
        let sizes = [1, 2, 3, 5, 6].map(|order| {
            let size = 10_f64.powf(-1.5 * noise.uniform());
            (f64::from(order), size, 6.0 * noise.uniform())
        });
        let level = 10_f64.powf(-3.0 + 2.0 * noise.uniform());
        let wave = (0..6000).map(|i| {
            let t = f64::from(i) / 2000.0;
            let angle = std::f64::consts::TAU * speed_hz * t + sway * (4.0 * t).sin();
            let orders = sizes.iter().map(|(order, size, phase)| {
                size * (1.0 + drift * t) * (order * angle + phase).cos()
            });
            1.0 + orders.sum::<f64>() + level * noise.normal()
        });
        let wave: Vec<f64> = wave.collect();
        folder.write("in.csv", record(&wave, 2000.0));
        let given = format!("{speed_hz:.6}");
        let args = [given.as_str(), "--orders", "1-6", "--json"];
        let report = folder.json(&[&HARMONICS[..], &args].concat());
        let told = codes(&report);
        assert!(!told.contains(&"line-beside-order"), "{trial}: {report}");
    }
}
