//! Time stamps of the arrival of samples instead of sampling instants, detected from the decay itself.

use torqcomp_dsp::dot;

use crate::failure::Failure;
use crate::identify::Identification;
use crate::print::rounded;
use crate::warning::{Warning, WarningCode};

/// Ratio of the residual of a decay at uniform times to that at its time stamps, up to which sampling was uniform.
const CLEARLY_LESS: f64 = 0.95;

/// The uniform times about which time stamps scatter.
pub(super) struct EvenTimes {
    pub times_s: Vec<f64>,
    pub rate_hz: f64,
    /// Its standard uncertainty from the scatter.
    pub rate_std_hz: f64,
}

impl EvenTimes {
    /// Least-squares straight line through the time stamps over the sample number:
    /// `T = Σ (i − ī) t_i / Σ (i − ī)²`, `u(T) = s / √(Σ (i − ī)²)`; `None` for fewer than three stamps or no rise.
    pub fn of(stamps_s: &[f64]) -> Option<Self> {
        let count = stamps_s.len() as f64;
        let middle = 0.5 * (count - 1.0);
        let from_middle: Vec<f64> = (0..stamps_s.len()).map(|i| i as f64 - middle).collect();
        let spread = dot(&from_middle, &from_middle);
        let step_s = dot(&from_middle, stamps_s) / spread;
        let mean_s = stamps_s.iter().sum::<f64>() / count;
        let times_s: Vec<f64> = from_middle.iter().map(|i| mean_s + step_s * i).collect();
        let apart: Vec<f64> = stamps_s.iter().zip(&times_s).map(|(a, b)| a - b).collect();
        let step_std_s = (dot(&apart, &apart) / (count - 2.0) / spread).sqrt();
        (count > 2.0 && step_s > 0.0).then(|| Self {
            times_s,
            rate_hz: 1.0 / step_s,
            rate_std_hz: step_std_s / step_s.powi(2),
        })
    }
}

/// Whether the residual of a decay is clearly smaller at uniform times than at its time stamps.
pub(super) fn are_arrivals(
    at_stamps: &Result<Identification, Failure>,
    at_even: &Identification,
) -> bool {
    let Ok(at_stamps) = at_stamps else {
        return true;
    };
    let fits = at_stamps.fit.as_ref().zip(at_even.fit.as_ref());
    fits.is_some_and(|(stamps, even)| even.rms < CLEARLY_LESS * stamps.rms)
}

/// Note on samples taken at uniform times.
pub(super) fn warning(at_stamps: &Result<Identification, Failure>, rate_hz: f64) -> Warning {
    let left = at_stamps.as_ref().ok().and_then(|found| found.fit.as_ref());
    let left = match left {
        Some(fit) => format!(
            "with them the residual is {} % of the decay",
            rounded(100.0 * fit.relative, 3)
        ),
        None => "no decay is found with them".to_owned(),
    };
    WarningCode::StampsOfArrival.warning(format!(
        "the time stamps jitter: {left}, and equal steps of {} Hz fit clearly better. They are arrival times, so \
         equal steps were used; give the recorder's rate with --rate HZ",
        rounded(rate_hz, 7)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: the line through 0, 1.5, 2 and 3.5 has slope 1.1, mean 1.75 and residuals ∓0.1, ±0.3.
    #[test]
    fn a_line_through_four_stamps() {
        let even = EvenTimes::of(&[0.0, 1.5, 2.0, 3.5]).unwrap();
        assert!((even.rate_hz - 1.0 / 1.1).abs() < 1e-12);
        assert!((even.times_s[0] - 0.1).abs() < 1e-12);
        let step_std = (0.2_f64 / 2.0 / 5.0).sqrt();
        assert!((even.rate_std_hz - step_std / 1.21).abs() < 1e-12);
        assert!(EvenTimes::of(&[0.0, 1.0]).is_none());
    }
}
