//! HOT room: everything here is called once per servo cycle from a real-time thread.
//!
//! A function is `step(&Plan, &mut State, &Input) -> Output`: the plan is validated configuration with all
//! constants derived at setup, the state is plain data, time is counted in cycles. Nothing here allocates,
//! locks, reads a clock or can panic.

pub mod backlash;
pub mod calibration;
pub mod homing;
pub mod inertia;
pub mod lanes;
pub mod learning;
pub mod level;
pub mod profile;
pub mod recorder;
pub mod speed_variation;
pub mod tilt;
pub mod turns;
pub mod vibration;
