//! Steady-state response to a periodic input.

use std::fmt;

use super::pieces::{FINE, MOST_SUBSTEPS};
use super::run::MotionProgress;
use super::{Between, Excitation, MotionState, substeps};
use crate::chain::Chain;

/// Maximum number of repetitions until the motion has settled.
const MOST_REPETITIONS: usize = 2000;
/// Relative change between repetitions that counts as rounding.
const ROUNDING: f64 = 1e-12;
/// Consecutive repetitions that must have settled, as a beat comes close to itself once in a while.
const SETTLED: usize = 3;
/// Repetitions of the settled motion that the links after the stand see; the last is the record.
const SEEN: usize = 3;

/// Reason why a periodic input has no steady-state response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoSteadyAnswer {
    /// The motion diverges.
    Diverges,
    /// The motion is not periodic with the input.
    Wanders,
    /// A link after the stand depends on the time since the record began.
    Drifts,
}

impl fmt::Display for NoSteadyAnswer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Diverges => f.write_str(
                "the simulated motion diverges: with these effects the stand is unstable for this input",
            ),
            Self::Wanders => write!(
                f,
                "no steady state after {MOST_REPETITIONS} repetitions of the input: the motion decays too slowly for \
                 so short a period, or repeats with a different one; simulate several periods at once"
            ),
            Self::Drifts => f.write_str(
                "the stand has an effect that changes with time, such as a drift: there is no steady state",
            ),
        }
    }
}

impl std::error::Error for NoSteadyAnswer {}

/// Steady-state record of a stand over one repetition of its input (one period or a whole number of them), and the
/// integration steps per sample.
///
/// The motion is integrated until its remaining change, extrapolated as a geometric series, is below 1e-5 of its RMS,
/// and the integration step is halved until that changes the record by less than 1e-5.
///
/// # Errors
/// If there is no steady-state response.
///
/// ```
/// use std::f64::consts::TAU;
/// use torqcomp_model::simulate::{Between, steady_answer};
/// use torqcomp_model::{Chain, Mode};
/// // A sine at ω₀ comes out a quarter of a turn late and 1/(2ζ) = 5 times as large.
/// let mode = Mode { omega_rad_s: TAU * 10.0, damping_ratio: 0.1 };
/// let sine: Vec<f64> = (0..50).map(|i| (TAU * 10.0 * i as f64 / 500.0).sin()).collect();
/// let (record, _) = steady_answer(&Chain::new(mode, 1.0), sine, 500.0, Between::BandLimited)?;
/// assert!((record[0] + 5.0).abs() < 1e-3 && (record[25] - 5.0).abs() < 1e-3);
/// # Ok::<(), torqcomp_model::simulate::NoSteadyAnswer>(())
/// ```
pub fn steady_answer(
    chain: &Chain,
    samples: Vec<f64>,
    rate_hz: f64,
    between: Between,
) -> Result<(Vec<f64>, usize), NoSteadyAnswer> {
    let mut steps = substeps(chain.stand.highest_hz(), rate_hz);
    let input = Excitation::periodic(samples, rate_hz, 0.0, steps).with_between(between);
    let parts = chain.parts_of_sample(steps);
    let [x, speed] = chain.state_at_start(&input);
    let mut progress = chain.begin(MotionState { x, speed });
    let mut last = settle(chain, input.finer(parts), &mut progress)?;
    let shown = loop {
        steps *= 2;
        let input = input.with_substeps(steps);
        let finer = settle(chain, input.finer(parts), &mut progress)?;
        if change(&finer, &last) <= FINE * rms(&finer) || steps >= MOST_SUBSTEPS {
            break finer;
        }
        last = finer;
    };
    let record = recorded(chain, input.finer(parts), &shown)?;
    Ok((record.into_iter().step_by(parts).collect(), steps))
}

