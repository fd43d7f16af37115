//! `identify` through the binary, and its estimators on simulated records. The records are made here,
//! from closed forms or by small steps, independent of the estimators.

mod beginnings;
mod decay;
mod dry_friction;
mod files;
mod hum;
mod late_channels;
mod reach;
mod response;
mod runup;
mod short_hits;
mod spins;
mod static_load;
mod transients;
mod traps;
mod trials;

use serde_json::Value;
use torqcomp::identify::decay::{self as estimator, Ringing};
use torqcomp::identify::{Identification, NamedEstimate};

use crate::noise::Noise;

const TAU: f64 = std::f64::consts::TAU;

fn times(count: usize, rate_hz: f64) -> Vec<f64> {
    (0..count).map(|i| i as f64 / rate_hz).collect()
}

/// Motion of a stand of unit static gain after a time of a torque that grows by one per s, in closed form.
fn ramped(hz: f64, ratio: f64, t: f64) -> f64 {
    let omega = TAU * hz;
    let damped = omega * (1.0 - ratio * ratio).sqrt();
    if t <= 0.0 {
        return 0.0;
    }
    let swing = 2.0 * ratio / omega * (damped * t).cos()
        + (2.0 * ratio * ratio - 1.0) / damped * (damped * t).sin();
    t - 2.0 * ratio / omega + (-ratio * omega * t).exp() * swing
}

/// What a decay gives on its own.
fn of_decay(record: &[f64], rate_hz: f64) -> Identification {
    let ringing = Ringing {
        name: "simulated",
        times_s: &times(record.len(), rate_hz),
        rate_hz: Some(rate_hz),
        values: record,
    };
    let found = estimator::identify(&[ringing], &estimator::DecayOptions::default());
    found.unwrap().0
}

fn of<'a>(result: &'a Identification, name: &str) -> &'a NamedEstimate {
    result
        .get(name)
        .unwrap_or_else(|| panic!("{name} in {:?}", result.parameters))
}

/// Fraction of true values within 1.96 standard uncertainties.
#[derive(Default)]
struct Coverage {
    inside: usize,
    all: usize,
}

impl Coverage {
    fn count(&mut self, found: &NamedEstimate, truth: f64) {
        let std = found
            .std()
            .unwrap_or_else(|| panic!("{} has no uncertainty", found.name));
        self.inside += usize::from((found.value() - truth).abs() <= 1.96 * std);
        self.all += 1;
    }

    /// For few values, of which all may be inside.
    fn at_least(&self, least: usize, what: &str) {
        let Self { inside, all } = self;
        println!("{what}: {inside} of {all}");
        assert!(*inside >= least, "{what}: {inside} of {all}");
    }

    fn check(&self, what: &str) {
        let share = self.inside as f64 / self.all as f64;
        println!("{what}: {} of {}", self.inside, self.all);
        assert!(
            (0.92..=0.98).contains(&share),
            "{what}: {} of {}: {share}",
            self.inside,
            self.all
        );
    }
}

fn parameter(report: &Value, name: &str) -> (f64, Option<f64>, String) {
    let all = report["parameters"].as_array().expect("parameters");
    let found = all
        .iter()
        .find(|p| p["name"] == name)
        .unwrap_or_else(|| panic!("{name} in {all:?}"));
    let unit = found["unit"].as_str().expect("a unit").to_owned();
    (
        found["value"].as_f64().expect("a value"),
        found["std"].as_f64(),
        unit,
    )
}
