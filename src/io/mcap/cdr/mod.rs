//! Messages of ROS 2 in CDR, and messages of ROS 1, whose layout is CDR without padding.
//!
//! CDR: CORBA 3.4, part 2, 9.3; XCDR2 and the encapsulation: DDS-XTypes 1.3, 7.4 and 7.6.3.1.2.

pub mod plan;
pub mod size;
pub mod walk;

use std::sync::Arc;

use super::decode::{Damage, NameSearch, Reading, Targets};
use super::schema::{FieldKind, Schema};
use plan::{CdrPlan, Rules};
use walk::CdrWalk;

/// Size of the encapsulation header of a message.
const ENCAPSULATION: usize = 4;
/// Maximum padding after a message.
const TAIL: usize = 3;

/// Extracts wanted numbers from messages of one type.
pub struct CdrDecoder {
    schema: Arc<Schema>,
    targets: Targets,
    is_ros1: bool,
    has_wide_text: bool,
    /// For CDR (and ROS 1) and for XCDR2.
    layouts: [Option<CdrLayout>; 2],
}

/// Plans for the possible layouts of messages of an encapsulation.
struct CdrLayout {
    plans: Vec<CdrPlan>,
    chosen: usize,
    is_decided: bool,
}

impl CdrDecoder {
    /// Prepares for messages of one type that does not contain itself.
    pub fn new(schema: &Arc<Schema>, targets: Targets, is_ros1: bool) -> Self {
        let fields = schema.structs.iter().flat_map(|s| &s.fields);
        let has_wide_text = fields.map(|field| &field.kind).any(|mut kind| {
            while let FieldKind::Many(many) = kind {
                kind = &many.item;
            }
            *kind == FieldKind::WideText
        });
        Self {
            schema: Arc::clone(schema),
            targets,
            is_ros1,
            has_wide_text,
            layouts: [None, None],
        }
    }

    /// Reads a message.
    ///
    /// # Errors
    /// [`Damage`] if the message does not contain the value.
    pub fn read(&mut self, message: &[u8], reading: &mut Reading) -> Result<(), Damage> {
        let (is_big, is_second, data) = if self.is_ros1 {
            (false, false, message)
        } else {
            encapsulation(message)?
        };
        if self.layouts[usize::from(is_second)].is_none() {
            self.layouts[usize::from(is_second)] = Some(self.layout(is_second));
        }
        let Some(layout) = &mut self.layouts[usize::from(is_second)] else {
            return Err(Damage::Short);
        };
        if !layout.is_decided {
            layout.decide(data, is_big, reading);
        }
        let plan = &layout.plans[layout.chosen];
        let name = self.targets.value.lookup.as_ref();
        let name = name.map_or(&[][..], |lookup| lookup.name.as_bytes());
        let mut walk = CdrWalk {
            data,
            at: 0,
            is_big,
            plan,
            reading,
            names: NameSearch::default(),
        };
        if !plan.lookup.is_empty() {
            walk.names = NameSearch::search(name, |names| {
                (walk.at, walk.names) = (0, names);
                walk.follow(&plan.lookup)?;
                Ok(std::mem::take(&mut walk.names))
            })?;
            walk.at = 0;
            walk.reading.place = walk.names.found;
        }
        walk.follow(&plan.steps)
    }

    fn layout(&self, is_second: bool) -> CdrLayout {
        let rules = Rules {
            largest_align: match (self.is_ros1, is_second) {
                (true, _) => 1,
                (false, false) => 8,
                (false, true) => 4,
            },
            empty: u8::from(!self.is_ros1),
            wide: 4,
            size_ahead: is_second,
        };
        // Writers differ in the width of wide characters, and some omit the sizes that XCDR2
        // requires before lists: the messages decide.
        let wides: &[u8] = if self.has_wide_text { &[4, 2] } else { &[4] };
        let ahead: &[bool] = if is_second { &[true, false] } else { &[false] };
        let mut plans: Vec<CdrPlan> = Vec::new();
        for &size_ahead in ahead {
            for &wide in wides {
                let rules = Rules {
                    wide,
                    size_ahead,
                    ..rules
                };
                let plan = CdrPlan::new(&self.schema, &self.targets, rules);
                let is_new = plans.iter().all(|other| {
                    (&other.steps, &other.whole, &other.structs)
                        != (&plan.steps, &plan.whole, &plan.structs)
                        || other.rules.wide != plan.rules.wide
                });
                if is_new {
                    plans.push(plan);
                }
            }
        }
        CdrLayout {
            is_decided: plans.len() == 1,
            plans,
            chosen: 0,
        }
    }
}

impl CdrLayout {
    /// Chooses the plan by which the message ends where its bytes do.
    fn decide(&mut self, data: &[u8], is_big: bool, reading: &mut Reading) {
        let mut fitting = (0..self.plans.len()).filter(|place| {
            let plan = &self.plans[*place];
            let mut walk = CdrWalk {
                data,
                at: 0,
                is_big,
                plan,
                reading,
                names: NameSearch::default(),
            };
            walk.skip(&plan.whole).is_ok() && data.len() - walk.at <= TAIL
        });
        let (first, second) = (fitting.next(), fitting.next());
        drop(fitting);
        if let Some(first) = first {
            self.chosen = first;
            self.is_decided = second.is_none();
        }
    }
}

/// Byte order, whether it is XCDR2, and the message after the header.
fn encapsulation(message: &[u8]) -> Result<(bool, bool, &[u8]), Damage> {
    let Some((head, data)) = message.split_at_checked(ENCAPSULATION) else {
        return Err(Damage::Short);
    };
    match head[1] {
        0x00 => Ok((true, false, data)),
        0x01 => Ok((false, false, data)),
        0x06 | 0x10 => Ok((true, true, data)),
        0x07 | 0x11 => Ok((false, true, data)),
        other => Err(Damage::Encapsulation(other)),
    }
}

#[cfg(test)]
mod tests;
