//! Repetitive learning of a command that repeats each revolution (CN101206470, Okuma noncircular turning).
//!
//! The tool is to be at f(θ), it is told c(θ), it is detected at a(θ). Once a revolution the command is made better by what
//! was wrong:
//!
//! ```text
//! c(θ) ← c(θ) + γ·(f(θ+Δθ) − a(θ+Δθ))                      method published: per point, Δθ leads by the servo's lag
//! Ck ← Bk + γ·Ek/Gk,  k ≤ K                                method filtered (default): per harmonic of the revolution
//! ```
//!
//! # Why the filtered update does not diverge
//!
//! In the steady state of a stable linear machine harmonic k of the deviation is Ek = Fk − Gk·Ck, whatever the machine,
//! and no harmonic touches another. An update c ← Q(c + L·e) multiplies what is left of Ek by Q·(1 − L·Gk); it converges
//! where |Q·(1 − L·Gk)| < 1. Here Q is 1 up to harmonic K and 0 beyond: what is not learnt is never commanded, and a mode
//! up there is never fed. Up to K, L = γ/Gk with Gk measured: two revolutions with two commands give Gk = −ΔEk/ΔCk, so
//! that |1 − L·Gk| = 1 − γ. Until Gk is measured a trial may make Ek worse. So the best pair (Bk, its Ek) is kept, every trial
//! starts from it, and it is replaced only by one with a smaller |Ek|: |Ek| at Bk never grows, for any Gk. A trial is no
//! further from Bk than γ·|Ek|/|Gk| with |Gk| taken as 1/4 at least, and halved whenever it was worse.
//!
//! Angles in turns, positions in mm, corrections and deviations in µm.

pub mod config;
pub mod io;
pub mod lines;
pub mod machine;
pub mod plan;
pub mod points;
