//! Mark of a result of `compensate`, which no longer contains the stand's response and must not be compensated
//! again.

use crate::failure::{ErrorCode, Failure};

/// Start of the heading of a result of `compensate`.
pub(crate) const COMPENSATED: &str = "compensated_";

/// Whether a heading or field name is that of a result of `compensate`, ignoring case.
pub(crate) fn names_compensated(name: &str) -> bool {
    let front = name.trim_start().get(..COMPENSATED.len());
    front.is_some_and(|front| front.eq_ignore_ascii_case(COMPENSATED))
}

/// Failure for a result of `compensate` where a recorded signal is required.
pub(crate) fn already_compensated(source: &str, name: &str) -> Failure {
    ErrorCode::AlreadyCompensated.failed(format_args!(
        "\"{name}\" is marked as compensated: the stand's response is already divided out of it; take the \
         recorded channel instead, or, if this one is a recorded signal, rename it without \"{COMPENSATED}\" \
         (harmonics takes it as it is, without --stand)"
    ))
    .at(source)
}

#[cfg(test)]
mod tests {
    use super::names_compensated;

    #[test]
    fn only_the_beginning_marks_a_result() {
        for marked in [
            "compensated_torque_n_m",
            "Compensated_Torque [N m]",
            " compensated_x",
        ] {
            assert!(names_compensated(marked), "{marked}");
        }
        for unmarked in [
            "torque_n_m",
            "compensated",
            "uncompensated_torque",
            "temperature_compensated_V",
            "é",
        ] {
            assert!(!names_compensated(unmarked), "{unmarked}");
        }
    }
}
