//! What can be read off a recording without a model of the machine.

pub mod homing;
pub mod inertia;
pub mod inspection;
pub mod lost_motion;
pub mod motion;
pub mod statistics;
pub mod tilt;
