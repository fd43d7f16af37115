//! The strain-gage bridge: exact output from strain, and strain from output.
//!
//! A [`Bridge`] is a ring of four arms ([`BridgeLayout`]) whose active arms follow an [`ArmLaw`],
//! fed by a [`Supply`], connected by [`Leads`] and read by a recorder of finite input resistance.
//! Nothing is linearised: the network is solved by Kirchhoff's laws and inverted to rounding.
//!
//! Effect of each part on the output of Hertel's bridge (22.5 V, 5784 ohm arms, gage factor 157;
//! thesis eqs. 28 to 30, computed 165 ft lbf/V against a measured 1.23e3 ft lbf/V, a factor of
//! 7.4):
//!
//! | departure | output reduced by a factor of |
//! |---|---|
//! | one gage (quarter bridge) instead of the two of eq. (28) | 2 |
//! | recorder of input resistance R_in | 1 + 5784 ohm / R_in |
//! | 10 ohm two-wire leads on a quarter bridge | 1.0035 |
//! | curvature of the quarter bridge at 50 microstrain | 1.004 |
//!
//! A quarter bridge would leave a factor of 3.7 of the 7.4, which a recorder input of about 2120
//! ohm would explain; the thesis does not say. A measured torque per volt avoids the question:
//! [`Conversion::linear`](crate::conversion::Conversion::linear).

mod arm;
mod layout;
mod network;
#[cfg(test)]
mod tests;

pub use arm::ArmLaw;
pub use layout::{BridgeLayout, Leads, Supply};

use crate::gage::GageError;
use network::Network;

/// An error in a bridge or in a value given to it.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BridgeError {
    /// Invalid parameter.
    #[error("{what} must be {expected}, got {got}; correct the bridge's data")]
    InvalidParameter {
        /// Name of the parameter.
        what: &'static str,
        /// The accepted range.
        expected: &'static str,
        /// The value.
        got: f64,
    },
    /// The wiring needs the gages in arms 1 and 2.
    #[error(
        "leads {leads:?} need gages in arms 1 and 2 only, got layout {layout:?}; \
         use two-wire or four-wire leads"
    )]
    LeadsDoNotFit {
        /// The layout.
        layout: BridgeLayout,
        /// The leads.
        leads: Leads,
    },
    /// Strain outside the range of the arms.
    #[error("strain must lie from {low} to {high}, got {got}; check its unit (m/m)")]
    StrainOutOfRange {
        /// Lower limit of strain.
        low: f64,
        /// Upper limit of strain.
        high: f64,
        /// The strain.
        got: f64,
    },
    /// No strain in range gives the voltage.
    #[error(
        "bridge output must lie from {low_v} V to {high_v} V, got {got_v} V; \
         check amplifier gain, supply and recorder zero"
    )]
    VoltageOutOfRange {
        /// Lower limit of the output, V.
        low_v: f64,
        /// Upper limit of the output, V.
        high_v: f64,
        /// The voltage, V.
        got_v: f64,
    },
    /// The iteration for the strain did not converge.
    #[error(
        "strain for {got_v} V must converge within {steps} steps, got {strain} at the last; check the bridge's data \
         for extreme values"
    )]
    NotConverged {
        /// Maximum number of steps.
        steps: u32,
        /// The voltage, V.
        got_v: f64,
        /// Strain at the last step.
        strain: f64,
    },
    /// No such state of the gage.
    #[error(transparent)]
    Gage(#[from] GageError),
}

