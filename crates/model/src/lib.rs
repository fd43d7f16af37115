//! Mechanics of a reaction-torque stand.