/// Gage signal of the settled motion over one repetition; `progress` is the state at its end.
fn settle(
    chain: &Chain,
    input: &Excitation,
    progress: &mut MotionProgress,
) -> Result<Vec<f64>, NoSteadyAnswer> {
    let count = input.samples().len();
    let mut next = || {
        let shown = chain.integrated_over(input, 0..count, progress);
        let size = rms(&shown);
        size.is_finite()
            .then_some((shown, size))
            .ok_or(NoSteadyAnswer::Diverges)
    };
    let (mut last, _) = next()?;
    let (mut before, mut settled) = (f64::INFINITY, 0);
    for _ in 1..MOST_REPETITIONS {
        let (shown, size) = next()?;
        let now = change(&shown, &last);
        // The remaining change, as a geometric series.
        let to_come = now * now / (before - now);
        let is_settled = now < before && to_come <= FINE * size || now <= ROUNDING * size;
        settled = if is_settled { settled + 1 } else { 0 };
        if settled == SETTLED {
            return Ok(shown);
        }
        (last, before) = (shown, now);
    }
    Err(NoSteadyAnswer::Wanders)
}

/// The settled motion passed through the links after the stand.
fn recorded(chain: &Chain, input: &Excitation, shown: &[f64]) -> Result<Vec<f64>, NoSteadyAnswer> {
    let applied = input.samples().repeat(SEEN);
    let applied = Excitation::periodic(applied, input.rate_hz(), 0.0, 1);
    let applied = applied.with_between(input.between());
    let record = chain.recorded_if_finite(shown.repeat(SEEN), (&applied, 1));
    let (earlier, steady) = record.split_at(shown.len() * (SEEN - 1));
    let before = &earlier[earlier.len() - shown.len()..];
    match change(steady, before) <= FINE * rms(steady) {
        true => Ok(steady.to_vec()),
        false => Err(NoSteadyAnswer::Drifts),
    }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

fn change(a: &[f64], b: &[f64]) -> f64 {
    let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    rms(&difference)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::chain::Link;
    use crate::effects::{Effect, Mode};
    use crate::simulate::tests::{MODE, RATE_HZ, chain};

    /// Odd, and not a product of small primes.
    const PERIOD: usize = 1997;
    fn period() -> Vec<f64> {
        let turn = |i: usize, k: f64| TAU * k * i as f64 / PERIOD as f64;
        let tones = |i| turn(i, 8.0).sin() + 0.8 * turn(i, 31.0).cos() + 0.7 * turn(i, 62.0).sin();
        (0..PERIOD).map(tones).collect()
    }

    /// Against the last of twenty periods that start at rest.
    #[test]
    fn it_is_where_a_long_record_ends() {
        let cases: [&[(&str, &str, &[f64])]; 5] = [
            &[],
            &[("bouc-wen-hysteresis", "linear", &[0.4, 0.5, 0.2])],
            &[
                ("coulomb-friction", "sharp", &[0.3]),
                ("time-delay", "lag", &[1.3e-4]),
            ],
            &[("backlash", "recorded", &[0.1])],
            &[
                ("cubic-stiffness", "beside", &[0.05]),
                ("recorder-lowpass", "order-2", &[900.0]),
            ],
        ];
        for case in cases {
            let chain = chain(case);
            let (steady, steps) =
                steady_answer(&chain, period(), RATE_HZ, Between::BandLimited).unwrap();
            let long = Excitation::new(period().repeat(20), RATE_HZ, 0.0, steps);
            let long = chain.simulate_from(&long, MotionState::default());
            // The end of the long record is the beginning of the same period again.
            let place = 18 * PERIOD;
            let error = change(&steady, &long[place..place + PERIOD]) / rms(&steady);
            println!("{case:?}: {error:e}");
            assert!(error < 3e-5, "{case:?}: {error:e}");
        }
    }

    #[test]
    fn what_never_repeats_is_told() {
        let found = |chain: &Chain| {
            steady_answer(chain, period(), RATE_HZ, Between::BandLimited).map(|_| ())
        };
        let drift = chain(&[("thermal-drift", "linear", &[3.0])]);
        assert_eq!(found(&drift), Err(NoSteadyAnswer::Drifts));
        let unstable = chain(&[("cubic-stiffness", "beside", &[-1.0])]);
        assert_eq!(found(&unstable), Err(NoSteadyAnswer::Diverges));
        let undamped = Mode {
            damping_ratio: 1e-9,
            ..MODE
        };
        let undamped = Chain::new(undamped, 1.0).with_links([Link::of(
            Effect::named("cubic-stiffness").unwrap(),
            &Effect::named("cubic-stiffness").unwrap().forms[0],
            &[0.05],
        )]);
        assert_eq!(found(&undamped), Err(NoSteadyAnswer::Wanders));
    }
}
