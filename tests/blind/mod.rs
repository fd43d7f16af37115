//! Blind records: a simulated stand with one effect that its stand file does not declare.
//!
//! Independent of torqcomp. The stand of the thesis with constants off by 2 to 20 per cent responds to a multisine or a
//! sweep over 1.6 s at 20 kHz; one effect of the [catalogue](catalogue), in one of its common definitions, is included
//! (or two or three of them, see [several](several)) with a strength between marginal and obvious; noise of 0.1 to 1
//! per cent of the signal is added. Inputs are known in continuous time ([excitation](excitation)), the equations of
//! motion are integrated at 32 steps per sample with every switch located ([integrate](integrate)).

pub mod anti_alias;
pub mod catalogue;
pub mod chain;
pub mod declared;
pub mod disturbance;
pub mod draw;
pub mod excitation;
pub mod friction;
pub mod integrate;
pub mod kinds;
pub mod linear;
pub mod plain_fit;
pub mod plant;
pub mod record;
pub mod restoring;
pub mod setting;
pub mod several;
pub mod sizing;
pub mod span;
pub mod truth;
pub mod unlisted;
pub mod wide;
pub mod write;
