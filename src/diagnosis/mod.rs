//! Where a simulation departs from the measurement, why, and what knowing it is worth.
//!
//! A recording is turned into one system of equations (`frame`: motion, direction, judged rows; `filter`: the low-pass that
//! both sides go through). `causes` holds one law a cause; `fit` solves for a set of them, `select` finds the set,
//! `uncertainty` says how sure its parameters are, `gain` what the extended machine is worth on rows it was not fitted to,
//! `judge` whether anything is to be named at all (`foreign`: or is what has no name), and `verdict` the whole answer.
//!
//! T_measured(t + delay) = J·α + Tv·ω + Tc·sign(ω) + T0 + Σ causes, in the drive's own unit (N·m, or N for linear).

mod approach;
mod astray;
mod belief;
mod blocks;
mod by_loop;
pub mod causes;
mod choice;
mod columns;
mod contact;
mod creep;
mod excerpt;
pub mod experiment;
pub mod filter;
pub mod fit;
mod followed;
mod foreign;
mod form;
mod formulation;
pub mod frame;
pub mod gain;
mod grids;
mod holdout;
mod json;
mod judge;
mod known;
mod left;
mod looks;
mod low_limit;
mod many;
mod means;
mod missed;
mod narrow;
mod play;
pub mod progress;
mod quiet;
mod reopened;
mod replayed;
mod rivals;
mod rows;
pub mod sampling;
pub mod select;
mod shared;
pub mod show;
mod shrink;
mod steady;
mod suffices;
mod twin;
pub mod uncertainty;
mod valleys;
pub mod verdict;
mod whole;

pub use choice::axis_of;
pub use excerpt::Excerpt;
pub use left::{Left, Unexplained};
pub use progress::{Progress, Stopped};
pub use show::{Coordinate, View};
pub use verdict::{Diagnosis, Finding, Verdict, diagnose};
