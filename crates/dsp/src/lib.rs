//! Signals of a reaction-torque stand.
