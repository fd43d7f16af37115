//! Exact output of the four-arm network, loaded and fed through resistances.

/// The bridge in units of the arm resistance, with everything but strain fixed.
///
/// With arms r₁…r₄ round the ring, source resistance s and load r_L across the
/// output (leads r_o and recorder in series), Kirchhoff's laws give
///
/// `v = E (r₁r₃ - r₂r₄) / (D (1 + g r_o) + g T)`, `g = R/R_in`,
/// `D = (r₁+r₂)(r₃+r₄) + s Σr`,
/// `T = r₁r₂(r₃+r₄) + r₃r₄(r₁+r₂) + s (r₁+r₄)(r₂+r₃)`;
///
/// `T/D` is the Thévenin resistance. A current source is the limit s → ∞ with
/// E = I s: only the s terms of D and T remain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Network {
    /// Unstrained arms, leads included.
    pub base: [f64; 4],
    /// E_s, or I_s R, V.
    pub scale_v: f64,
    /// Weight of the terms without s: 1 for a voltage source, 0 for a current source.
    pub voltage_weight: f64,
    /// Weight of the s terms: s for a voltage source, 1 for a current source.
    pub current_weight: f64,
    /// Resistance of the output leads r_o.
    pub output_lead: f64,
    /// Conductance of the recorder g.
    pub load: f64,
}

/// A value and its derivative with respect to each arm.
type WithGradient = (f64, [f64; 4]);

impl Network {
    /// Output (V) and its derivative when the arms change by `change` from their base at the rate
    /// `rate`.
    pub fn output(&self, change: [f64; 4], rate: [f64; 4]) -> (f64, f64) {
        let r: [f64; 4] = std::array::from_fn(|i| self.base[i] + change[i]);
        let numerator = self.imbalance(change);
        let numerator_rate = dot([r[2], -r[3], r[0], -r[1]], rate);
        let (d, d_gradient) = self.determinant(r);
        let (t, t_gradient) = self.transfer(r);
        let stiff = 1.0 + self.load * self.output_lead;
        let denominator = d * stiff + self.load * t;
        let denominator_rate = dot(d_gradient, rate) * stiff + self.load * dot(t_gradient, rate);
        let ratio = numerator / denominator;
        let slope = (numerator_rate - ratio * denominator_rate) / denominator;
        (self.scale_v * ratio, self.scale_v * slope)
    }

    /// Thévenin resistance between the output terminals, leads included.
    pub fn output_resistance(&self, change: [f64; 4]) -> f64 {
        let r = std::array::from_fn(|i| self.base[i] + change[i]);
        self.transfer(r).0 / self.determinant(r).0 + self.output_lead
    }

    /// `r₁r₃ - r₂r₄`, expanded about the base to avoid cancellation near balance.
    fn imbalance(&self, c: [f64; 4]) -> f64 {
        let b = self.base;
        (b[0] * b[2] - b[1] * b[3])
            + (b[2] * c[0] + b[0] * c[2] - b[3] * c[1] - b[1] * c[3])
            + (c[0] * c[2] - c[1] * c[3])
    }

    /// D and its gradient.
    fn determinant(&self, r: [f64; 4]) -> WithGradient {
        let (v, s) = (self.voltage_weight, self.current_weight);
        let (left, right) = (r[0] + r[1], r[2] + r[3]);
        let (by_left, by_right) = (v * right + s, v * left + s);
        (
            v * left * right + s * (left + right),
            [by_left, by_left, by_right, by_right],
        )
    }

    /// T and its gradient.
    fn transfer(&self, r: [f64; 4]) -> WithGradient {
        let (v, s) = (self.voltage_weight, self.current_weight);
        let (left, right) = (r[0] + r[1], r[2] + r[3]);
        let (top, bottom) = (r[0] + r[3], r[1] + r[2]);
        let (left_pair, right_pair) = (r[0] * r[1], r[2] * r[3]);
        let value = v * (left_pair * right + right_pair * left) + s * top * bottom;
        let gradient = [
            v * (r[1] * right + right_pair) + s * bottom,
            v * (r[0] * right + right_pair) + s * top,
            v * (left_pair + r[3] * left) + s * top,
            v * (left_pair + r[2] * left) + s * bottom,
        ];
        (value, gradient)
    }
}

fn dot(a: [f64; 4], b: [f64; 4]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}
