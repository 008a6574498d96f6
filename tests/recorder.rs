//! The recorder from writer to file: no torn row is ever delivered, a slow reader loses oldest rows and knows how many, a
//! killed one harms nobody, and what is written stays readable.

use std::ffi::CString;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use gib::abi::recorder::{
    GibRecorder, GibRecorderConfig, gib_recorder_close, gib_recorder_free, gib_recorder_new, gib_recorder_start,
    gib_recorder_step, gib_recorder_step_from,
};
use gib::error::{GIB_BUSY, GIB_OK};
use gib::recording::Recording;
use gib::recording::ring::Ring;
use rustix::process::{Pid, Signal, kill_process};

const GIB: &str = env!("CARGO_BIN_EXE_gib");
const CHANNELS: u32 = 12;

/// The value of a channel in a row: any mixture of two rows shows.
fn value(row: u64, channel: u32) -> f64 {
    (row * 64 + u64::from(channel)) as f64
}

/// A writer on a thread of its own.
struct Writer {
    name: String,
    stop: Arc<AtomicBool>,
    rows: Arc<AtomicU64>,
    thread: Option<JoinHandle<()>>,
}

impl Writer {
    /// Writes until told to end: as fast as it can, or every so often.
    fn new(test: &str, capacity_rows: u32, pause: Option<Duration>) -> Writer {
        let name = format!("{test}-{}", std::process::id());
        let (stop, rows) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU64::new(0)));
        let (ready, begun) = std::sync::mpsc::channel();
        let (its_name, its_stop, its_rows) = (name.clone(), Arc::clone(&stop), Arc::clone(&rows));
        let thread = std::thread::spawn(move || {
            let gib = start(&its_name, capacity_rows);
            ready.send(()).unwrap();
            while !its_stop.load(Ordering::Relaxed) {
                let row = its_rows.load(Ordering::Relaxed);
                let values: Vec<f64> = (0..CHANNELS).map(|channel| value(row, channel)).collect();
                // SAFETY: a live instance, used by this thread alone, and as many values as said.
                assert_eq!(unsafe { gib_recorder_step(gib, values.as_ptr(), CHANNELS) }, GIB_BUSY);
                its_rows.store(row + 1, Ordering::Relaxed);
                pause.into_iter().for_each(std::thread::sleep);
            }
            // SAFETY: as above, and nobody uses it after.
            unsafe { (gib_recorder_close(gib), gib_recorder_free(gib)) };
        });
        begun.recv().unwrap();
        Writer { name, stop, rows, thread: Some(thread) }
    }

    fn end(&mut self) -> u64 {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().into_iter().for_each(|thread| thread.join().unwrap());
        self.rows.load(Ordering::Relaxed)
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        self.end();
    }
}

fn start(name: &str, capacity_rows: u32) -> *mut GibRecorder {
    let columns: Vec<String> = (0..CHANNELS).map(|channel| format!("c{channel}.position_mm")).collect();
    let text = |text: &str| CString::new(text).unwrap();
    let (name, machine, columns) = (text(name), text("rig"), text(&columns.join(",")));
    let config = GibRecorderConfig {
        struct_size: size_of::<GibRecorderConfig>() as u32,
        channels: CHANNELS,
        capacity_rows,
        every_cycles: 0,
        mode: 0,
        reserved: 0,
        cycle_s: 0.001,
        name: name.as_ptr(),
        machine: machine.as_ptr(),
        columns: columns.as_ptr(),
    };
    let gib = gib_recorder_new();
    // SAFETY: a fresh instance; the texts outlive the call.
    assert_eq!(unsafe { gib_recorder_start(gib, &raw const config) }, GIB_OK);
    gib
}

/// Reads for a while with a pause after each read. Returns rows delivered, rows lost; each row is checked.
fn read_for(ring: &mut Ring, length: Duration, pause: Duration) -> (u64, u64) {
    let (mut values, mut delivered, mut lost, mut next) = (Vec::new(), 0, 0, None);
    let until = Instant::now() + length;
    while Instant::now() < until {
        values.clear();
        let batch = ring.read(&mut values).unwrap();
        assert_eq!(values.len(), batch.rows * CHANNELS as usize);
        assert_eq!(batch.first, next.unwrap_or(batch.first - batch.lost) + batch.lost, "rows that nobody counted");
        for (row, cells) in (batch.first..).zip(values.chunks_exact(CHANNELS as usize)) {
            let torn = (0..CHANNELS).zip(cells).find(|(channel, cell)| **cell != value(row, *channel));
            assert!(torn.is_none(), "row {row} is torn: {cells:?}");
        }
        next = Some(batch.first + batch.rows as u64);
        delivered += batch.rows as u64;
        lost += batch.lost;
        std::thread::sleep(pause);
    }
    (delivered, lost)
}

