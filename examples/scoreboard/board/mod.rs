//! The generator and its judge. A module of the example `scoreboard`, and of the test of that name.
//!
//! | file | purpose |
//! |---|---|
//! | [`random`] | numbers that a seed repeats |
//! | [`moves`] | what the interpolator asks |
//! | [`rig`] | the machine as believed, and its file |
//! | [`rough`] | what a rig may have that belief and vocabulary do not speak of |
//! | [`effects`], [`outside`] | what is hidden: causes of the vocabulary, and others |
//! | [`truth`], [`integrate`], [`record`] | the machine as it is, its motion, what the servo logs |
//! | [`case`] | a rig with something hidden, sized against the noise, as files |
//! | [`score`], [`table`] | what the command says of it, and the sum |

pub mod case;
pub mod effects;
pub mod integrate;
pub mod moves;
pub mod outside;
pub mod random;
pub mod record;
pub mod rig;
pub mod rough;
pub mod score;
pub mod table;
pub mod truth;
