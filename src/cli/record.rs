//! `gib record`: from the ring that a control fills at servo rate into files.

use std::fmt::Write;
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Args;
use gib::recording::ring::{self, Batch, Ring};
use gib::recording::sink::{Head, Rotation, Rows};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use super::{Answer, Result};

/// Records what a control's recorder puts out at servo rate, until Ctrl-C, `--for`, or the control's end
#[derive(Args)]
pub struct Record {
    /// Name of the recorder; may be left out when only one runs
    name: Option<String>,
    /// The file to write, .csv or .parquet (where built in); never written over
    #[arg(long, value_name = "FILE", required_unless_present = "list")]
    out: Option<PathBuf>,
    /// End after this many seconds of recording
    #[arg(long = "for", value_name = "SECONDS", value_parser = seconds)]
    length_s: Option<f64>,
    /// Begin a new file, numbered run-0001.csv and so on, every so many seconds of recording
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    rotate: Option<f64>,
    /// Keep only the newest so many files of a rotation
    #[arg(long, value_name = "FILES", requires = "rotate", value_parser = clap::value_parser!(u32).range(1..))]
    keep: Option<u32>,
    /// Begin with the oldest row that is still in the ring, not with the next: what happened just now
    #[arg(long)]
    history: bool,
    /// Show the recorders that are there, and end
    #[arg(long)]
    list: bool,
}

fn seconds(text: &str) -> std::result::Result<f64, String> {
    let value: Option<f64> = text.parse().ok().filter(|value: &f64| (1e-3..=1e9).contains(value));
    value.ok_or_else(|| "seconds, 0.001 to 1000000000".into())
}

impl Record {
    /// Records until something ends it.
    pub fn run(&self) -> Result {
        let (false, Some(out)) = (self.list, &self.out) else { return list() };
        let mut ring = Ring::open(&self.choose()?)?;
        if self.history {
            ring.rewind();
        }
        let stop = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            signal_hook::flag::register(signal, Arc::clone(&stop))?;
        }
        let rows_of = |seconds: f64| ((seconds / ring.shape.row_s()).round() as u64).max(1);
        let (rotate, most) = (self.rotate.map_or(0, rows_of), self.length_s.map_or(u64::MAX, rows_of));
        let head = Head { machine: ring.machine.clone(), columns: ring.columns.clone() };
        let mut files = Rotation::create(out, head, rotate, self.keep.map_or(0, |keep| keep as usize))
            .map_err(|why| format!("{}: cannot be written: {why}", out.display()))?;
        let (end, why) = match drain(&mut ring, &mut files, most, &stop) {
            Ok(end) => (end, None),
            Err(why) => ("", Some(why)),
        };
        let finished = files.finish();
        match why.or(finished.err()) {
            None => Ok(Answer::good(summary(&ring, &files, end))),
            Some(why) => Err(broken(&files, &why).into()),
        }
    }

    /// The recorder that is meant.
    fn choose(&self) -> std::result::Result<String, String> {
        match (&self.name, ring::rings().as_slice()) {
            (Some(name), _) => Ok(name.clone()),
            (None, [one]) => Ok(one.clone()),
            (None, []) => Err("no recorder runs; start one in the control first".into()),
            (None, several) => Err(format!("several recorders run; name one of: {}", several.join(", "))),
        }
    }
}

/// Takes rows until the end; says what ended it.
fn drain(ring: &mut Ring, files: &mut Rotation, most: u64, stop: &AtomicBool) -> io::Result<&'static str> {
    // Often enough to be far from the ring's end, seldom enough to cost nothing.
    let ring_s = ring.shape.capacity as f64 * ring.shape.row_s();
    let pause = Duration::from_secs_f64((0.1 * ring_s).clamp(0.0005, 0.05));
    let (row_s, columns) = (ring.shape.row_s(), ring.columns.len());
    let (mut values, mut idle) = (Vec::new(), Duration::ZERO);
    loop {
        // Looked at before the ring, so that all that was there when it came is written.
        let stopped = stop.load(Ordering::Relaxed);
        values.clear();
        let Batch { first, rows, lost, ended } = ring.read(&mut values)?;
        let left = usize::try_from(most - files.written.rows).unwrap_or(usize::MAX);
        values.truncate(left.saturating_mul(columns));
        if rows > 0 {
            idle = Duration::ZERO;
            files.write(&Rows { first_s: first as f64 * row_s, row_s, lost, values: &values })?;
        }
        if files.written.rows >= most {
            return Ok("its time was over");
        }
        if ended {
            return Ok("the control ended the recorder");
        }
        if stopped && files.written.rows > 0 {
            return Ok("stopped");
        }
        if rows == 0 {
            if idle > Duration::from_millis(500) && !ring.writer_lives() {
                return Ok("the control is gone");
            }
            if stopped && idle > Duration::from_millis(200) {
                return Ok("stopped before a row came");
            }
            std::thread::sleep(pause);
            idle += pause;
        }
    }
}

fn summary(ring: &Ring, files: &Rotation, end: &str) -> String {
    let written = &files.written;
    let mut text = format!(
        "{}: {} rows of machine {}, {:.3} s, {} columns; {end}\n",
        files.file().display(),
        written.rows,
        ring.machine,
        written.rows as f64 * ring.shape.row_s(),
        ring.columns.len()
    );
    if written.files > 1 {
        let _ = writeln!(text, "{} files, {} of them removed again", written.files, written.removed);
    }
    if written.lost > 0 {
        let _ = writeln!(
            text,
            "{} rows lost at {} places, where column {}.lost_rows counts them: this program or the disk was too slow",
            written.lost, written.gaps, ring.machine
        );
    }
    text
}

fn broken(files: &Rotation, why: &io::Error) -> String {
    let name = files.file().display();
    let rows = files.written.rows;
    match why.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            format!("{name}: the disk is full; the {rows} rows written before are whole and can be read")
        }
        _ => format!("{name}: {why}; the {rows} rows written before are whole and can be read"),
    }
}

fn list() -> Result {
    let mut text = String::new();
    for name in ring::rings() {
        match Ring::open(&name) {
            Ok(ring) => {
                let alive = if ring.writer_lives() { "recording" } else { "its writer is gone" };
                let (machine, rate) = (&ring.machine, 1.0 / ring.shape.row_s());
                let columns = ring.columns.join(",");
                let _ = writeln!(text, "{name}: machine {machine}, {rate:.0} rows/s, {alive}: {columns}");
            }
            Err(why) => {
                let _ = writeln!(text, "{why}");
            }
        }
    }
    if text.is_empty() {
        text = "no recorder runs\n".into();
    }
    Ok(Answer::good(text))
}