/// A four-arm bridge with its supply, leads and recorder.
///
/// Fixed arms equal the unstrained active arm (`arm_resistance_ohm`), so the bridge is balanced at
/// no load except for two-wire leads or a drifted single gage;
/// [`zero_output_v`](Self::zero_output_v) is that imbalance, for the caller to subtract.
///
/// ```
/// use torqcomp_dsp::bridge::{ArmLaw, Bridge, BridgeLayout, Supply};
/// let supply = Supply::ConstantVoltage { volts: 10.0 };
/// let bridge = Bridge::new(BridgeLayout::Quarter, ArmLaw::foil(100.0)?, 1000.0, supply)?;
/// // Arm at 1100 ohm: 10 V * (1/2 - 1000/2100) = 10 V / 42.
/// assert!((bridge.output_v(1e-3)? - 10.0 / 42.0).abs() < 1e-15);
/// assert!((bridge.strain(10.0 / 42.0)? - 1e-3).abs() < 1e-17);
/// // A recorder of 1000 ohm halves the volts: the bridge's own 1000 ohm are in series.
/// assert!((bridge.with_input_resistance_ohm(1000.0)?.loading_factor() - 2.0).abs() < 1e-15);
/// # Ok::<(), torqcomp_dsp::bridge::BridgeError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bridge {
    layout: BridgeLayout,
    law: ArmLaw,
    arm_resistance_ohm: f64,
    supply: Supply,
    leads: Leads,
    input_resistance_ohm: Option<f64>,
    // Derived from the fields above by `derive`.
    network: Network,
    range: (f64, f64),
    /// Output at either end of the range, V.
    ends_v: (f64, f64),
    /// Output (V) and slope (V per unit strain) at no load.
    at_zero: (f64, f64),
}

impl Bridge {
    /// Maximum number of steps of the inverse; bisection alone would need about 60.
    const STEPS: u32 = 200;

    /// A bridge with resistance-free leads and an unloaded output.
    ///
    /// `arm_resistance_ohm` R (ohm) is the unstrained arm, R_B of a bonded gage.
    ///
    /// # Errors
    /// [`BridgeError::InvalidParameter`] when R is not above zero, the supply
    /// is zero or not finite, or Poisson's ratio is outside 0 to 0.5.
    pub fn new(
        layout: BridgeLayout,
        law: ArmLaw,
        arm_resistance_ohm: f64,
        supply: Supply,
    ) -> Result<Self, BridgeError> {
        let arm = arm_resistance_ohm;
        let good = arm.is_finite() && arm > 0.0;
        require(good, "arm resistance", "finite and above zero", arm)?;
        let source = match supply {
            Supply::ConstantVoltage { volts } => volts,
            Supply::ConstantCurrent { amperes } => amperes,
        };
        let good = source.is_finite() && source != 0.0;
        require(good, "bridge supply", "finite and not zero", source)?;
        if let Some(ratio) = layout.poisson_ratio() {
            let good = (0.0..=0.5).contains(&ratio);
            require(good, "Poisson's ratio", "from 0 to 0.5", ratio)?;
        }
        Ok(Self::derive(layout, law, arm, supply, Leads::None, None))
    }

    /// Adds lead wires.
    ///
    /// # Errors
    /// [`BridgeError::InvalidParameter`] for a wire resistance that is negative
    /// or not finite; [`BridgeError::LeadsDoNotFit`] for three-wire leads to
    /// arms 3 and 4.
    pub fn with_leads(self, leads: Leads) -> Result<Self, BridgeError> {
        let ohm = leads.lead_ohm();
        let good = ohm.is_finite() && ohm >= 0.0;
        require(good, "lead resistance", "finite and not negative", ohm)?;
        let layout = self.layout;
        if !leads.fits(&layout) {
            return Err(BridgeError::LeadsDoNotFit { layout, leads });
        }
        let Self {
            law,
            arm_resistance_ohm: arm,
            supply,
            input_resistance_ohm: input,
            ..
        } = self;
        Ok(Self::derive(layout, law, arm, supply, leads, input))
    }

    /// Sets the input resistance R_in of the recorder, in ohm.
    ///
    /// # Errors
    /// [`BridgeError::InvalidParameter`] when R_in is not above zero.
    pub fn with_input_resistance_ohm(self, input_ohm: f64) -> Result<Self, BridgeError> {
        let good = input_ohm.is_finite() && input_ohm > 0.0;
        require(good, "input resistance", "finite and above zero", input_ohm)?;
        let Self {
            layout,
            law,
            arm_resistance_ohm: arm,
            supply,
            leads,
            ..
        } = self;
        Ok(Self::derive(
            layout,
            law,
            arm,
            supply,
            leads,
            Some(input_ohm),
        ))
    }

