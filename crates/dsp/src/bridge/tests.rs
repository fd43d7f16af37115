//! The bridge against Kirchhoff's equations solved node by node.

use super::*;
use crate::gage::Gage;
use proptest::prelude::*;

/// A resistor with a source in series between two nodes: `v_a - v_b = R i + E`.
struct Branch(usize, usize, f64, f64);

/// Node voltages of a circuit (node 0 is ground), from every branch equation
/// and every node's current balance; `injected` is (node, A) drawn from ground.
fn node_voltages(nodes: usize, branches: &[Branch], injected: Option<(usize, f64)>) -> Vec<f64> {
    let unknown = nodes - 1;
    let size = unknown + branches.len();
    let mut system = vec![vec![0.0; size + 1]; size];
    for (number, &Branch(a, b, ohm, volts)) in branches.iter().enumerate() {
        let (row, current) = (unknown + number, unknown + number);
        for (node, sign) in [(a, 1.0), (b, -1.0)] {
            if node > 0 {
                system[row][node - 1] += sign;
                system[node - 1][current] += sign;
            }
        }
        system[row][current] -= ohm;
        system[row][size] = volts;
    }
    if let Some((node, amperes)) = injected {
        system[node - 1][size] = amperes;
    }
    let mut voltages = eliminate(system);
    voltages.truncate(unknown);
    voltages.insert(0, 0.0);
    voltages
}

/// Gaussian elimination with partial pivoting on rows scaled to unit maximum.
fn eliminate(mut m: Vec<Vec<f64>>) -> Vec<f64> {
    let n = m.len();
    for row in &mut m {
        let largest = row[..n].iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        row.iter_mut().for_each(|v| *v /= largest);
    }
    for k in 0..n {
        let pivot = (k..n)
            .max_by(|&i, &j| m[i][k].abs().total_cmp(&m[j][k].abs()))
            .unwrap();
        m.swap(k, pivot);
        let top = m[k].clone();
        for row in m.iter_mut().skip(k + 1) {
            let factor = row[k] / top[k];
            row.iter_mut()
                .zip(&top)
                .skip(k)
                .for_each(|(v, t)| *v -= factor * t);
        }
    }
    let mut x = vec![0.0; n];
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| m[k][j] * x[j]).sum();
        x[k] = (m[k][n] - known) / m[k][k];
    }
    x
}

/// Recorder voltage with every wire as a separate branch.
///
/// Ring corners: 1 is 4-1, 2 is 1-2, 0 (ground) is 2-3, 3 is 3-4.
fn kirchhoff(bridge: &Bridge, strain: f64) -> f64 {
    let arm_ohm = bridge.arm_resistance_ohm();
    let corners = [(1, 2), (2, 0), (0, 3), (3, 1)];
    let lead = bridge.leads().lead_ohm();
    let mut branches = Vec::new();
    let mut nodes = 4;
    for (number, factor) in bridge.layout().arm_factors().into_iter().enumerate() {
        let ohm = arm_ohm * (1.0 + factor.map_or(0.0, |f| bridge.law().change(f * strain)));
        let wires = match bridge.leads() {
            Leads::TwoWire { .. } if factor.is_some() => 2,
            Leads::ThreeWire { .. } if number < 2 => 1,
            _ => 0,
        };
        let (mut from, to) = corners[number];
        for _ in 0..wires {
            branches.push(Branch(from, nodes, lead, 0.0));
            from = nodes;
            nodes += 1;
        }
        branches.push(Branch(from, to, ohm, 0.0));
    }
    let (minus_ohm, plus_ohm, supply_ohm) = match bridge.leads() {
        Leads::ThreeWire { .. } => (lead, 0.0, 0.0),
        Leads::FourWire { .. } => (lead, lead, 2.0 * lead),
        _ => (0.0, 0.0, 0.0),
    };
    let (minus, plus) = (nodes, nodes + 1);
    branches.push(Branch(2, minus, minus_ohm, 0.0));
    branches.push(Branch(3, plus, plus_ohm, 0.0));
    if let Some(input) = bridge.input_resistance_ohm() {
        branches.push(Branch(plus, minus, input, 0.0));
    }
    let injected = match bridge.supply() {
        Supply::ConstantVoltage { volts } => {
            branches.push(Branch(1, 0, supply_ohm, volts));
            None
        }
        Supply::ConstantCurrent { amperes } => Some((1, amperes)),
    };
    let voltages = node_voltages(nodes + 2, &branches, injected);
    voltages[plus] - voltages[minus]
}

