use std::f64::consts::TAU;

use super::*;

/// Hertel's stand in ft lbf, slug and s (thesis, eq. 31), as recorded torque over torque.
fn forward(frequency_hz: f64) -> Complex64 {
    let omega = TAU * frequency_hz;
    let (inertia, damping, stiffness) = (5.85e-3, 3.07, 8.1e4);
    stiffness / Complex64::new(stiffness - inertia * omega * omega, damping * omega)
}

fn hertel(sample_rate_hz: f64, band_hz: f64) -> InverseFilter {
    let band = Band::new(sample_rate_hz, band_hz).unwrap();
    InverseFilter::design(Arc::new(|f| forward(f).inv()), band).unwrap()
}

/// Components within the band: amplitude, frequency, phase.
const COMPONENTS: [(f64, f64, f64); 6] = [
    (1.0, 60.0, 0.3),
    (0.8, 120.0, -1.0),
    (0.2, 588.3, 2.0),
    (0.3, 1111.1, 0.0),
    (0.15, 1777.7, 1.0),
    (0.1, 2399.0, -2.0),
];

/// Sum of steady sinusoids, each passed through `response` in closed form.
fn multisine(rate: f64, count: usize, response: impl Fn(f64) -> Complex64) -> Vec<f64> {
    (0..count)
        .map(|i| {
            let t = i as f64 / rate;
            let constant = 0.8 * response(0.0).re;
            let waves = COMPONENTS.iter().map(|(a, f, phase)| {
                (response(*f) * Complex64::from_polar(*a, TAU * f * t + phase)).re
            });
            constant + waves.sum::<f64>()
        })
        .collect()
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(b)
        .map(|(x, y)| (x - y).abs())
        .fold(0.0, f64::max)
}

fn stream(filter: &InverseFilter, record: &[f64], piece: usize) -> Vec<f64> {
    let mut stream = Stream::new(filter);
    let mut out = Vec::new();
    for part in record.chunks(piece) {
        stream.push(part, &mut out).unwrap();
    }
    stream.finish(&mut out);
    out
}

#[test]
fn what_the_response_made_comes_back_to_1e_9() {
    let rate = 20_000.0;
    let filter = hertel(rate, 2400.0);
    let truth = multisine(rate, 30_000, |_| Complex64::ONE);
    let recorded = multisine(rate, 30_000, forward);
    let full_scale = truth.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let inside = filter.half_length()..30_000 - filter.half_length();
    for out in [
        whole_record(&filter, &recorded).unwrap(),
        stream(&filter, &recorded, 4096),
    ] {
        let error = largest_difference(&out[inside.clone()], &truth[inside.clone()]);
        assert!(error < 1e-9 * full_scale, "{error:e} of {full_scale}");
    }
}

#[test]
fn recorder_and_delay_come_out_as_well() {
    let rate = 20_000.0;
    let recorder = crate::recorder::Recorder::new(
        1.0,
        Some(crate::recorder::LowPass {
            cutoff_hz: 3000.0,
            order: 3,
        }),
        0.33e-3,
    )
    .unwrap();
    let chain = move |f: f64| forward(f) * recorder.response(f);
    let measured = multisine(rate, 20_000, chain);
    let band = Band::new(rate, 2400.0).unwrap();
    let filter = InverseFilter::design(Arc::new(move |f| chain(f).inv()), band).unwrap();
    let truth = multisine(rate, 20_000, |_| Complex64::ONE);
    let inside = filter.half_length()..20_000 - filter.half_length();
    for out in [
        whole_record(&filter, &measured).unwrap(),
        stream(&filter, &measured, 999),
    ] {
        let error = largest_difference(&out[inside.clone()], &truth[inside.clone()]);
        assert!(error < 1e-9, "{error:e}");
    }
}

#[test]
fn stream_and_whole_record_agree_on_broadband_data() {
    let mut state = 7_u64;
    let mut uniform = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state as f64 / u64::MAX as f64 - 0.5
    };
    let record: Vec<f64> = (0..20_011).map(|_| 3.0 + uniform()).collect();
    for (rate, band) in [
        (20_000.0, 2400.0),
        (5000.0, 2000.0),
        (100_000.0, 2400.0),
        (1000.0, 480.0),
    ] {
        let filter = hertel(rate, band);
        let whole = whole_record(&filter, &record).unwrap();
        let full_scale = whole.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for piece in [1, 77, 4096, 50_000] {
            let streamed = stream(&filter, &record, piece);
            let difference = largest_difference(&streamed, &whole);
            // At the ends, too, as both extend the record in the same way.
            assert!(
                difference < 1e-9 * full_scale,
                "{rate} {band} {piece}: {difference:e}"
            );
        }
    }
}

#[test]
fn pieces_do_not_change_a_bit_of_the_stream() {
    let record = multisine(20_000.0, 12_345, forward);
    let filter = hertel(20_000.0, 2400.0);
    let once = stream(&filter, &record, record.len());
    assert_eq!(once, stream(&filter, &record, 1));
    assert_eq!(once, stream(&filter, &record, 1013));
}

