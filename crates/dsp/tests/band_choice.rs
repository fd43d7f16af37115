//! The band that is chosen for a record, against an oracle on the cases of the bench with another seed.

#[path = "../benches/band_cases/mod.rs"]
mod band_cases;

use band_cases::{TorqueCourse, all, run, summary};

#[test]
fn the_chosen_band_is_nearly_as_good_as_an_oracle() {
    let cases = all(20_261);
    assert_eq!(cases.len(), 192);
    for kind in [
        TorqueCourse::Steps,
        TorqueCourse::Multisine,
        TorqueCourse::Impulses,
    ] {
        assert_eq!(
            cases.iter().filter(|case| case.excitation == kind).count(),
            64
        );
    }
    let outcomes: Vec<_> = cases.iter().map(run).collect();
    for (case, outcome) in cases.iter().zip(&outcomes) {
        assert!(outcome.chosen_hz <= 0.35 * case.rate_hz, "{outcome:?}");
        assert!(
            outcome.chosen < outcome.raw,
            "worse than the record: {case:?} {outcome:?}"
        );
    }
    let [median, decile, worst] = summary(outcomes.iter().map(|o| o.chosen).collect());
    println!(
        "error over the oracle's: median {median:.3}, 90 % below {decile:.3}, worst {worst:.2}"
    );
    assert!(
        median <= 1.2 && decile <= 2.2 && worst <= 10.0,
        "{median} {decile} {worst}"
    );
    // The band of the thesis' stand is no default for other stands.
    assert!(summary(outcomes.iter().map(|o| o.rated).collect())[0] > 10.0);
}