fn layouts() -> impl Strategy<Value = BridgeLayout> {
    prop_oneof![
        Just(BridgeLayout::Quarter),
        Just(BridgeLayout::HalfBending),
        Just(BridgeLayout::HalfOpposite),
        (0.0..0.5).prop_map(|poisson_ratio| BridgeLayout::HalfPoisson { poisson_ratio }),
        Just(BridgeLayout::Full),
        (0.0..0.5).prop_map(|poisson_ratio| BridgeLayout::FullPoisson { poisson_ratio }),
    ]
}

fn laws() -> impl Strategy<Value = ArmLaw> {
    let slope = prop_oneof![1.5..3.0, 90.0..180.0, -150.0..-90.0];
    (-0.05..0.05, slope, prop_oneof![Just(0.0), -3000.0..12000.0])
        .prop_map(|(offset, linear, quadratic)| ArmLaw::new(offset, linear, quadratic).unwrap())
}

fn supplies() -> impl Strategy<Value = Supply> {
    prop_oneof![
        (1.0..30.0).prop_map(|volts| Supply::ConstantVoltage { volts }),
        (-30.0..-1.0).prop_map(|volts| Supply::ConstantVoltage { volts }),
        (1e-3..2e-2).prop_map(|amperes| Supply::ConstantCurrent { amperes }),
    ]
}

fn wires() -> impl Strategy<Value = Leads> {
    prop_oneof![
        Just(Leads::None),
        (0.0..200.0).prop_map(|lead_ohm| Leads::TwoWire { lead_ohm }),
        (0.0..200.0).prop_map(|lead_ohm| Leads::ThreeWire { lead_ohm }),
        (0.0..200.0).prop_map(|lead_ohm| Leads::FourWire { lead_ohm }),
    ]
}

prop_compose! {
    /// Any bridge, with three-wire leads only where they fit.
    fn bridges()(
        layout in layouts(), law in laws(), supply in supplies(), leads in wires(),
        arm in 100.0..6000.0, input in prop_oneof![Just(None), (500.0..1e6).prop_map(Some)],
    ) -> Bridge {
        let leads = if leads.fits(&layout) { leads } else { Leads::None };
        let bridge = Bridge::new(layout, law, arm, supply).unwrap().with_leads(leads).unwrap();
        match input {
            Some(ohm) => bridge.with_input_resistance_ohm(ohm).unwrap(),
            None => bridge,
        }
    }
}

/// A strain within the range of the bridge; `place` runs from 0 to 1.
fn strain_at(bridge: &Bridge, place: f64) -> f64 {
    let (low, high) = bridge.strain_range();
    low + place * (high - low)
}

/// Largest voltage in the circuit, V.
fn scale_v(bridge: &Bridge) -> f64 {
    match bridge.supply() {
        Supply::ConstantVoltage { volts } => volts.abs(),
        Supply::ConstantCurrent { amperes } => amperes.abs() * bridge.arm_resistance_ohm(),
    }
}

