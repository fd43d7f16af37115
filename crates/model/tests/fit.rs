//! Fits against closed forms: bounds, rank, weights, uncertainties.

use nalgebra::DMatrix;
use torqcomp_model::fit::linear::solve;
use torqcomp_model::fit::{FitError, Options, Parameter, StopReason, WithJacobian, minimize};

/// A straight line 1 + 2t with alternating errors ±0.1.
fn line() -> Vec<(f64, f64)> {
    (0..20)
        .map(|i| (f64::from(i), if i % 2 == 0 { 0.1 } else { -0.1 }))
        .map(|(t, e)| (t, 1.0 + 2.0 * t + e))
        .collect()
}

fn line_residuals(data: &[(f64, f64)]) -> impl Fn(&[f64], &mut Vec<f64>) -> Result<(), FitError> {
    move |p: &[f64], out: &mut Vec<f64>| {
        out.extend(data.iter().map(|(t, y)| p[0] + p[1] * t - y));
        Ok(())
    }
}

/// Intercept, slope and their standard deviations by the textbook formulas.
fn textbook(data: &[(f64, f64)]) -> [f64; 4] {
    let n = data.len() as f64;
    let mean_t = data.iter().map(|d| d.0).sum::<f64>() / n;
    let mean_y = data.iter().map(|d| d.1).sum::<f64>() / n;
    let s_tt: f64 = data.iter().map(|d| (d.0 - mean_t).powi(2)).sum();
    let s_ty: f64 = data.iter().map(|d| (d.0 - mean_t) * (d.1 - mean_y)).sum();
    let slope = s_ty / s_tt;
    let intercept = mean_y - slope * mean_t;
    let rest: f64 = data
        .iter()
        .map(|d| (d.1 - intercept - slope * d.0).powi(2))
        .sum();
    let s2 = rest / (n - 2.0);
    [
        intercept,
        slope,
        (s2 * (1.0 / n + mean_t * mean_t / s_tt)).sqrt(),
        (s2 / s_tt).sqrt(),
    ]
}

fn close(got: f64, want: f64, relative: f64) {
    assert!(
        (got - want).abs() <= relative * want.abs(),
        "got {got}, want {want}"
    );
}

#[test]
fn a_line_has_the_textbook_values_and_uncertainties() {
    let data = line();
    let want = textbook(&data);
    let start = [Parameter::new("a", 0.0), Parameter::new("b", 0.0)];
    let fit = minimize(&line_residuals(&data), &start, &Options::default()).unwrap();
    let design = DMatrix::from_fn(20, 2, |i, j| if j == 0 { 1.0 } else { i as f64 });
    let right: Vec<f64> = data.iter().map(|d| d.1).collect();
    let linear = solve(&design, &right, None, false).unwrap();
    for i in 0..2 {
        close(fit.values[i], want[i], 1e-9);
        close(linear.values[i], want[i], 1e-12);
        close(fit.std[i].unwrap(), want[i + 2], 1e-6);
        close(linear.std[i].unwrap(), want[i + 2], 1e-12);
    }
    assert_eq!(fit.degrees_of_freedom, 18);
    let correlation = fit.correlation(0, 1).unwrap();
    // −mean(t)/√mean(t²) for t = 0 … 19: −9.5/√123.5.
    close(correlation, -9.5 / 123.5_f64.sqrt(), 1e-6);
}

#[test]
fn a_value_at_its_bound_has_no_uncertainty() {
    let data = line();
    let start = [
        Parameter::new("a", 1.0),
        Parameter::new("b", 0.5).at_most(1.5),
    ];
    let fit = minimize(&line_residuals(&data), &start, &Options::default()).unwrap();
    assert_eq!(
        (fit.values[1], fit.at_bound[1], fit.std[1]),
        (1.5, true, None)
    );
    // With the slope held, the intercept is the mean of what is left.
    let mean = data.iter().map(|(t, y)| y - 1.5 * t).sum::<f64>() / 20.0;
    close(fit.values[0], mean, 1e-9);
    assert!(fit.std[0].is_some() && fit.correlation(0, 1).is_none());
    assert!(fit.stop.converged());
}

#[test]
fn a_start_at_the_bound_can_leave_it() {
    let data = line();
    let start = [
        Parameter::new("a", 0.0).at_least(0.0),
        Parameter::new("b", 0.0).at_least(0.0),
    ];
    let fit = minimize(&line_residuals(&data), &start, &Options::default()).unwrap();
    close(fit.values[1], textbook(&data)[1], 1e-9);
    assert_eq!(fit.at_bound, [false, false]);
}

#[test]
fn a_product_of_two_is_told_but_not_the_two() {
    // y = a b t + c: a and b only as a product.
    let residuals = |p: &[f64], out: &mut Vec<f64>| {
        out.extend(line().iter().map(|(t, y)| p[0] * p[1] * t + p[2] - y));
        Ok(())
    };
    let start = ["a", "b", "c"].map(|name| Parameter::new(name, 1.0));
    let fit = minimize(&residuals, &start, &Options::default()).unwrap();
    close(fit.values[0] * fit.values[1], textbook(&line())[1], 1e-7);
    assert_eq!((fit.std[0], fit.std[1]), (None, None));
    close(fit.std[2].unwrap(), textbook(&line())[2], 1e-5);
    assert_eq!(fit.undetermined.len(), 1);
    let shares = &fit.undetermined[0].shares;
    assert_eq!(shares.iter().map(|s| s.0).collect::<Vec<_>>(), [0, 1]);
    close(shares[0].1, -shares[1].1, 1e-4);
}

