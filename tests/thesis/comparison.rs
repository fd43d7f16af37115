//! A printed number compared with the result of the inputs printed next to it, and the units of the
//! thesis.

use torqcomp_model::{Kind, SecondOrder, UnitSystem};

/// A printed value, half a unit of its last digit, and the result of its inputs.
pub struct Comparison {
    equation: &'static str,
    printed: f64,
    half_digit: f64,
    /// Value computed by hand, and half a unit of its last digit.
    by_hand: f64,
    by_hand_half_digit: f64,
    recomputed: f64,
}

impl Comparison {
    /// Prints the comparison and checks the crate against the value computed by hand.
    #[track_caller]
    fn show(&self) -> f64 {
        let difference = self.recomputed - self.printed;
        println!(
            "{:<28} printed {:>12e}  recomputed {:>12.6e}  difference {:>10.3e} ({:+.3} %)",
            self.equation,
            self.printed,
            self.recomputed,
            difference,
            100.0 * difference / self.printed
        );
        let error = (self.recomputed - self.by_hand).abs();
        assert!(
            error <= self.by_hand_half_digit,
            "{}: recomputed {:e}, by hand {:e}",
            self.equation,
            self.recomputed,
            self.by_hand
        );
        difference.abs()
    }

    /// The printed value is the rounded recomputed one.
    #[track_caller]
    pub fn follows(self) {
        let difference = self.show();
        assert!(
            difference <= self.half_digit,
            "{} does not follow",
            self.equation
        );
    }

    /// The printed value is not the rounded recomputed one.
    #[track_caller]
    pub fn differs(self) {
        let difference = self.show();
        assert!(
            difference > self.half_digit,
            "{} does follow",
            self.equation
        );
    }
}

/// Short form: (value, half a unit of its last digit) printed and by hand.
pub fn compare(
    equation: &'static str,
    (printed, half_digit): (f64, f64),
    (by_hand, by_hand_half_digit): (f64, f64),
    recomputed: f64,
) -> Comparison {
    Comparison {
        equation,
        printed,
        half_digit,
        by_hand,
        by_hand_half_digit,
        recomputed,
    }
}

pub fn si(kind: Kind, text: &str) -> f64 {
    kind.parse(text).unwrap()
}

pub fn us(kind: Kind, value: f64) -> f64 {
    kind.to(UnitSystem::Us, value)
}

pub fn inches(value: f64) -> f64 {
    si(Kind::Length, &format!("{value} in"))
}

/// A stand from constants in slug ft², ft lbf s/rad and ft lbf/rad.
pub fn stand(inertia: f64, damping: f64, stiffness: f64) -> SecondOrder {
    SecondOrder::new(
        si(Kind::Inertia, &format!("{inertia} slug ft^2")),
        si(Kind::AngularDamping, &format!("{damping} ft lbf s/rad")),
        si(Kind::AngularStiffness, &format!("{stiffness} ft lbf/rad")),
    )
    .unwrap()
}
