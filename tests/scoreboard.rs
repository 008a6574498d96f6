//! The laws of the generator that hides effects, and a small scoreboard of the diagnosis: a fixed part, whose cases never
//! change, and a fresh part, whose seed is printed. The whole board is `cargo run --release --example scoreboard`.

#[path = "../examples/scoreboard/board/mod.rs"]
#[allow(dead_code)]
mod board;
