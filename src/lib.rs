//! gib: the layer between an NC kernel and the metal. This page is the map of the rooms.
//!
//! Data flows one way: a room may use the rooms above it, never those below.
//!
//! | room | purpose |
//! |---|---|
//! | [`units`], [`error`] | conversions; status numbers and texts |
//! | [`cycle`] | HOT: one machine function a file or folder, called once per servo cycle |
//! | [`program`] | INA in the head of a part program: read, written, removed |
//! | [`recording`] | what was measured: columns, units, CSV, Parquet |
//! | [`machine`] | `machine.json`: belief and effects, the vocabulary of causes |
//! | [`plant`] | one axis under its servo: simulation and prediction |
//! | [`analysis`] | what can be read off a recording without a model: inspection, lost motion |
//! | [`diagnosis`] | where a simulation departs from the measurement, why, and what knowing it is worth |
//! | [`report`] | pictures |
//! | [`abi`] | the C surface: guard, types, one file a family; nothing but translation |

#![deny(unsafe_op_in_unsafe_fn)]
#![warn(missing_docs)]

pub mod error;
pub mod units;

pub mod cycle;

pub mod machine;
pub mod plant;
pub mod program;
pub mod recording;

pub mod analysis;
pub mod report;

pub mod diagnosis;

pub mod abi;
