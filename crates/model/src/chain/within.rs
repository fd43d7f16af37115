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
            link.action = match std::mem::replace(&mut link.action, nothing) {
                Action::Body { factor, coupled } => match coupled(&self.stand) {
                    Some(stand) => {
                        self.stand = stand;
                        continue;
                    }
                    None => Action::Body { factor, coupled },
                },
                Action::Stiffness(change) => match self.stand.stiffened(&change) {
                    Some(stiffened) => {
                        let plain = std::mem::replace(&mut self.stand, stiffened);
                        Action::Factor(Box::new(move |stand, omega| {
                            let own = |mode: &_, own| change(mode, omega, own);
                            (plain.inverse_with(omega, own) * stand.response(omega)).inv()
                        }))
                    }
                    None => Action::Stiffness(change),
                },
                other => other,
            };
        }
        self
    }
}
