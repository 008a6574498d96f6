//! Homing on a dead stop: press the axis against a fixed stop under a torque limit, and find the machine origin.
//!
//! The sequence follows CN104914785: set a torque limit, approach, press until the torque is limiting, clear the
//! deviation, move off by the zero offset. Different, and why: the home position is not where the limit was reached,
//! which depends on limit, speed and stiffness, but where the torque–position line starts ([`fit`]); and the stop is
//! touched several times with the same run-up, since chips, a tight spot or a slipping encoder do not repeat
//! ([`verdict`]).
//!
//! | file | purpose |
//! |---|---|
//! | [`config`], [`plan`] | what the caller asks for; the same, checked, as constants of a cycle |
//! | [`io`] | what crosses the boundary in a cycle |
//! | [`machine`] | the state machine called once per servo cycle |
//! | [`side`] | one motor on its way to the stop: torque filter, standstill, frozen sensors |
//! | [`trace`], [`fit`] | torque against position of a touch; the start of its line |
//! | [`verdict`] | agreement of the touches, uncertainty, what is reported |

pub mod config;
pub mod fit;
pub mod io;
pub mod machine;
pub mod plan;
pub mod side;
pub mod trace;
pub mod verdict;