#[test]
fn linear_fits_tell_the_rank() {
    // The third column is the sum of the others; the fourth is zero.
    let design = DMatrix::from_fn(10, 4, |i, j| {
        let (a, b) = (1.0, i as f64);
        [a, b, a + b, 0.0][j]
    });
    let right: Vec<f64> = (0..10).map(|i| 3.0 + f64::from(i)).collect();
    let fit = solve(&design, &right, None, false).unwrap();
    assert_eq!(fit.std, [None, None, None, None]);
    assert_eq!(fit.undetermined.len(), 2);
    assert!(fit.sum_of_squares < 1e-20 && fit.degrees_of_freedom == 8);
    assert!(fit.condition > 1e11, "{}", fit.condition);
}

#[test]
fn known_variances_are_taken_as_they_are() {
    let design = DMatrix::from_element(4, 1, 1.0);
    let fit = solve(&design, &[1.0, 1.0, 3.0, 3.0], Some(&[2.0; 4]), true).unwrap();
    // σ = 0.5 each, four values: 0.25.
    close(fit.values[0], 2.0, 1e-12);
    close(fit.std[0].unwrap(), 0.25, 1e-12);
}

#[test]
fn derivatives_given_are_used() {
    let data = line();
    let problem = WithJacobian {
        residuals: line_residuals(&data),
        jacobian: |_: &[f64], out: &mut DMatrix<f64>| {
            for i in 0..20 {
                out[(i, 0)] = 1.0;
                out[(i, 1)] = i as f64;
            }
            Ok(())
        },
    };
    let start = [Parameter::new("a", 0.0), Parameter::new("b", 0.0)];
    let fit = minimize(&problem, &start, &Options::default()).unwrap();
    close(fit.values[1], textbook(&data)[1], 1e-10);
    assert!(fit.evaluations < 20, "{}", fit.evaluations);
}

#[test]
fn what_cannot_be_fitted_is_refused() {
    let data = line();
    let residuals = line_residuals(&data);
    let fit = |parameters: &[Parameter]| minimize(&residuals, parameters, &Options::default());
    let (a, b) = (Parameter::new("a", 0.0), Parameter::new("b", 0.0));
    assert_eq!(
        fit(&[a.clone().fixed(), b.clone().fixed()]),
        Err(FitError::NothingFree)
    );
    let outside = fit(&[a.clone().at_least(1.0), b.clone()])
        .unwrap_err()
        .to_string();
    assert_eq!(outside, "parameter a: starts at 0, outside 1 to inf");
    assert!(fit(&[a.clone().scaled(0.0), b.clone()]).is_err());
    let few = |p: &[f64], out: &mut Vec<f64>| {
        out.push(p[0] + p[1]);
        Ok(())
    };
    let error = minimize(&few, &[a.clone(), b.clone()], &Options::default()).unwrap_err();
    assert_eq!(
        error,
        FitError::TooFewResiduals {
            residuals: 1,
            free: 2
        }
    );
    let infinite = |_: &[f64], out: &mut Vec<f64>| {
        out.extend([1.0, f64::NAN]);
        Ok(())
    };
    let error = minimize(&infinite, &[a, b], &Options::default()).unwrap_err();
    assert!(matches!(error, FitError::NotFinite { index: 1, .. }));
}

#[test]
fn places_where_the_model_fails_are_stepped_around() {
    // √p is not there for p < 0; the first full step would lead there.
    let residuals = |p: &[f64], out: &mut Vec<f64>| {
        if p[0] < 0.0 {
            return Err(FitError::Model("negative".to_owned()));
        }
        out.extend([p[0].sqrt() - 0.1, p[0].sqrt() - 0.1]);
        Ok(())
    };
    let start = [Parameter::new("p", 4.0)];
    let fit = minimize(&residuals, &start, &Options::default()).unwrap();
    close(fit.values[0], 0.01, 1e-6);
    assert_ne!(fit.stop, StopReason::Evaluations);
}

#[test]
fn a_fit_with_nothing_left_free_ends_at_its_bound_without_uncertainty() {
    // The data want −1; at 0 nothing is free any more.
    let residuals = |p: &[f64], out: &mut Vec<f64>| {
        out.extend((0..5).map(|_| p[0] + 1.0));
        Ok(())
    };
    let start = [Parameter::new("size", 0.5).at_least(0.0)];
    let fit = minimize(&residuals, &start, &Options::default()).expect("the bound is an answer");
    assert_eq!(fit.values, [0.0]);
    assert_eq!(fit.std, [None]);
    assert_eq!(fit.at_bound, [true]);
    assert!(fit.undetermined.is_empty());
}
