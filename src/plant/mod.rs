//! Simulation: what an axis does, and what its motion says its motor must deliver.

pub mod motion;
