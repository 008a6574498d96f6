//! Spindle speed variation against chatter: how much of it the motor can do, and the speed command that does it.
//!
//! Around the mean speed S (rad/s) the speed swings by the share q in the period R (s). Torque and power of the motor:
//!
//! ```text
//! T(t) = J·ω' + B·ω + Tc + Tcut ≤ T_max,    T(t)·ω ≤ P_max,    S(1 − q) ≥ ω_min,    S(1 + q) ≤ ω_max
//! triangle ω' = ±4qS/R        sine ω' = (2π/R)·qS·cos φ,  ω = S(1 + q·sin φ)
//! ```
//!
//! Published (CN103769945, Okuma): Q = 4500·P·R/(2·S²·J) in %, S in rpm. That is the power at the *mean* speed, with
//! π² taken as 10: at the top of the swing the motor would have to give (1 + q) times as much. [`limit`] has both.

pub mod config;
pub mod io;
pub mod limit;
pub mod machine;
pub mod plan;
pub mod setting;

#[cfg(test)]
mod command_tests;
#[cfg(test)]
mod deadline_tests;