#[test]
fn no_torn_row_is_delivered_by_a_ring_that_is_overrun_all_the_time() {
    // Small, and written without a pause: every read races with the writer.
    let mut writer = Writer::new("torn", 64, None);
    let mut ring = Ring::open(&writer.name).unwrap();
    let (delivered, lost) = read_for(&mut ring, Duration::from_secs(3), Duration::ZERO);
    let written = writer.end();
    println!("{written} rows written, {delivered} delivered, {lost} lost, none torn");
    assert!(delivered > 1000, "the reader starved: {delivered}");
    assert!(lost > 1000, "the writer never overran the reader: the test shows nothing");
}

#[test]
fn a_slow_reader_loses_oldest_rows_and_counts_them() {
    let mut writer = Writer::new("slow", 256, Some(Duration::from_micros(100)));
    let mut ring = Ring::open(&writer.name).unwrap();
    let begin = ring.head().unwrap();
    let (delivered, lost) = read_for(&mut ring, Duration::from_secs(2), Duration::from_millis(200));
    assert!(lost > 0 && delivered > 256, "{delivered} delivered, {lost} lost");
    let written = writer.end();
    assert!(begin + delivered + lost <= written);
}

#[test]
fn a_reader_that_keeps_up_loses_nothing() {
    let writer = Writer::new("keeps-up", 65536, Some(Duration::from_micros(100)));
    let mut ring = Ring::open(&writer.name).unwrap();
    let (delivered, lost) = read_for(&mut ring, Duration::from_secs(1), Duration::from_millis(5));
    assert_eq!(lost, 0);
    assert!(delivered > 500, "{delivered}");
}

fn record(name: &str, out: &Path, more: &[&str]) -> Child {
    let mut command = Command::new(GIB);
    command.args(["record", name, "--out"]).arg(out).args(more).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().unwrap()
}

fn signal(child: &Child, signal: Signal) {
    kill_process(Pid::from_child(child), signal).unwrap();
}

/// Waits until the file has grown.
fn grown(path: &Path, bytes: u64) {
    let until = Instant::now() + Duration::from_secs(20);
    while std::fs::metadata(path).map_or(0, |meta| meta.len()) < bytes {
        assert!(Instant::now() < until, "{} does not grow", path.display());
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// What a recording of the writer's holds.
fn check(path: &Path) -> Recording {
    let recording = Recording::open(path).unwrap();
    let first = recording.columns[0].values[0] as u64 / 64;
    for (at, row) in (first..first + recording.rows() as u64).enumerate() {
        assert!((recording.time_s[at] - 0.001 * row as f64).abs() < 1e-9);
        for channel in 0..CHANNELS {
            assert_eq!(recording.columns[channel as usize].values[at], value(row, channel));
        }
    }
    assert_eq!(recording.columns[CHANNELS as usize].name, "rig.lost_rows");
    recording
}

#[test]
fn a_killed_reader_harms_nobody_and_ctrl_c_ends_cleanly() {
    let writer = Writer::new("killed", 8192, Some(Duration::from_micros(500)));
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name);
    for kill in 0..5 {
        let path = out(&format!("killed-{kill}.csv"));
        let mut child = record(&writer.name, &path, &[]);
        grown(&path, 2000 + 7919 * kill);
        child.kill().unwrap();
        child.wait().unwrap();
        check(&path);
    }
    let mut ring = Ring::open(&writer.name).unwrap();
    assert!(ring.writer_lives());
    assert_eq!(read_for(&mut ring, Duration::from_millis(200), Duration::from_millis(5)).1, 0);

    for (number, what) in [Signal::INT, Signal::TERM].into_iter().enumerate() {
        let path = out(&format!("ended-{number}.csv"));
        let child = record(&writer.name, &path, &["--rotate", "0.1", "--keep", "2"]);
        grown(&out(&format!("ended-{number}-0003.csv")), 200);
        signal(&child, what);
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(text.contains("machine rig") && text.contains("stopped"), "{text}");
        assert!(!out(&format!("ended-{number}-0001.csv")).exists());
    }
}

#[test]
fn the_end_of_the_control_ends_the_recording() {
    let mut writer = Writer::new("ends", 8192, Some(Duration::from_micros(500)));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.csv");
    let child = record(&writer.name, &path, &["--history"]);
    grown(&path, 20_000);
    let written = writer.end();
    let output = child.wait_with_output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && text.contains("ended the recorder"), "{text}");
    // From the oldest row to the last that the control wrote.
    assert_eq!(check(&path).rows() as u64, written);
    let gone = Command::new(GIB).args(["record", &writer.name, "--out", "x.csv"]).output().unwrap();
    assert_eq!(gone.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&gone.stderr).contains("no recorder"));
}

