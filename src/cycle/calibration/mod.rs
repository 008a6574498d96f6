//! Calibration of the two accelerometers of family `vibration` against a ball bar between them (CN101206470).
//!
//! The axis is driven by a sinusoid of each listed frequency, as large as stroke and torque allow. From one experiment
//! the ball bar gives the relative displacement Xd and the accelerometers give X1 (seat), X2 (bearing), complex amplitudes
//! in µm. Wanted are the complex gains of
//!
//! ```text
//! Xd = g1·X1 − g2·X2
//! ```
//!
//! Published: with x1 = A′·sin ωt, x2 = B′·sin(ωt+α), xd = D·sin(ωt+β), one experiment gives A = D·sin(α−β)/sin α and
//! B = −D·sin β/sin α, gains A/A′ and B/B′. (The print has both signs turned.) The two parts of a machine usually swing
//! against each other, α ≈ π, where sin α ≈ 0 magnifies every error. So the default is a least-squares fit over several
//! experiments (another workpiece, another place) that starts from "gain 1, within the sensor's tolerance".

pub mod config;
pub mod detect;
pub mod io;
pub mod machine;
pub mod plan;
pub mod solve;
pub mod table;
