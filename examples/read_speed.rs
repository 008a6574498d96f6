//! How fast a recording is read: `cargo run --release --example read_speed -- [megabytes]`.
//!
//! Writes a CSV of that size (default 100) to the temporary folder, as a 4 kHz recorder would, reads it five times on one
//! core and prints the best; beside it numpy.loadtxt and polars on one core, where `python3` has them ($PYTHON: another one).

use std::io::Write;
use std::process::Command;
use std::time::Instant;

/// What reads the same file elsewhere: name, and a line of Python.
const OTHERS: [(&str, &str); 2] = [
    ("numpy.loadtxt", "import numpy as m; read = lambda f: m.loadtxt(f, delimiter=',', skiprows=1)"),
    ("polars.read_csv", "import polars as m; read = lambda f: m.read_csv(f)"),
];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let megabytes: usize = std::env::args().nth(1).map_or(Ok(100), |text| text.parse())?;
    let path = std::env::temp_dir().join("gib_read_speed.csv");
    write(&path, megabytes * 1_000_000)?;
    let size = std::fs::metadata(&path)?.len() as f64 / 1e6;

    let mut best_s = f64::INFINITY;
    let mut rows = 0;
    for _ in 0..5 {
        let start = Instant::now();
        rows = gib::recording::Recording::open(&path)?.rows();
        best_s = best_s.min(start.elapsed().as_secs_f64());
    }
    println!("{size:.0} MB, {rows} rows, best of five, one core");
    let say = |name: &str, seconds: f64| println!("{name:24} {seconds:.3} s, {:.0} MB/s", size / seconds);
    say("gib, checked", best_s);
    for (name, import) in OTHERS {
        let timed = format!(
            "import sys, time\n{import}\nbest = 1e9\nfor i in range(5):\n    t = time.perf_counter(); read(sys.argv[1]); \
             best = min(best, time.perf_counter() - t)\nprint(best, m.__version__)"
        );
        let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
        let ran = Command::new(python).args(["-c", &timed]).arg(&path).env("POLARS_MAX_THREADS", "1").output();
        let said = ran.map(|out| String::from_utf8_lossy(&out.stdout).into_owned()).unwrap_or_default();
        match said.split_once(' ').and_then(|(s, version)| Some((s.parse().ok()?, version.trim()))) {
            Some((seconds, version)) => say(&format!("{name} {version}"), seconds),
            None => println!("{name:24} not here"),
        }
    }
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