#[test]
fn a_full_disk_leaves_whole_rows() {
    // A small disk of one's own needs a namespace of one's own.
    let small = "mount -t tmpfs -o size=64k tmpfs \"$1\" || exit 77";
    let folder = tempfile::tempdir().unwrap();
    let own = |script: &str, args: &[&str]| {
        let mut command = Command::new("unshare");
        command.args(["-rm", "sh", "-c", &format!("{small}; {script}"), "sh"]).arg(folder.path()).args(args);
        command.output()
    };
    if !own("true", &[]).is_ok_and(|output| output.status.success()) {
        eprintln!("a_full_disk_leaves_whole_rows: skipped, no namespaces here");
        return;
    }
    let writer = Writer::new("full", 8192, Some(Duration::from_micros(200)));
    let script = "\"$2\" record \"$3\" --out \"$1/run.csv\"; echo \"exit $?\"; \"$2\" inspect \"$1/run.csv\"";
    let output = own(script, &[GIB, &writer.name]).unwrap();
    let (text, errors) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(text.starts_with("exit 2"), "{text}{errors}");
    assert!(errors.contains("the disk is full") && errors.contains("whole and can be read"), "{errors}");
    assert!(
        output.status.success() && text.contains("rows over"),
        "the recording must still be readable: {text}{errors}"
    );
}

/// An address that is NULL is a channel without a number, in each of the pieces that a row is copied in.
#[test]
fn a_missing_address_is_an_empty_cell() {
    for channels in [1u32, 2, 5, 31] {
        let (name, machine) = (format!("missing-{channels}-{}", std::process::id()), CString::new("rig").unwrap());
        let columns = (0..channels).map(|i| format!("c{i}")).collect::<Vec<_>>().join(",");
        let (c_name, columns) = (CString::new(name.clone()).unwrap(), CString::new(columns).unwrap());
        let config = GibRecorderConfig {
            struct_size: size_of::<GibRecorderConfig>() as u32,
            channels,
            capacity_rows: 64,
            every_cycles: 1,
            mode: 0,
            reserved: 0,
            cycle_s: 0.001,
            name: c_name.as_ptr(),
            machine: machine.as_ptr(),
            columns: columns.as_ptr(),
        };
        let values: Vec<f64> = (0..channels).map(f64::from).collect();
        let gib = gib_recorder_new();
        // SAFETY: a live instance; every address is one of `values` or NULL.
        unsafe {
            assert_eq!(gib_recorder_start(gib, &config), GIB_OK);
            for missing in 0..channels as usize {
                let mut sources: Vec<*const f64> = values.iter().map(|value| value as *const f64).collect();
                sources[missing] = std::ptr::null();
                assert_eq!(gib_recorder_step_from(gib, sources.as_ptr(), channels), GIB_BUSY);
            }
        }
        let words = std::fs::read(format!("/dev/shm/gib-{name}")).unwrap();
        for row in 0..channels as usize {
            for channel in 0..channels as usize {
                let at = 8 * (512 + row * (channels as usize + 1) + 1 + channel);
                let value = f64::from_ne_bytes(words[at..at + 8].try_into().unwrap());
                assert!(
                    if row == channel { value.is_nan() } else { value == channel as f64 },
                    "{row} {channel} {value}"
                );
            }
        }
        // SAFETY: as above, and nobody uses it after.
        unsafe { (gib_recorder_close(gib), gib_recorder_free(gib)) };
    }
}