    fn derive(
        layout: BridgeLayout,
        law: ArmLaw,
        arm_resistance_ohm: f64,
        supply: Supply,
        leads: Leads,
        input_resistance_ohm: Option<f64>,
    ) -> Self {
        let load = input_resistance_ohm.map_or(0.0, |input| arm_resistance_ohm / input);
        let network = wire(&layout, &law, arm_resistance_ohm, supply, leads, load);
        let range = strain_range(&law, layout.arm_factors());
        let mut bridge = Self {
            layout,
            law,
            arm_resistance_ohm,
            supply,
            leads,
            input_resistance_ohm,
            network,
            range,
            ends_v: (0.0, 0.0),
            at_zero: (0.0, 0.0),
        };
        let end_v = |strain| bridge.output_and_slope(strain).0;
        bridge.ends_v = (end_v(range.0), end_v(range.1));
        bridge.at_zero = bridge.output_and_slope(0.0);
        bridge
    }

    /// Arrangement of the active arms.
    pub fn layout(&self) -> BridgeLayout {
        self.layout
    }

    /// Law of the active arms.
    pub fn law(&self) -> ArmLaw {
        self.law
    }

    /// Unstrained arm resistance, ohm.
    pub fn arm_resistance_ohm(&self) -> f64 {
        self.arm_resistance_ohm
    }

    /// The supply.
    pub fn supply(&self) -> Supply {
        self.supply
    }

    /// The wires.
    pub fn leads(&self) -> Leads {
        self.leads
    }

    /// Input resistance of the recorder, ohm; `None` if infinite.
    pub fn input_resistance_ohm(&self) -> Option<f64> {
        self.input_resistance_ohm
    }

    /// Range of strain in which every active arm follows its law.
    pub fn strain_range(&self) -> (f64, f64) {
        self.range
    }

    /// Voltage at the recorder's terminals at a strain (m/m), V. Exact.
    ///
    /// # Errors
    /// [`BridgeError::StrainOutOfRange`] outside [`strain_range`](Self::strain_range).
    pub fn output_v(&self, strain: f64) -> Result<f64, BridgeError> {
        let (low, high) = self.range;
        match strain >= low && strain <= high {
            true => Ok(self.output_and_slope(strain).0),
            false => Err(BridgeError::StrainOutOfRange {
                low,
                high,
                got: strain,
            }),
        }
    }

    /// Voltage at no load, V: the imbalance due to two-wire leads or drift.
    pub fn zero_output_v(&self) -> f64 {
        self.at_zero.0
    }

    /// Volts per unit strain about no load, including leads and loading.
    ///
    /// For an unloaded balanced bridge this is `(n/4) E_s GF`: thesis eq. (28)
    /// with `E_s GF / 2` for the half bridge, `E_s GF / 4` for the quarter.
    ///
    /// ```
    /// use torqcomp_dsp::bridge::{ArmLaw, Bridge, BridgeLayout, Supply};
    /// let supply = Supply::ConstantVoltage { volts: 22.5 };
    /// let law = ArmLaw::foil(157.0)?;
    /// let half = Bridge::new(BridgeLayout::HalfBending, law, 5784.0, supply)?;
    /// // 22.5 V * 157 / 2 = 1766.25 V per unit strain.
    /// assert!((half.small_signal_sensitivity() - 1766.25).abs() < 1e-10);
    /// # Ok::<(), torqcomp_dsp::bridge::BridgeError>(())
    /// ```
    pub fn small_signal_sensitivity(&self) -> f64 {
        self.at_zero.1
    }

    /// Thévenin resistance R_th seen by the recorder at no load, output leads
    /// included, ohm.
    pub fn output_resistance_ohm(&self) -> f64 {
        self.network.output_resistance([0.0; 4]) * self.arm_resistance_ohm
    }

    /// Factor `1 + R_th/R_in` by which the recorder's loading reduces the output at no load.
    pub fn loading_factor(&self) -> f64 {
        self.input_resistance_ohm
            .map_or(1.0, |input| 1.0 + self.output_resistance_ohm() / input)
    }