proptest! {
    #[test]
    fn output_satisfies_kirchhoff(bridge in bridges(), place in 0.001..0.999_f64) {
        let strain = strain_at(&bridge, place);
        let exact = bridge.output_v(strain).unwrap();
        let oracle = kirchhoff(&bridge, strain);
        prop_assert!((exact - oracle).abs() < 1e-11 * scale_v(&bridge), "{exact} {oracle}");
    }

    #[test]
    fn sensitivity_is_the_slope_of_kirchhoff(bridge in bridges()) {
        let (low, high) = bridge.strain_range();
        let step = 1e-4 * low.abs().min(high);
        let slope = (kirchhoff(&bridge, step) - kirchhoff(&bridge, -step)) / (2.0 * step);
        let exact = bridge.small_signal_sensitivity();
        prop_assert!((exact - slope).abs() < 1e-6 * exact.abs(), "{exact} {slope}");
    }

    #[test]
    fn slope_under_strain_is_that_of_kirchhoff(bridge in bridges(), place in 0.05..0.95_f64) {
        let (low, high) = bridge.strain_range();
        let strain = strain_at(&bridge, place);
        let step = 1e-4 * (strain - low).min(high - strain);
        let rise = kirchhoff(&bridge, strain + step) - kirchhoff(&bridge, strain - step);
        let slope = bridge.output_and_slope(strain).1;
        // Numerical differentiation loses ten of sixteen digits where the output saturates.
        let tolerance = 1e-6 * slope.abs() + 1e-12 * scale_v(&bridge) / step;
        prop_assert!((slope - rise / (2.0 * step)).abs() < tolerance, "{slope}");
    }

    #[test]
    fn thevenin_resistance_is_the_load_that_halves_the_volts(bridge in bridges()) {
        let strain = strain_at(&bridge, 0.3);
        let open = Bridge::derive(
            bridge.layout, bridge.law, bridge.arm_resistance_ohm, bridge.supply, bridge.leads, None,
        );
        let c = bridge.layout.arm_factors()
            .map(|f| f.map_or(0.0, |f| bridge.law.change_from_zero(f * strain)));
        let ohm = open.network.output_resistance(c) * open.arm_resistance_ohm;
        let halved = kirchhoff(&open.with_input_resistance_ohm(ohm).unwrap(), strain);
        let full = kirchhoff(&open, strain);
        prop_assert!((2.0 * halved - full).abs() < 1e-11 * scale_v(&bridge));
    }

    #[test]
    fn strain_inverts_output(bridge in bridges(), place in 0.001..0.999_f64) {
        let strain = strain_at(&bridge, place);
        let (volts, slope) = bridge.output_and_slope(strain);
        let back = bridge.strain(volts).unwrap();
        let conditioned = strain.abs() + (volts / slope).abs();
        prop_assert!((back - strain).abs() < 1e-13 * conditioned, "{strain} {back}");
    }

    #[test]
    fn strain_agrees_with_bisection(bridge in bridges(), place in 0.01..0.99_f64) {
        let (mut low, mut high) = bridge.strain_range();
        let (at_low, at_high) = (kirchhoff(&bridge, low), kirchhoff(&bridge, high));
        let volts = at_low + place * (at_high - at_low);
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            let below = kirchhoff(&bridge, middle) < volts;
            if below == (at_low < at_high) { low = middle } else { high = middle }
        }
        let found = bridge.strain(volts).unwrap();
        let slope = bridge.output_and_slope(found).1;
        let tolerance = 1e-11 * (scale_v(&bridge) / slope).abs();
        prop_assert!((found - low).abs() < tolerance, "{found} {low}");
    }

    #[test]
    fn small_strains_keep_every_digit(exponent in -15.0..-4.0_f64, gage_factor in 2.0..160.0_f64) {
        let strain = 10_f64.powf(exponent);
        let law = ArmLaw::foil(gage_factor).unwrap();
        let supply = Supply::ConstantVoltage { volts: 22.5 };
        let quarter = Bridge::new(BridgeLayout::Quarter, law, 350.0, supply).unwrap();
        // The textbook formula E δ / (2 (2 + δ)).
        let change = gage_factor * strain;
        let closed = 22.5 * change / (2.0 * (2.0 + change));
        let exact = quarter.output_v(strain).unwrap();
        prop_assert!((exact / closed - 1.0).abs() < 2e-15);
        prop_assert!((quarter.strain(exact).unwrap() / strain - 1.0).abs() < 1e-13);
    }
}

fn semiconductor() -> ArmLaw {
    let gage = Gage::new(156.3, 2800.0, 298.15, 5900.0).unwrap();
    ArmLaw::from_gage(&gage.bond(5784.0, 299.8).unwrap(), 299.8, 0.0).unwrap()
}

