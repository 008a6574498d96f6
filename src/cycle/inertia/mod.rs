//! Inertia of a spindle and what it carries, from torque and speed while it accelerates and brakes.
//!
//! Torque balance of a rigid spindle, T in N·m, ω in rad/s:
//!
//! ```text
//! T = J·ω' + B·ω + Tc·sign(ω) (+ T0 where it turned both ways)
//! ```
//!
//! J (kg·m²), viscous B (N·m·s), Coulomb Tc (N·m) are fitted together: T/ω' alone counts friction as inertia. On the
//! cycle samples are gathered into blocks ([`blocks`]); the fit ([`fit`]) runs when the result is asked for.
//!
//! Source: CN103769945 (Okuma) for T = J·α and the machine's own J taken off; friction is not in the print.

pub mod blocks;
pub mod config;
pub mod doubt;
pub mod fit;
pub mod io;
pub mod kept;
pub mod machine;
pub mod plan;
pub mod report;
pub mod robust;
pub mod stretches;

#[cfg(test)]
mod spindle_tests;
