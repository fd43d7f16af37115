//! Status of a candidate effect and the reason for it: both follow from one [`Reason`].

use schemars::JsonSchema;
use serde::Serialize;

use crate::print::rounded;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// Added to the model.
    Accepted,
    /// Not added.
    Rejected,
    /// The data cannot distinguish it from the one that is added.
    Indistinguishable,
}

impl Status {
    pub fn name(self) -> &'static str {
        match self {
            Self::Accepted => "accepted",
            Self::Rejected => "rejected",
            Self::Indistinguishable => "indistinguishable",
        }
    }
}

/// Why a candidate has its status.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(into = "StatedReason")]
#[schemars(from = "StatedReason")]
pub enum Reason {
    /// No fit came about.
    NotFitted,
    /// The error changes by this part.
    NoReduction {
        change: f64,
    },
    /// The error changes by this part.
    NotSignificant {
        change: f64,
    },
    /// Part of the residual's power that it explains.
    SmallShare {
        share: f64,
    },
    /// It explains no more than what the noise of the applied quantity does in the model.
    TakesOutNoise,
    /// An essential parameter does not differ from zero.
    ZeroParameter {
        name: &'static str,
    },
    CriterionNotLower,
    /// The best of all.
    Best,
    /// Its error over that of the best.
    Worse {
        ratio: f64,
        best: String,
    },
    MoreParameters {
        best: &'static str,
    },
    Tied {
        best: &'static str,
        experiment: &'static str,
    },
    /// A law that is not offered as an effect leaves less.
    GuardModel {
        ratio: f64,
        law: &'static str,
        equation: &'static str,
    },
    /// A surface over the motion, with no law, leaves less: this one's error over that.
    Surface {
        ratio: f64,
    },
    /// A further effect that explains less than this part of the initial excess error, or less than the second part although
    /// it explains this part of the rest.
    SmallSecond {
        least: f64,
        least_of_rest: f64,
        rest: f64,
    },
    /// It was added and taken out again: without it, these leave no more.
    Needless {
        others: String,
    },
    /// It explains only this part of the excess error.
    SmallPart {
        explained: f64,
    },
    /// The hold-out error changes by this part only.
    NotConfirmed {
        change: f64,
    },
    /// Its motion diverges on the held-out records.
    Diverges,
    /// The plain stand leaves no more than the rounding error of the records.
    BelowResolution,
    NoneAccepted,
}

impl Reason {
    pub fn status(&self) -> Status {
        match self {
            Self::Best => Status::Accepted,
            Self::Tied { .. } => Status::Indistinguishable,
            _ => Status::Rejected,
        }
    }

    /// Whether the effect significantly reduces the training error.
    pub fn is_significant(&self) -> bool {
        !matches!(
            self,
            Self::NotFitted | Self::NoReduction { .. } | Self::NotSignificant { .. }
        )
    }

    /// The reason as text.
    pub fn text(&self) -> String {
        match self {
            Self::NotFitted => {
                "not fitted: no starting point reduces the training error".to_owned()
            }
            Self::NoReduction { change } => {
                format!(
                    "does not reduce the training error (change: {})",
                    percent(*change)
                )
            }
            Self::NotSignificant { change } => {
                format!(
                    "changes the training error by {}: not significant",
                    percent(*change)
                )
            }
            Self::SmallShare { share } => small_share(100.0 * share),
            Self::TakesOutNoise => TAKES_OUT_NOISE.to_owned(),
            Self::ZeroParameter { name } => {
                format!("its {name} is not significantly different from zero")
            }
            Self::CriterionNotLower => "too small a gain for its extra parameters (BIC)".to_owned(),
            Self::Best => "largest significant reduction of the training error".to_owned(),
            Self::Worse { ratio, best } => worse(*ratio, best),
            Self::MoreParameters { best } => {
                format!("no better than {best}, with more parameters")
            }
            Self::Tied { best, experiment } => {
                format!(
                    "not significantly different from {best}; to distinguish them: {experiment}"
                )
            }
            Self::GuardModel {
                ratio,
                law,
                equation,
            } => beside_the_list(*ratio, law, equation),
            Self::Surface { ratio } => worse(*ratio, OF_NO_LAW),
            Self::SmallSecond {
                least,
                least_of_rest,
                rest,
            } => too_little([*least, *least_of_rest, *rest].map(|part| 100.0 * part)),
            Self::Needless { others } => {
                format!("not needed: the error of {others} without it is not significantly larger")
            }
            Self::SmallPart { explained } => format!(
                "improves the fit, but explains only {:.0} % of the error above the noise: the main cause is something else",
                100.0 * explained.max(0.0)
            ),
            Self::NotConfirmed { change } => not_confirmed(*change),
            Self::Diverges => "its motion diverges on the hold-out records".to_owned(),
            Self::BelowResolution => {
                "the plain stand leaves no more than the rounding error of the records".to_owned()
            }
            Self::NoneAccepted => "no effect is accepted".to_owned(),
        }
    }
}

