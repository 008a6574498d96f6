//! Pictures for people: plots as SVG.

pub mod homing;
pub mod inertia;
pub mod lost_motion;
pub mod plot;
pub mod residual;
pub mod speed_variation;
