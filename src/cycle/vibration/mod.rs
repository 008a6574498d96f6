//! Tool position corrected for vibration (CN101206470, Okuma noncircular turning).
//!
//! The X scale says where the tool is against the seat of its slide. Where it is against the workpiece follows from two
//! accelerometers, one on the seat (1) and one on the spindle bearing (2):
//!
//! ```text
//! position = scale + (x1 − x2)                     xi: displacement, from the acceleration ai
//! xi = gi·∬(ai − offset)          method integrate, as published: offsets of revolution N+1 close revolution N
//! xi = Σk −gi(k·Ω)·Ak/(k·Ω)²·e^(jkθ)       method harmonic: ai tracked as offset + Σk Ak·e^(jkθ), θ the spindle's angle
//! ```
//!
//! A second slide (XM) that carries the seat moves its accelerometer too: its encoder is subtracted from the seat's
//! displacement and added to the position. Acceleration in m/s², displacement in µm, positions in mm, Ω in rad/s.

pub mod config;
pub mod harmonic;
pub mod integrate;
pub mod io;
pub mod known;
pub mod machine;
pub mod plan;
pub mod sensor;
pub mod spindle;
