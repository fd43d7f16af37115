//! Torque per volt from a static load (Appendix C, IV).

use crate::check::{finite, non_zero, positive};
use crate::error::ModelError;

/// Voltage for a deflection of the recorder, E = s n in V, (C22).
///
/// `sensitivity_v_per_division` is s in V/division and greater than 0, `divisions` is n, signed.
///
/// # Errors
/// [`ModelError`] if the sensitivity is not greater than 0 or the deflection is not finite.
///
/// ```
/// // 0.25 V/division, 12 divisions: 3 V.
/// assert_eq!(torqcomp_model::calibration::deflection_voltage_v(0.25, 12.0)?, 3.0);
/// # Ok::<(), torqcomp_model::ModelError>(())
/// ```
pub fn deflection_voltage_v(
    sensitivity_v_per_division: f64,
    divisions: f64,
) -> Result<f64, ModelError> {
    let sensitivity = positive("sensitivity", "V/division", sensitivity_v_per_division)?;
    Ok(sensitivity * finite("deflection", "divisions", divisions)?)
}

/// Torque per volt of the whole chain, C_T = r F/E in N m/V, (C23).
///
/// `radius_m` is r in m, `force_n` the test load F in N, `voltage_v` its change of output E in V. A
/// negative result means that the output falls as the torque rises. Valid for a static load, in the
/// linear range of gage and beam, without friction in the loading.
///
/// # Errors
/// [`ModelError`] if r is not greater than 0, or F or E is 0 or not finite.
///
/// ```
/// // 10 N at 0.5 m showing 2 V: 2.5 N m/V.
/// assert_eq!(torqcomp_model::calibration::torque_per_volt_n_m_per_v(0.5, 10.0, 2.0)?, 2.5);
/// # Ok::<(), torqcomp_model::ModelError>(())
/// ```
pub fn torque_per_volt_n_m_per_v(
    radius_m: f64,
    force_n: f64,
    voltage_v: f64,
) -> Result<f64, ModelError> {
    let radius = positive("radius of the load", "m", radius_m)?;
    let force = non_zero("test load", "N", force_n)?;
    Ok(radius * force / non_zero("output voltage", "V", voltage_v)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sign_tells_the_polarity_of_the_chain() {
        assert_eq!(torque_per_volt_n_m_per_v(0.5, -10.0, 2.0), Ok(-2.5));
        assert_eq!(torque_per_volt_n_m_per_v(0.5, -10.0, -2.0), Ok(2.5));
    }

    #[test]
    fn a_test_that_shows_nothing_is_refused() {
        let none = deflection_voltage_v(238e-6, 0.0).unwrap();
        assert!(matches!(
            torque_per_volt_n_m_per_v(0.5, 10.0, none),
            Err(ModelError::Zero {
                name: "output voltage",
                unit: "V"
            })
        ));
        assert!(matches!(
            torque_per_volt_n_m_per_v(0.5, 0.0, 1.0),
            Err(ModelError::Zero {
                name: "test load",
                unit: "N"
            })
        ));
        assert!(matches!(
            deflection_voltage_v(0.0, 1.0),
            Err(ModelError::NotPositive { .. })
        ));
        assert!(matches!(
            deflection_voltage_v(1.0, f64::NAN),
            Err(ModelError::NotFinite { .. })
        ));
    }
}
