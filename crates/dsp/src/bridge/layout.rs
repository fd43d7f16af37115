//! Arrangement of the gages in the bridge, and their wiring.

/// Arrangement of the active arms.
///
/// The arms go round the ring 1, 2, 3, 4; the supply is across the corners 4-1
/// and 2-3, the output is taken from corner 3-4 against corner 1-2. A rise of
/// arm 1 or 3 raises the output, a rise of arm 2 or 4 lowers it. Arms without a
/// gage are fixed resistors equal to the unstrained arm.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum BridgeLayout {
    /// One gage: arm 1 at +ε.
    Quarter,
    /// Two gages on opposite faces of a bent beam: arm 1 at +ε, arm 2 at -ε.
    HalfBending,
    /// Two gages on the same face in opposite arms: arms 1 and 3 at +ε.
    HalfOpposite,
    /// One gage along, one across: arm 1 at +ε, arm 2 at -νε.
    HalfPoisson {
        /// Poisson's ratio ν of the part, -.
        poisson_ratio: f64,
    },
    /// Four gages of a bent beam: arms 1 and 3 at +ε, arms 2 and 4 at -ε.
    Full,
    /// Four gages along and across: arms 1 and 3 at +ε, arms 2 and 4 at -νε.
    FullPoisson {
        /// Poisson's ratio ν of the part, -.
        poisson_ratio: f64,
    },
}

impl BridgeLayout {
    /// Strain of each arm per unit strain; `None` for a fixed resistor.
    pub fn arm_factors(&self) -> [Option<f64>; 4] {
        match *self {
            Self::Quarter => [Some(1.0), None, None, None],
            Self::HalfBending => [Some(1.0), Some(-1.0), None, None],
            Self::HalfOpposite => [Some(1.0), None, Some(1.0), None],
            Self::HalfPoisson { poisson_ratio } => [Some(1.0), Some(-poisson_ratio), None, None],
            Self::Full => [Some(1.0), Some(-1.0), Some(1.0), Some(-1.0)],
            Self::FullPoisson { poisson_ratio } => [
                Some(1.0),
                Some(-poisson_ratio),
                Some(1.0),
                Some(-poisson_ratio),
            ],
        }
    }

    /// Poisson's ratio, where the layout has one.
    pub(super) fn poisson_ratio(&self) -> Option<f64> {
        match *self {
            Self::HalfPoisson { poisson_ratio } | Self::FullPoisson { poisson_ratio } => {
                Some(poisson_ratio)
            }
            _ => None,
        }
    }

    /// Number of active arms `n`, weighted by strain: 1 for the quarter bridge, 2 for the half, 1 +
    /// ν with a transverse gage, 4 for the full bridge.
    pub fn bridge_factor(&self) -> f64 {
        let signs = [1.0, -1.0, 1.0, -1.0];
        let arms = self.arm_factors();
        signs
            .iter()
            .zip(arms)
            .map(|(sign, arm)| sign * arm.unwrap_or(0.0))
            .sum()
    }

    /// Output of the ideal bridge at small imbalance, `E_o = (n/4) E_s GF ε`.
    ///
    /// `supply_v` E_s (V), `gage_factor` GF (-), `strain` ε (m/m), n the
    /// [`bridge_factor`](Self::bridge_factor); thesis eq. (28) is n = 2. Valid
    /// for constant voltage, stiff leads, an unloaded output and GF ε ≪ 1.
    ///
    /// ```
    /// use torqcomp_dsp::bridge::BridgeLayout;
    /// // 22.5 V / 2 * 157 * 50e-6 = 88.3125 mV.
    /// let volts = BridgeLayout::HalfBending.ideal_output_v(22.5, 157.0, 50e-6);
    /// assert!((volts - 88.3125e-3).abs() < 1e-15);
    /// ```
    pub fn ideal_output_v(&self, supply_v: f64, gage_factor: f64, strain: f64) -> f64 {
        self.bridge_factor() / 4.0 * supply_v * gage_factor * strain
    }
}

/// Supply of the bridge.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Supply {
    /// Constant voltage source E_s.
    ConstantVoltage {
        /// Source voltage, V; negative when the source is reversed.
        volts: f64,
    },
    /// Constant current source I_s.
    ConstantCurrent {
        /// Source current, A; negative when the source is reversed.
        amperes: f64,
    },
}

/// Wires between the gages and the instrument, each with resistance `lead_ohm`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Leads {
    /// Wires without resistance.
    None,
    /// A pair of wires for each gage, both in series with it: reduces the signal and shifts the
    /// zero.
    TwoWire {
        /// Resistance of one wire, ohm.
        lead_ohm: f64,
    },
    /// One wire in arm 1, one in arm 2, one in the output corner between them: preserves the zero.
    /// For gages in arms 1 and 2 only.
    ThreeWire {
        /// Resistance of one wire, ohm.
        lead_ohm: f64,
    },
    /// Complete bridge at the part: two supply wires, two output wires.
    FourWire {
        /// Resistance of one wire, ohm.
        lead_ohm: f64,
    },
}

impl Leads {
    /// Resistance of one wire, ohm.
    pub fn lead_ohm(&self) -> f64 {
        match *self {
            Self::None => 0.0,
            Self::TwoWire { lead_ohm }
            | Self::ThreeWire { lead_ohm }
            | Self::FourWire { lead_ohm } => lead_ohm,
        }
    }

    /// Whether the wiring can serve the layout.
    pub(super) fn fits(&self, layout: &BridgeLayout) -> bool {
        let [_, _, third, fourth] = layout.arm_factors();
        !matches!(self, Self::ThreeWire { .. }) || (third.is_none() && fourth.is_none())
    }
}