#[test]
fn linear_bridges_follow_their_bridge_factor() {
    let law = ArmLaw::foil(157.0).unwrap();
    let supply = Supply::ConstantVoltage { volts: 22.5 };
    let poisson_ratio = 0.3;
    for (layout, factor) in [
        (BridgeLayout::Quarter, 1.0),
        (BridgeLayout::HalfBending, 2.0),
        (BridgeLayout::HalfOpposite, 2.0),
        (BridgeLayout::HalfPoisson { poisson_ratio }, 1.3),
        (BridgeLayout::Full, 4.0),
        (BridgeLayout::FullPoisson { poisson_ratio }, 2.6),
    ] {
        let bridge = Bridge::new(layout, law, 5784.0, supply).unwrap();
        let expected = factor / 4.0 * 22.5 * 157.0;
        assert!((bridge.small_signal_sensitivity() - expected).abs() < 1e-10);
        assert!((layout.ideal_output_v(22.5, 157.0, 1e-6) - expected * 1e-6).abs() < 1e-15);
    }
}

#[test]
fn full_bending_bridge_of_foil_gages_is_exactly_linear() {
    let supply = Supply::ConstantVoltage { volts: 10.0 };
    let law = ArmLaw::foil(2.0).unwrap();
    let bridge = Bridge::new(BridgeLayout::Full, law, 350.0, supply).unwrap();
    // E GF ε: the arm sums never change. 10 * 2 * 0.2 = 4 V.
    assert!((bridge.output_v(0.2).unwrap() - 4.0).abs() < 1e-14);
}

#[test]
fn two_wire_leads_move_the_zero_and_three_wire_leads_do_not() {
    let supply = Supply::ConstantVoltage { volts: 22.5 };
    let quarter = Bridge::new(BridgeLayout::Quarter, semiconductor(), 5784.0, supply).unwrap();
    let two = quarter
        .with_leads(Leads::TwoWire { lead_ohm: 10.0 })
        .unwrap();
    let three = quarter
        .with_leads(Leads::ThreeWire { lead_ohm: 10.0 })
        .unwrap();
    // 22.5 V * (1/2 - 5784/11588).
    let expected = 22.5 * (0.5 - 5784.0 / 11588.0);
    assert!((two.zero_output_v() - expected).abs() < 1e-14);
    assert_eq!(three.zero_output_v(), 0.0);
    assert_eq!(quarter.zero_output_v(), 0.0);
}

#[test]
fn drift_cancels_between_two_gages_but_not_with_one() {
    let gage = Gage::new(156.3, 2800.0, 298.15, 5900.0)
        .unwrap()
        .bond(5784.0, 299.8)
        .unwrap();
    let warm = ArmLaw::from_gage(&gage, 305.0, 0.02).unwrap();
    let supply = Supply::ConstantVoltage { volts: 22.5 };
    let half = Bridge::new(BridgeLayout::HalfBending, warm, 5784.0, supply).unwrap();
    assert_eq!(half.zero_output_v(), 0.0);
    let quarter = Bridge::new(BridgeLayout::Quarter, warm, 5784.0, supply).unwrap();
    let ohm = gage.resistance_ohm(0.0, 305.0, 0.02).unwrap();
    let expected = 22.5 * (0.5 - 5784.0 / (5784.0 + ohm));
    assert!((quarter.zero_output_v() - expected).abs() < 1e-13);
    assert!(
        expected > 0.1,
        "2 percent of drift is over 0.1 V: {expected}"
    );
}

