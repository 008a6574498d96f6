//! Simulation: what an axis does, and what its motion says its motor must deliver.

pub mod added;
pub mod at_rows;
pub mod axis;
mod behind;
pub mod between;
pub mod bridges;
pub mod closed_loop;
pub mod coupling;
mod cutoff;
pub mod friction;
pub mod lateness;
pub mod linear;
pub mod motion;
pub mod moves;
mod nearby;
pub mod noise;
pub mod observed;
mod pace;
pub mod physics;
pub mod plausible;
mod power;
pub mod predict;
pub mod servo;
pub mod simulate;
pub mod stamps;
pub mod stretches;
mod sudden;
