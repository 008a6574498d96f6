//! Tilt of the workpiece plane, seen in the spindle's load while cutting, and compensated.
//!
//! A workpiece that is clamped out of true is cut deeper on one side, and the spindle carries more there. A table,
//! built from cuts of known depth under one machining condition, turns load into depth; the slope of the depth over
//! the path is the tilt, θ = atan(|Δdepth| ÷ |Δposition|). Source: the published rule that physics calls `two_point`.
//! Different, and why: two readings carry all of their noise into the slope, and what the tool wears between them looks
//! like tilt; so the default fits a plane to the whole path ([`fit`]).
//!
//! | file | purpose |
//! |---|---|
//! | [`config`], [`plan`] | what the caller asks for; the same, checked, as constants of a cycle |
//! | [`table`] | depth → load of one machining condition, and the published two points |
//! | [`io`] | what crosses the boundary in a cycle |
//! | [`load`], [`trace`] | mean load of short blocks of the path; those that count |
//! | [`fit`], [`normal`] | line or plane through the blocks, wear beside it, outliers left out; its linear equations |
//! | [`verdict`] | tilt, its uncertainty and its axes; whether to compensate |
//! | [`kinematics`], [`follow`] | the offsets of six axes that undo it; brought in and out within bounds |
//! | [`machine`] | the state machine called once per servo cycle |

pub mod config;
pub mod fit;
pub mod follow;
pub mod io;
pub mod kinematics;
pub mod load;
pub mod machine;
pub mod normal;
pub mod plan;
pub mod table;
pub mod trace;
pub mod verdict;