    /// Strain (m/m) that gives a voltage (V) at the recorder's terminals, the
    /// exact inverse of [`output_v`](Self::output_v).
    ///
    /// The output is monotonic in the strain over the whole range, so the solution is unique;
    /// Newton's method, safeguarded by a shrinking bracket, finds it to rounding.
    ///
    /// # Errors
    /// [`BridgeError::VoltageOutOfRange`] when no strain in range gives the voltage;
    /// [`BridgeError::NotConverged`] if the iteration does not converge.
    pub fn strain(&self, output_v: f64) -> Result<f64, BridgeError> {
        let (mut low, mut high) = self.range;
        let (at_low, at_high) = self.ends_v;
        let (low_v, high_v) = (at_low.min(at_high), at_low.max(at_high));
        if !(output_v >= low_v && output_v <= high_v) {
            return Err(BridgeError::VoltageOutOfRange {
                low_v,
                high_v,
                got_v: output_v,
            });
        }
        let rising = at_high > at_low;
        let (mut strain, mut last_step) = (0.0, high - low);
        for _ in 0..Self::STEPS {
            let (voltage, slope) = self.output_and_slope(strain);
            let miss = voltage - output_v;
            if miss == 0.0 {
                return Ok(strain);
            }
            if (miss > 0.0) == rising {
                high = strain;
            } else {
                low = strain;
            }
            let newton = strain - miss / slope;
            // A step that does not halve the interval is replaced by bisection, which bounds the
            // count; also false for the NaN of a zero slope.
            let good =
                newton >= low && newton <= high && 2.0 * (newton - strain).abs() <= last_step;
            let next = if good { newton } else { 0.5 * (low + high) };
            last_step = (next - strain).abs();
            // The output has a few rounding errors; a smaller step is noise.
            let noise = 16.0 * f64::EPSILON * (next.abs() + (output_v / slope).abs());
            if (good && last_step <= noise) || next == strain {
                return Ok(next);
            }
            strain = next;
        }
        Err(BridgeError::NotConverged {
            steps: Self::STEPS,
            got_v: output_v,
            strain,
        })
    }

    /// Output (V) and its slope (V per unit strain).
    fn output_and_slope(&self, strain: f64) -> (f64, f64) {
        let factors = self.layout.arm_factors();
        let change = factors.map(|f| f.map_or(0.0, |f| self.law.change_from_zero(f * strain)));
        let rate = factors.map(|f| f.map_or(0.0, |f| f * self.law.slope(f * strain)));
        self.network.output(change, rate)
    }
}

fn require(
    good: bool,
    what: &'static str,
    expected: &'static str,
    got: f64,
) -> Result<(), BridgeError> {
    match good {
        true => Ok(()),
        false => Err(BridgeError::InvalidParameter {
            what,
            expected,
            got,
        }),
    }
}

/// The network in units of the arm resistance; `load` is the arm resistance over that of the
/// recorder.
fn wire(
    layout: &BridgeLayout,
    law: &ArmLaw,
    arm_ohm: f64,
    supply: Supply,
    leads: Leads,
    load: f64,
) -> Network {
    let factors = layout.arm_factors();
    let lead = leads.lead_ohm() / arm_ohm;
    let (arm_leads, source, output_lead) = match leads {
        Leads::None => ([0.0; 4], 0.0, 0.0),
        Leads::TwoWire { .. } => (factors.map(|f| f.map_or(0.0, |_| 2.0 * lead)), 0.0, 0.0),
        Leads::ThreeWire { .. } => ([lead, lead, 0.0, 0.0], 0.0, lead),
        Leads::FourWire { .. } => ([0.0; 4], 2.0 * lead, 2.0 * lead),
    };
    let (scale_v, voltage_weight, current_weight) = match supply {
        Supply::ConstantVoltage { volts } => (volts, 1.0, source),
        Supply::ConstantCurrent { amperes } => (amperes * arm_ohm, 0.0, 1.0),
    };
    let unstrained = |i: usize| 1.0 + factors[i].map_or(0.0, |_| law.offset()) + arm_leads[i];
    let base = std::array::from_fn(unstrained);
    Network {
        base,
        scale_v,
        voltage_weight,
        current_weight,
        output_lead,
        load,
    }
}

/// Range of strain that keeps every active arm within its law.
fn strain_range(law: &ArmLaw, factors: [Option<f64>; 4]) -> (f64, f64) {
    let (low, high) = law.strain_range();
    let active = factors.into_iter().flatten().filter(|&f| f != 0.0);
    active.fold((-1.0, 1.0), |(least, most), f| {
        let (a, b) = (low / f, high / f);
        (a.min(b).max(least), a.max(b).min(most))
    })
}
