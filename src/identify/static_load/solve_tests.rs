use super::*;

/// Henderson's equations with dense columns and the full covariance of the drift.
fn dense(model: &Mixed, [drift, zeros, sensitivities]: VarianceRatios) -> SolvedLoads {
    let count = model.readings.len();
    let covariance = DMatrix::from_fn(count, count, |i, j| {
        let same = |groups: &Groups| {
            f64::from(u8::from(
                groups.count() > 0 && groups.of_row[i] == groups.of_row[j],
            ))
        };
        let own = if i == j { model.variances[i] } else { 0.0 };
        own + drift * i.min(j) as f64
            + zeros * same(&model.series)
            + sensitivities * same(&model.mountings) * model.loads[i] * model.loads[j]
    });
    let fixed = DMatrix::from_fn(count, model.fixed.len(), |i, k| model.fixed[k][i]);
    let readings = DVector::from_column_slice(&model.readings);
    let factor = covariance.cholesky().expect("a covariance");
    let logarithm = |factor: &nalgebra::Cholesky<f64, nalgebra::Dyn>| {
        2.0 * factor.l().diagonal().iter().map(|d| d.ln()).sum::<f64>()
    };
    let equations = fixed
        .tr_mul(&factor.solve(&fixed))
        .cholesky()
        .expect("columns");
    let values = equations.solve(&fixed.tr_mul(&factor.solve(&readings)));
    let rest = &readings - &fixed * &values;
    let left = rest.dot(&factor.solve(&rest));
    let freedom = model.freedom() as f64;
    let of_left = if model.is_known {
        left
    } else {
        freedom * left.ln()
    };
    SolvedLoads {
        deviance: logarithm(&factor) + logarithm(&equations) + of_left,
        covariance: equations.inverse(),
        values,
        variance: left / freedom,
    }
}

fn noise(state: &mut u64) -> f64 {
    *state = state
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1);
    (*state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
}

/// Loops of ten rows; series and mounting of each row by its index.
fn table(series: impl Fn(usize) -> usize, position: impl Fn(usize) -> usize, known: bool) -> Mixed {
    let mut state = 3;
    let point = |i: usize| {
        let load = [0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 8.0, 6.0, 4.0, 2.0][i % 10];
        let zero = [0.02, -0.05, 0.03, 0.01][series(i) % 4];
        Point {
            load,
            reading: 3.0 + zero + 0.2 * load + 0.01 * noise(&mut state),
            std: known.then_some(0.004 + 0.001 * (i % 3) as f64),
            series: series(i),
            position: position(i),
        }
    };
    let points: Vec<Point> = (0..80).map(point).collect();
    let side = |i: usize| if i % 10 < 5 { 1.0 } else { -1.0 };
    let column: Vec<f64> = (0..80).map(side).collect();
    Mixed::of(&points, 3, 10.0, &[column])
}

#[test]
fn the_filter_agrees_with_the_dense_covariance() {
    let tables = [
        ("consecutive series", table(|i| i / 10, |i| i / 30, false)),
        ("known uncertainties", table(|i| i / 10, |i| i / 30, true)),
        ("mixed series", table(|i| i % 7, |i| i / 20 % 3, false)),
        ("one series", table(|_| 0, |_| 0, false)),
    ];
    for (name, model) in tables {
        let unit = if model.is_known { 2e-5 } else { 1.0 };
        for drift in [0.0, 1e-3, 1.0, 1e4] {
            for zeros in [0.0, 1e-2, 1e2, 1e6] {
                for sensitivities in [0.0, 0.1, 1e5] {
                    let ratios = [drift, zeros, sensitivities].map(|r| r * unit);
                    let fast = model.solve(ratios).expect("a solution");
                    let slow = dense(&model, ratios);
                    let near = |a: f64, b: f64| (a - b).abs() <= 1e-7 * b.abs();
                    let at = format!("{name}, {ratios:?}");
                    assert!((fast.deviance - slow.deviance).abs() < 1e-6, "{at}");
                    assert!(near(fast.variance, slow.variance), "{at}");
                    for k in 0..5 {
                        let std = slow.covariance[(k, k)].sqrt() * slow.variance.sqrt();
                        let apart = (fast.values[k] - slow.values[k]).abs();
                        assert!(apart < 1e-7 * std, "{at}, {k}: {apart} {std}");
                        let pair = (fast.covariance[(k, k)], slow.covariance[(k, k)]);
                        assert!(near(pair.0, pair.1), "{at}, {k}: {pair:?}");
                    }
                }
            }
        }
    }
}
