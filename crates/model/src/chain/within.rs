//! Links that change how the stand moves, in a stand with torques: these act on the motion of the whole.

use num_complex::Complex64;

use super::Chain;
use crate::effects::Action;

impl Chain {
    /// A body coupled to the stand becomes a part of it. A change of its stiffness is included as it is at the natural
    /// frequency, where the stand moves most; at other frequencies, what differs from that remains a factor after the
    /// motion.
    pub(super) fn with_links_within(mut self) -> Self {
        for link in &mut self.links {
            let nothing = Action::Factor(Box::new(|_, _| Complex64::ONE));
            match &link.action {
                Action::Body { coupled, .. } => {
                    if let Some(stand) = coupled(&self.stand) {
                        self.stand = stand;
                        link.action = nothing;
                    }
                }
                Action::Stiffness(change) => {
                    let Some(stiffened) = self.stand.stiffened(change) else {
                        continue;
                    };
                    let plain = std::mem::replace(&mut self.stand, stiffened);
                    let Action::Stiffness(change) = std::mem::replace(&mut link.action, nothing)
                    else {
                        continue;
                    };
                    link.action = Action::Factor(Box::new(move |stand, omega| {
                        let inverse =
                            plain.inverse_with(omega, |mode, own| change(mode, omega, own));
                        (inverse * stand.response(omega)).inv()
                    }));
                }
                _ => {}
            }
        }
        self
    }
}
