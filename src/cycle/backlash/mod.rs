//! Lost motion of one axis, measured from motor torque alone and written back as compensation.
//!
//! The sequence follows CN103561904: compensation amount 0 and reversal acceleration off, to the reference
//! position in the first sense, reverse, step the motor and watch the torque; the same the other way; write the
//! mean, restore the rest. Two things are different, and why: the whole torque curve is fitted, since the
//! published break-away peak reads low ([`fit`]), and after each scan the motor goes a few µm back and forth
//! while the table sticks, since only that shows how much of the friction is on the motor's side and winds
//! nothing up ([`machine`]).
//!
//! | file | purpose |
//! |---|---|
//! | [`config`], [`plan`] | what the caller asks for; the same, checked, as constants of a cycle |
//! | [`io`] | what crosses the boundary in a cycle |
//! | [`machine`] | the state machine called once per servo cycle |
//! | [`curve`] | torque against travel |
//! | [`fit`] (its normal equations in `cholesky`, a release before the scan in `fit/unseen`), [`peak`] | lost motion from a curve: ours and the published rule |
//! | [`fitted`] | what a fit starts from, and what it finds |
//! | [`rounding`] | the table's presliding, from the same curve |
//! | [`uncertainty`] | what repeats, reversals alike and the shape of the presliding leave open |
//! | [`verdict`] | means, uncertainty, and whether to trust them |

mod cholesky;
pub mod config;
pub mod curve;
pub mod fit;
pub mod fitted;
pub mod io;
pub mod machine;
pub mod peak;
pub mod plan;
pub mod rounding;
pub mod uncertainty;
pub mod verdict;
