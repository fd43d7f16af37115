use torqcomp_model::SecondOrder;

use super::*;
use crate::stand::{Given, StandResponse};

const MECHANICS: &str = "schema = \"torqcomp.stand/1\"\n[mechanics]\ninertia = \"5.85e-3 slug ft^2\"\n\
    damping = \"3.07 ft lbf s/rad\"\nstiffness = { value = \"8.1e4 ft lbf/rad\", std = \"0.2e4 ft lbf/rad\", \
    source = \"fitted: decay.csv\" }\n";

fn message(text: &str) -> String {
    parse("stand.toml", text).unwrap_err().to_string()
}

#[test]
fn constants_come_out_in_si() {
    let stand = parse("stand.toml", MECHANICS).unwrap();
    let mechanics = stand.mechanics.unwrap();
    let constants: SecondOrder = match mechanics.response {
        StandResponse::Constants(constants) => constants,
        StandResponse::Modes(_) => panic!(),
    };
    // 1 ft lbf = 1.3558179483314 N m; 1 slug ft² = 1.3558179483314 kg m².
    assert!((constants.inertia_kg_m2() / (5.85e-3 * 1.355_817_948_331_4) - 1.0).abs() < 1e-12);
    assert!(
        (constants.stiffness_n_m_per_rad() / (8.1e4 * 1.355_817_948_331_4) - 1.0).abs() < 1e-12
    );
    assert!(
        (mechanics.std.stiffness_n_m_per_rad.unwrap() / (0.2e4 * 1.355_817_948_331_4) - 1.0).abs()
            < 1e-12
    );
    let Given::Constants { stiffness, .. } = mechanics.given else {
        panic!()
    };
    assert_eq!(stiffness.source(), "fitted: decay.csv");
}

#[test]
fn other_units_and_modal_form() {
    let stand = parse(
        "s",
        "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"590 Hz\"\ndamping_ratio = 0.07\n\
         static_gain = \"2.5 mV/N\"\n",
    )
    .unwrap();
    let gain = stand.mechanics.unwrap().static_gain.unwrap();
    assert!((gain.value - 2.5e-3).abs() < 1e-15);
    assert_eq!(
        (gain.recorded_unit.as_str(), gain.applied_unit.as_str()),
        ("mV", "N")
    );
}

#[test]
fn mistakes_name_the_line_and_the_remedy() {
    for (from, to, parts) in [
        ("damping =", "dampign =", vec!["line 4", "damping"]),
        (
            "\"3.07 ft lbf s/rad\"",
            "3.07",
            vec!["line 4", "[mechanics] damping", "no unit", "N m s/rad"],
        ),
        (
            "\"3.07 ft lbf s/rad\"",
            "\"3.07 ft lbf\"",
            vec!["line 4", "dimension", "damping"],
        ),
        (
            "\"3.07 ft lbf s/rad\"",
            "\"3.07 ft lbff s/rad\"",
            vec!["line 4", "lbff", "did you mean"],
        ),
        (
            "8.1e4 ft",
            "-8.1e4 ft",
            vec!["line 5", "stiffness", "greater than zero"],
        ),
        (
            "source =",
            "sourec =",
            vec!["line 5", "sourec", "did you mean \"source\""],
        ),
        ("stand/1", "stand/7", vec!["line 1", "stand/7", "stand/1"]),
        (
            "[mechanics]",
            "[mechanic]",
            vec!["line 2", "mechanic", "did you mean \"mechanics\""],
        ),
        (
            "inertia = \"5",
            "inertia = \"5.85e-3 kg m^2\"\ninertia = \"5",
            vec!["line 4"],
        ),
        ("stiffness = {", "stiffness = [", vec!["line 5"]),
    ] {
        let text = MECHANICS.replacen(from, to, 1);
        let got = message(&text);
        for part in parts {
            assert!(got.contains(part), "{to}: {got:?} lacks {part:?}");
        }
    }
}

#[test]
fn missing_and_contradicting_entries_are_refused() {
    let lacks = MECHANICS.replace("inertia = \"5.85e-3 slug ft^2\"\n", "");
    assert!(message(&lacks).contains("inertia is missing"));
    let both = format!("{MECHANICS}natural_frequency = \"590 Hz\"\n");
    assert!(message(&both).contains("either"));
    let twice = "schema = \"torqcomp.stand/1\"\n[mechanics]\nnatural_frequency = \"590 Hz\"\ndamping_ratio = 0.07\n\
        static_gain = \"1 V/V\"\n[calibration]\ntorque_per_volt = \"1 N m/V\"\n";
    assert!(message(twice).contains("keep one"));
    assert!(message("name = \"x\"\n").contains("schema"));
    // 1/(2 Q) and δ/√(4π² + δ²).
    for (other, ratio) in [
        ("Q = 14", "0.03571"),
        ("q_factor = 14", "0.03571"),
        ("log_decrement = \"0.22\"", "0.03499"),
    ] {
        let decay = twice.replace("damping_ratio = 0.07", other);
        let wanted = format!("write damping_ratio = \"{ratio}\" in place of");
        assert!(message(&decay).contains(&wanted), "{other}");
    }
    let effect = format!("{MECHANICS}[[effects]]\nkind = \"cubic-stiffness\"\n");
    assert!(message(&effect).contains("coefficient is missing"));
}

#[test]
fn the_recorder_is_read() {
    let text = format!(
        "{MECHANICS}[recorder]\ngain = 100\nlow_pass = \"5 kHz\"\nlow_pass_order = 2\ndelay = \"20 us\"\n"
    );
    let stand = parse("s", &text).unwrap();
    assert_eq!(stand.recorder.recorder.gain(), 100.0);
    assert!((stand.recorder.recorder.response(5000.0).norm() - 0.5_f64.sqrt()).abs() < 1e-12);
    let wrong = text.replace("low_pass = \"5 kHz\"\n", "");
    assert!(message(&wrong).contains("low_pass = "));
}

#[test]
fn what_the_constants_share_is_no_part_of_the_response() {
    let with = |common: &str| {
        format!(
            "schema = \"torqcomp.stand/1\"\n[mechanics]\ninertia = {{ value = \"2 kg m^2\", std = \"0.1 kg m^2\" }}\n\
             damping = {{ value = \"3 N m s/rad\", std = \"0.15 N m s/rad\" }}\n\
             stiffness = {{ value = \"100 N m/rad\", std = \"13 N m/rad\" }}\ncommon_std = {common}\n"
        )
    };
    // Of 13 N m/rad, 5 % of 100 are common: √(13² − 5²) = 12 remain.
    let std = parse("s", &with("\"0.05\""))
        .unwrap()
        .mechanics
        .unwrap()
        .std;
    assert!((std.stiffness_n_m_per_rad.unwrap() - 12.0).abs() < 1e-9);
    assert!(std.inertia_kg_m2.unwrap() < 1e-8 && std.damping_n_m_s_per_rad.unwrap() < 1e-8);
    assert!(message(&with("\"0.06\"")).contains("common_std"));
}

#[test]
fn effects_may_say_how_sure_they_are() {
    let effect =
        "[[effects]]\nkind = \"time-delay\"\ndelay = { value = \"3e-5 s\", std = \"1e-7 s\" }\n";
    let stand = parse("s", &format!("{MECHANICS}{effect}")).unwrap();
    assert_eq!(stand.effects[0].values[0], 3e-5);
}
