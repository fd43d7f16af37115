//! Checks of single numbers, shared by all constructors.

use crate::error::ModelError;

/// Accepts a finite number.
pub(crate) fn finite(
    name: &'static str,
    unit: &'static str,
    value: f64,
) -> Result<f64, ModelError> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(ModelError::NotFinite { name, unit, value })
    }
}

/// Accepts a finite number greater than zero.
pub(crate) fn positive(
    name: &'static str,
    unit: &'static str,
    value: f64,
) -> Result<f64, ModelError> {
    let value = finite(name, unit, value)?;
    if value > 0.0 {
        Ok(value)
    } else {
        Err(ModelError::NotPositive { name, unit, value })
    }
}

/// Accepts a finite number that is zero or greater.
pub(crate) fn non_negative(
    name: &'static str,
    unit: &'static str,
    value: f64,
) -> Result<f64, ModelError> {
    let value = finite(name, unit, value)?;
    if value >= 0.0 {
        Ok(value)
    } else {
        Err(ModelError::Negative { name, unit, value })
    }
}

/// Accepts a finite number that is not zero.
pub(crate) fn non_zero(
    name: &'static str,
    unit: &'static str,
    value: f64,
) -> Result<f64, ModelError> {
    let value = finite(name, unit, value)?;
    if value == 0.0 {
        return Err(ModelError::Zero { name, unit });
    }
    Ok(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_check_refuses_what_it_names() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(matches!(
                finite("x", "m", bad),
                Err(ModelError::NotFinite { .. })
            ));
            assert!(matches!(
                positive("x", "m", bad),
                Err(ModelError::NotFinite { .. })
            ));
            assert!(matches!(
                non_negative("x", "m", bad),
                Err(ModelError::NotFinite { .. })
            ));
            assert!(matches!(
                non_zero("x", "m", bad),
                Err(ModelError::NotFinite { .. })
            ));
        }
        assert!(matches!(
            positive("x", "m", 0.0),
            Err(ModelError::NotPositive { .. })
        ));
        assert!(matches!(
            non_negative("x", "m", -1.0),
            Err(ModelError::Negative { .. })
        ));
        assert!(matches!(
            non_zero("x", "m", -0.0),
            Err(ModelError::Zero { .. })
        ));
        assert_eq!(non_negative("x", "m", 0.0), Ok(0.0));
        assert_eq!(non_zero("x", "m", -2.0), Ok(-2.0));
    }

    #[test]
    fn message_names_number_unit_and_remedy() {
        let text = positive("beam length", "m", -0.5).unwrap_err().to_string();
        assert_eq!(
            text,
            "beam length is -0.5 m, but it must be greater than 0; check its value and sign"
        );
    }
}