#[test]
fn short_records_are_continued_alike() {
    let filter = hertel(20_000.0, 2400.0);
    for count in [
        2,
        3,
        50,
        filter.half_length(),
        filter.half_length() + 1,
        900,
    ] {
        let record: Vec<f64> = (0..count).map(|i| 1.0 + 0.01 * i as f64).collect();
        let whole = whole_record(&filter, &record).unwrap();
        let streamed = stream(&filter, &record, 7);
        assert!(
            largest_difference(&streamed, &whole) < 1e-8,
            "{count} samples"
        );
    }
    assert!(matches!(
        whole_record(&filter, &[1.0]),
        Err(Error::TooShort { .. })
    ));
}

#[test]
fn constants_are_kept_to_the_last_sample() {
    let filter = hertel(20_000.0, 2400.0);
    assert!((filter.taps().iter().sum::<f64>() - 1.0).abs() < 1e-15);
    let record = vec![123.456; 5000];
    for out in [
        whole_record(&filter, &record).unwrap(),
        stream(&filter, &record, 100),
    ] {
        for y in out {
            assert!((y / 123.456 - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn one_end_does_not_reach_the_other() {
    // Quiet at the start, ringing at the end.
    let filter = hertel(20_000.0, 2400.0);
    let record: Vec<f64> = (0..6000)
        .map(|i| {
            if i < 4000 {
                0.0
            } else {
                (f64::from(i) * 0.37).sin() * 100.0
            }
        })
        .collect();
    for out in [
        whole_record(&filter, &record).unwrap(),
        stream(&filter, &record, 512),
    ] {
        let start = out[..1000].iter().fold(0.0_f64, |m, y| m.max(y.abs()));
        assert!(start < 1e-6, "{start:e}");
    }
}

#[test]
fn taps_are_the_integral_of_the_response() {
    // The impulse response by direct summation of its Fourier integral, a slow but independent
    // method.
    let filter = hertel(20_000.0, 2400.0);
    let fine = 400_000;
    for lag in [0_usize, 1, 5, 40, 200] {
        let df = 2880.0 / f64::from(fine);
        let sum: f64 = (0..fine)
            .map(|i| {
                let f = (f64::from(i) + 0.5) * df;
                let turn = TAU * f * lag as f64 / 20_000.0;
                2.0 * (filter.response(f) * Complex64::from_polar(1.0, turn)).re * df
            })
            .sum::<f64>()
            / 20_000.0;
        let tap = filter.taps()[filter.half_length() + lag];
        assert!((tap - sum).abs() < 1e-9, "lag {lag}: {tap} {sum}");
    }
}

#[test]
fn impossible_inverses_are_refused() {
    let band = || Band::new(20_000.0, 2400.0).unwrap();
    let hole = |f: f64| 1.0 / Complex64::new(if f > 1000.0 && f < 1100.0 { 0.0 } else { 1.0 }, 0.0);
    assert!(matches!(
        InverseFilter::design(Arc::new(hole), band()),
        Err(Error::InverseNotFinite { .. })
    ));
    assert!(matches!(
        InverseFilter::design(Arc::new(|_| Complex64::new(-1.0, 0.0)), band()),
        Err(Error::NotPositive { .. })
    ));
    // An inverse with an undamped pole does not decay.
    let rings = |f: f64| Complex64::new(1.0 / (1.0 - (f / 1000.1).powi(2)), 0.0);
    assert!(matches!(
        InverseFilter::design(Arc::new(rings), Band::new(5000.0, 2400.0).unwrap()),
        Err(Error::FilterTooLong { .. })
    ));
}

#[test]
fn samples_that_are_no_numbers_are_named() {
    let filter = hertel(20_000.0, 2400.0);
    let mut record = vec![0.0; 100];
    record[42] = f64::NAN;
    let error = whole_record(&filter, &record).unwrap_err();
    assert!(matches!(error, Error::NonFinite { index: 42, .. }));
    let mut stream = Stream::new(&filter);
    let mut out = Vec::new();
    stream.push(&[0.0; 50], &mut out).unwrap();
    let error = stream.push(&record, &mut out).unwrap_err();
    assert!(matches!(error, Error::NonFinite { index: 92, .. }));
}

mod properties {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn compensation_is_linear(
            a in prop::collection::vec(-1.0..1.0_f64, 1500),
            b in prop::collection::vec(-1.0..1.0_f64, 1500),
            gain in -3.0..3.0_f64,
        ) {
            let filter = hertel(20_000.0, 2400.0);
            let mixed: Vec<f64> = a.iter().zip(&b).map(|(x, y)| x + gain * y).collect();
            let (a, b, mixed) = (
                whole_record(&filter, &a).unwrap(),
                whole_record(&filter, &b).unwrap(),
                whole_record(&filter, &mixed).unwrap(),
            );
            for ((x, y), z) in a.iter().zip(&b).zip(&mixed) {
                prop_assert!((x + gain * y - z).abs() < 1e-10);
            }
        }
    }
}
