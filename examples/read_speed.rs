//! How fast a recording is read: `cargo run --release --example read_speed -- [megabytes]`.
//!
//! Writes a CSV of that size (default 100) to the temporary folder, as a 4 kHz recorder would, reads it five times on one
//! core and prints the best.

use std::io::Write;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let megabytes: usize = std::env::args().nth(1).map_or(Ok(100), |text| text.parse())?;
    let path = std::env::temp_dir().join("gib_read_speed.csv");
    write(&path, megabytes * 1_000_000)?;
    let bytes = std::fs::metadata(&path)?.len() as f64;

    let mut best_s = f64::INFINITY;
    let mut rows = 0;
    for _ in 0..5 {
        let start = Instant::now();
        rows = gib::recording::Recording::open(&path)?.rows();
        best_s = best_s.min(start.elapsed().as_secs_f64());
    }
    println!("{:.0} MB, {rows} rows: {best_s:.3} s, {:.0} MB/s", bytes / 1e6, bytes / 1e6 / best_s);
    Ok(std::fs::remove_file(&path)?)
}

fn write(path: &std::path::Path, bytes: usize) -> std::io::Result<()> {
    let mut out = std::io::BufWriter::new(std::fs::File::create(path)?);
    let mut written = out.write(b"time_s,x.position_command_mm,x.position_mm,x.table_position_mm,x.torque_nm\n")?;
    for i in 0.. {
        let t = f64::from(i) * 0.00025;
        let x = 200.0 + 150.0 * (0.7 * t).sin();
        let torque = 0.9 * (0.7 * t).cos().signum() + 0.05 * (1234.5 * t).sin();
        let row = format!("{t:.5},{x:.7},{:.7},{:.7},{torque:.5}\n", x - 1e-3, x - 2e-3);
        written += out.write(row.as_bytes())?;
        if written >= bytes {
            break;
        }
    }
    out.flush()
}