#[test]
fn ranges_end_at_the_vertex_or_at_no_resistance() {
    // 1 + 100 x + 2400 x² = (1 + 40 x)(1 + 60 x): no resistance at -1/60.
    let (low, high) = ArmLaw::new(0.0, 100.0, 2400.0).unwrap().strain_range();
    assert!((low + 1.0 / 60.0).abs() < 1e-16 && high == 1.0);
    // Half of the arm and half the coefficients: the same root.
    let (low, _) = ArmLaw::new(-0.5, 50.0, 1200.0).unwrap().strain_range();
    assert!((low + 1.0 / 60.0).abs() < 1e-16);
    // Vertex at -100/20000 with 3/4 of the resistance left; N-type is mirrored.
    assert_eq!(
        ArmLaw::new(0.0, 100.0, 10000.0).unwrap().strain_range(),
        (-0.005, 1.0)
    );
    assert_eq!(
        ArmLaw::new(0.0, -100.0, 10000.0).unwrap().strain_range(),
        (-1.0, 0.005)
    );
    let law = ArmLaw::new(0.0, 100.0, 10000.0).unwrap();
    let supply = Supply::ConstantVoltage { volts: 1.0 };
    let half = Bridge::new(BridgeLayout::HalfBending, law, 1000.0, supply).unwrap();
    assert_eq!(half.strain_range(), (-0.005, 0.005));
}

#[test]
fn misuse_is_refused() {
    let law = semiconductor();
    let supply = Supply::ConstantVoltage { volts: 22.5 };
    let full = Bridge::new(BridgeLayout::Full, law, 5784.0, supply).unwrap();
    let three = full.with_leads(Leads::ThreeWire { lead_ohm: 1.0 });
    assert!(matches!(three, Err(BridgeError::LeadsDoNotFit { .. })));
    let (low, high) = full.strain_range();
    for volts in [
        1.01 * full.output_v(high).unwrap(),
        1.01 * full.output_v(low).unwrap(),
        f64::NAN,
    ] {
        assert!(matches!(
            full.strain(volts),
            Err(BridgeError::VoltageOutOfRange { .. })
        ));
    }
    for strain in [1.01 * high, 1.01 * low, f64::NAN] {
        assert!(matches!(
            full.output_v(strain),
            Err(BridgeError::StrainOutOfRange { .. })
        ));
    }
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(Bridge::new(BridgeLayout::Full, law, bad, supply).is_err());
        assert!(full.with_input_resistance_ohm(bad).is_err());
    }
    assert!(full.with_leads(Leads::TwoWire { lead_ohm: -1.0 }).is_err());
    let no_volts = Supply::ConstantVoltage { volts: 0.0 };
    assert!(Bridge::new(BridgeLayout::Full, law, 350.0, no_volts).is_err());
    let layout = BridgeLayout::FullPoisson { poisson_ratio: 0.6 };
    assert!(Bridge::new(layout, law, 350.0, supply).is_err());
    assert!(ArmLaw::new(-1.0, 2.0, 0.0).is_err() && ArmLaw::foil(0.0).is_err());
}

#[test]
fn the_ends_of_the_range_convert_back() {
    let supply = Supply::ConstantVoltage { volts: 22.5 };
    for layout in [
        BridgeLayout::Quarter,
        BridgeLayout::HalfBending,
        BridgeLayout::Full,
    ] {
        let bridge = Bridge::new(layout, semiconductor(), 5784.0, supply).unwrap();
        let (low, high) = bridge.strain_range();
        for end in [low, high] {
            let back = bridge.strain(bridge.output_v(end).unwrap()).unwrap();
            // The slope is small at the far end, which amplifies rounding errors of the voltage.
            assert!(
                (back - end).abs() < 1e-9 * end.abs(),
                "{layout:?} {end} {back}"
            );
        }
    }
}

/// A full semiconductor bridge saturates at both ends, where a rounding of the output outweighs one
/// of the strain and the iteration must still terminate.
#[test]
fn a_saturating_bridge_converts_back_over_its_whole_range() {
    let law = ArmLaw::new(-0.0022, 141.9, 2062.8).unwrap();
    let supply = Supply::ConstantVoltage { volts: 17.94 };
    let bridge = Bridge::new(BridgeLayout::Full, law, 100.0, supply).unwrap();
    let end = bridge.output_v(bridge.strain_range().1).unwrap();
    for step in -9999..10000 {
        let volts = end * f64::from(step) / 1e4;
        let strain = bridge.strain(volts).unwrap();
        assert!(
            (bridge.output_v(strain).unwrap() - volts).abs() < 1e-13,
            "{volts} {strain}"
        );
    }
}