/// An effect that only removes the response to input noise.
const TAKES_OUT_NOISE: &str =
    "explains little except the noise of the applied quantity, which it attenuates";

/// Name of a surface over the motion.
const OF_NO_LAW: &str = "a torque over displacement and speed without an assumed law";

/// An effect that explains only a few percent of the residual power.
fn small_share(percent: f64) -> String {
    format!(
        "explains only {} % of the residual power: too little to distinguish from other model errors",
        rounded(percent, 2)
    )
}

/// An effect not confirmed by the held-out records.
fn not_confirmed(change: f64) -> String {
    let size = percent(change);
    let of_holdout = match change > 0.0 {
        true => format!(
            "increases the hold-out error by {}",
            size.trim_start_matches('+')
        ),
        false => format!("the hold-out error changes by only {size}"),
    };
    format!("reduces the training error, but {of_holdout}: not confirmed")
}

/// A further effect that explains too little, with the minimum shares in percent.
fn too_little([least, least_of_rest, rest]: [f64; 3]) -> String {
    format!(
        "explains less than {least:.0} % of the plain stand's residual above the noise (or less than \
         {least_of_rest:.0} %, and {rest:.0} % of the present residual): too little for a further effect"
    )
}

/// An effect surpassed by a law that is not in the list.
fn beside_the_list(ratio: f64, law: &str, equation: &str) -> String {
    let law = format!("{law} ({equation}), a law that is not in the list of effects");
    worse(ratio, &law)
}

/// An effect with a larger residual than the accepted ones.
fn worse(ratio: f64, best: &str) -> String {
    if ratio <= 1.0 {
        return format!("improves the fit, but not significantly more than {best}");
    }
    format!(
        "improves the fit, but its training error is {} that of {best}",
        times(ratio)
    )
}

/// A ratio of errors above 1, as text.
fn times(ratio: f64) -> String {
    match rounded(ratio, 3).as_str() {
        "1" => "slightly more than".to_owned(),
        ratio => format!("{ratio} times"),
    }
}

/// Relative change above which it is given as a factor.
const LARGE_CHANGE: f64 = 10.0;

/// A relative change in percent, with its sign; a large one as a factor.
fn percent(change: f64) -> String {
    if change >= LARGE_CHANGE {
        return format!("a factor of {}", rounded(1.0 + change, 2));
    }
    let change = 100.0 * change;
    match change.abs() {
        size if size < 0.005 => "less than 0.01 %".to_owned(),
        size if size < 10.0 => format!("{change:+.2} %"),
        _ => format!("{change:+.0} %"),
    }
}

/// A reason in a document.
#[derive(Serialize, JsonSchema)]
struct StatedReason {
    /// Whether the effect is added to the model.
    status: Status,
    /// Why the effect is or is not added.
    why: String,
}

impl From<Reason> for StatedReason {
    fn from(reason: Reason) -> Self {
        Self {
            status: reason.status(),
            why: reason.text(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ratio below 1 would contradict the statement that the error is larger.
    #[test]
    fn an_error_is_said_to_be_larger_only_where_it_is() {
        for ratio in [0.5, 0.872, 0.9999, 1.0, 1.0001, 1.2] {
            let reasons = [
                Reason::Worse {
                    ratio,
                    best: "backlash".to_owned(),
                },
                Reason::GuardModel {
                    ratio,
                    law: "stick",
                    equation: "n = f",
                },
            ];
            for text in reasons.map(|reason| reason.text()) {
                let says_larger = text.contains("error is");
                assert_eq!(says_larger, ratio > 1.0, "{ratio}: {text}");
                assert!(!text.contains("0."), "{ratio}: {text}");
            }
        }
    }
}
