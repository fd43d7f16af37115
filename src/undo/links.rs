//! The links of a stand's chain in the order of `simulate`, and what is linear among them.

use std::sync::Arc;

use num_complex::Complex64;
use torqcomp_model::effects::{Action, Mode, Stage};
use torqcomp_model::simulate::Fixed;

use crate::failure::Failure;
use crate::stand::Stand;

/// Response at rest, relative to that at the natural frequency, below which a link passes no constant.
const NONE_AT_REST: f64 = 1e-9;

/// A link of the chain.
pub struct Link {
    /// Its effect; `recorder` for the recorder of the stand file.
    pub effect: &'static str,
    /// Its form.
    pub form: &'static str,
    /// Where it sits.
    pub stage: Stage,
    /// Its parameters.
    pub values: Vec<f64>,
    /// What it does; nothing here for the recorder.
    pub action: Option<Action>,
    /// The recorder's response.
    recorder: Option<Fixed>,
}

/// Links that are taken back together.
pub enum Group<'a> {
    /// Torques of the stand.
    Stand(Vec<&'a Link>),
    /// Factors and terms of the response.
    Linear(Vec<&'a Link>),
    /// A change of samples.
    Curve(&'a Link),
}

/// What is done about a link.
#[must_use]
pub fn treatment(link: &Link) -> &'static str {
    match &link.action {
        None | Some(Action::Factor(_) | Action::Feedthrough(_)) => "divided out",
        Some(Action::Lines(_) | Action::Course(_)) => "subtracted",
        Some(Action::Transform { .. }) if ["linear", "exponential"].contains(&link.form) => {
            "subtracted"
        }
        Some(Action::Transform { undo: None, .. }) if link.stage == Stage::Limit => "marked",
        Some(Action::Transform { .. }) => "inverted",
        Some(Action::Torque { torque, .. }) => {
            if torque.begin(1.0) == [0.0; 2] {
                "inverted"
            } else {
                "integrated"
            }
        }
    }
}

impl Link {
    /// Whether it does that.
    pub fn is(&self, what: &dyn Fn(&Action) -> bool) -> bool {
        self.action.as_ref().is_some_and(what)
    }

    /// Whether its inverse has an impulse response that dies out.
    pub fn dies_out(&self, mode: &Mode) -> bool {
        match &self.action {
            Some(Action::Factor(factor)) => crate::stand::is_smooth_at_rest(factor, mode),
            _ => true,
        }
    }

    /// Its factor at a frequency, with what comes before it.
    fn factor(&self, before: Complex64, mode: &Mode, hz: f64) -> Complex64 {
        let omega = std::f64::consts::TAU * hz;
        match (&self.action, &self.recorder) {
            (Some(Action::Factor(factor)), _) => factor(mode, omega),
            (Some(Action::Feedthrough(term)), _) => 1.0 + term(mode, omega) / before,
            (None, Some(recorder)) => recorder(hz),
            _ => Complex64::ONE,
        }
    }

    /// Whether it is a factor or a term of the response.
    pub fn is_linear(&self) -> bool {
        self.action.is_none()
            || self.is(&|a| matches!(a, Action::Factor(_) | Action::Feedthrough(_)))
    }

    /// Whether it passes no constant.
    pub fn blocks(&self, mode: &Mode) -> bool {
        match &self.action {
            Some(Action::Factor(factor)) => {
                factor(mode, 0.0).norm() < NONE_AT_REST * factor(mode, mode.omega_rad_s).norm()
            }
            _ => false,
        }
    }
}

/// The links of a stand, in order.
///
/// # Errors
/// If two of them cannot be taken back together.
pub fn of(stand: &Stand) -> Result<Vec<Link>, Failure> {
    let recorder = stand.recorder.recorder.clone();
    let mut links = vec![Link {
        effect: "recorder",
        form: "",
        stage: Stage::Chain,
        values: Vec::new(),
        action: None,
        recorder: Some(Arc::new(move |hz| recorder.response(hz))),
    }];
    for declared in &stand.effects {
        let (stage, action) = declared.action();
        links.push(Link {
            effect: declared.effect.name,
            form: declared.form.name,
            stage,
            values: declared.values.clone(),
            action: Some(action),
            recorder: None,
        });
    }
    // Stable: the recorder stays before what else is in the chain.
    links.sort_by_key(|link| link.stage);
    let coupled = links
        .iter()
        .position(|link| link.is(&|a| matches!(a, Action::Feedthrough(_))));
    let bent = |link: &&Link| {
        link.stage < Stage::Chain && link.is(&|a| matches!(a, Action::Transform { .. }))
    };
    if let (Some(coupled), Some(curve)) = (coupled, links.iter().find(bent)) {
        return Err(Failure::failed(format_args!(
            "{}: \"{}\" reaches the record past the stand, and \"{}\" bends what comes through it; the two cannot \
             be taken back together; leave the smaller one out",
            stand.file, links[coupled].effect, curve.effect
        )));
    }
    Ok(links)
}

/// Links that are taken back together, in order; disturbances are not among them.
pub fn groups(links: &[Link]) -> Vec<Group<'_>> {
    let mut groups = Vec::new();
    for link in links.iter().filter(|l| l.stage != Stage::Disturbance) {
        let torque = link.is(&|a| matches!(a, Action::Torque { .. }));
        match groups.last_mut() {
            Some(Group::Stand(group)) if torque => group.push(link),
            Some(Group::Linear(group)) if link.is_linear() => group.push(link),
            _ if torque => groups.push(Group::Stand(vec![link])),
            _ if link.is_linear() => groups.push(Group::Linear(vec![link])),
            _ => groups.push(Group::Curve(link)),
        }
    }
    groups
}

/// What some of the linear links make of what comes to them, at a frequency.
pub fn response(all: &[Link], mode: &Mode, hz: f64, some: impl Fn(&Link) -> bool) -> Complex64 {
    let mut through = mode.response(std::f64::consts::TAU * hz);
    let mut product = Complex64::ONE;
    for link in all.iter().filter(|link| link.is_linear()) {
        let factor = link.factor(through, mode, hz);
        through *= factor;
        if some(link) {
            product *= factor;
        }
    }
    product
}

/// What torques of the stand add to the record through couplings past it, at a frequency, if there are any among
/// these links.
pub fn coupled<'a>(some: &'a [&Link], mode: Mode) -> Option<impl Fn(f64) -> Complex64 + 'a> {
    let couples = |link: &Link| link.is(&|a| matches!(a, Action::Feedthrough(_)));
    some.iter().any(|link| couples(link)).then_some(move |hz| {
        let omega = std::f64::consts::TAU * hz;
        let mut sum = Complex64::ZERO;
        for link in some {
            match &link.action {
                Some(Action::Feedthrough(term)) => sum += term(&mode, omega),
                _ => sum *= link.factor(Complex64::ONE, &mode, hz),
            }
        }
        sum
    })
}

/// Takes off the slope that comes in where a link passes no constant: what it blocks is known but for a constant
/// at either end.
pub fn level(links: &[&Link], mode: Mode, before: &[f64], after: &mut [f64]) {
    if !links.iter().any(|link| link.blocks(&mode)) || after.len() < 2 {
        return;
    }
    let middle = 0.5 * (after.len() - 1) as f64;
    let (mut sum, mut squares) = (0.0, 0.0);
    for (i, (a, b)) in after.iter().zip(before).enumerate() {
        sum += (i as f64 - middle) * (a - b);
        squares += (i as f64 - middle).powi(2);
    }
    let slope = sum / squares;
    for (i, a) in after.iter_mut().enumerate() {
        *a -= slope * (i as f64 - middle);
    }
}
