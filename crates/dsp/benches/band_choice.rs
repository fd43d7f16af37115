//! Error of compensations in the band that is chosen for each record, over that of an oracle Wiener filter.
//!
//! `cargo bench -p torqcomp-dsp --bench band_choice -- [SEED]` prints each of 192 simulated cases and their summary.

mod band_cases;

use band_cases::{all, run, summary};

fn main() {
    let seed = std::env::args().skip(1).find_map(|text| text.parse().ok());
    let (mut chosen, mut rated, mut worse) = (Vec::new(), Vec::new(), 0);
    println!(
        "natural Hz  damping  rate Hz  noise  excitation  band Hz  error / oracle  2400 Hz / oracle  raw / oracle"
    );
    for case in all(seed.unwrap_or(1)) {
        let outcome = run(&case);
        println!(
            "{:10}  {:7}  {:7}  {:5}  {:10}  {:7}  {:14.2}  {:16.2}  {:12.2}",
            case.natural_hz,
            case.damping_ratio,
            case.rate_hz,
            case.noise,
            format!("{:?}", case.excitation),
            outcome.chosen_hz,
            outcome.chosen,
            outcome.rated,
            outcome.raw
        );
        worse += usize::from(outcome.chosen > outcome.raw);
        chosen.push(outcome.chosen);
        rated.push(outcome.rated);
    }
    for (name, ratios) in [("chosen band", chosen), ("2400 Hz", rated)] {
        let [median, decile, worst] = summary(ratios);
        println!(
            "{name}: median {median:.2}, 90 % below {decile:.2}, worst {worst:.1} times the oracle's error"
        );
    }
    println!("worse than the raw record: {worse}");
}
