//! Reads a recorder's ring while it is written. Nothing is mapped and nothing is locked: the writer cannot feel it.

use std::fs::File;
use std::os::unix::fs::{FileExt, MetadataExt};
use std::sync::atomic::{Ordering, fence};

use rustix::fs::{FlockOperation, flock};

use crate::cycle::recorder::layout::{ENDED, HEAD, HEADER_WORDS, STATE, Shape, column_words, machine_words};
use crate::recording::RecordingError;

/// Most rows that one [`Ring::read`] gives: the longer a copy takes, the more of it the writer overtakes.
const BATCH_ROWS: u64 = 8192;

/// A ring and the place in it up to which this reader has read.
#[derive(Debug)]
pub struct Ring {
    file: File,
    /// The recorder's name.
    pub name: String,
    /// Name of the machine.
    pub machine: String,
    /// Names of the columns, without the time.
    pub columns: Vec<String>,
    /// Its numbers.
    pub shape: Shape,
    /// Number of the row to be read next.
    next: u64,
    bytes: Vec<u8>,
}

/// What one read gave.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Batch {
    /// Number of the first row.
    pub first: u64,
    /// Rows, each as many values as there are columns.
    pub rows: usize,
    /// Rows that were overwritten before they could be read, right before the first.
    pub lost: u64,
    /// No row will come any more: the writer has ended, or is gone.
    pub ended: bool,
}

impl Ring {
    /// Opens the recorder of this name, to read from the next row on.
    ///
    /// # Errors
    /// There is none, it may not be read, or it is not of a layout that this version knows.
    pub fn open(name: &str) -> Result<Ring, RecordingError> {
        let path = super::path(name);
        let shown = path.display().to_string();
        let wrong = |message: String| RecordingError::new(&shown, message);
        if !super::is_name(name) {
            return Err(RecordingError::new(name, "is no name of a recorder: letters, digits, '-', '_' and '.'"));
        }
        let file = File::open(&path).map_err(|why| match why.kind() {
            std::io::ErrorKind::NotFound => wrong(format!("no recorder {name} runs; start it in the control first")),
            _ => wrong(format!("cannot be opened: {why}; the recorder's `mode` says who may")),
        })?;
        let header = header(&file).map_err(|why| wrong(format!("cannot be read: {why}")))?;
        let shape = Shape::read(&header)
            .filter(|shape| file.metadata().is_ok_and(|meta| meta.size() >= 8 * shape.words() as u64))
            .ok_or_else(|| wrong("is not a recorder's memory of a layout that this version of gib knows".into()))?;
        let columns: Vec<String> = text(column_words(&header)).split(',').map(str::to_owned).collect();
        if columns.len() != shape.channels {
            return Err(wrong(format!("names {} columns for {} channels", columns.len(), shape.channels)));
        }
        let (machine, next) = (text(machine_words(&header)), header[HEAD]);
        Ok(Ring { file, name: name.to_owned(), machine, columns, shape, next, bytes: Vec::new() })
    }

    /// Goes back to the oldest row that is still there.
    pub fn rewind(&mut self) {
        self.next = 0;
    }

    /// Rows written since the recorder's start.
    ///
    /// # Errors
    /// The memory cannot be read.
    pub fn head(&self) -> std::io::Result<u64> {
        word(&self.file, HEAD)
    }

    /// Copies rows that came since the last read to the end of `values`, oldest first, at most a few thousand of them.
    ///
    /// # Errors
    /// The memory cannot be read.
    pub fn read(&mut self, values: &mut Vec<f64>) -> std::io::Result<Batch> {
        // Before the head: when the writer had ended by then, the head is its last.
        let ended = word(&self.file, STATE)? == ENDED;
        let (head, capacity) = (word(&self.file, HEAD)?, self.shape.capacity as u64);
        let from = self.next.max((head + 1).saturating_sub(capacity));
        let to = head.min(from + BATCH_ROWS.min(capacity));
        self.copy(from, to)?;
        // The rows were copied before the head is looked at again.
        fence(Ordering::Acquire);
        let whole = (word(&self.file, HEAD)? + 1).saturating_sub(capacity).clamp(from, to.max(from));
        let row_bytes = 8 * self.shape.row_words();
        let mut first = whole;
        for (number, row) in (from..to).zip(self.bytes.chunks_exact(row_bytes)).skip((whole - from) as usize) {
            let mut words = row.chunks_exact(8).map(|chunk| u64::from_ne_bytes(chunk.try_into().unwrap_or_default()));
            // Each row carries its number. Another than is due cannot be, and would be worse than a gap.
            if words.next() != Some(number) {
                values.truncate(values.len() - (number - first) as usize * self.shape.channels);
                first = number + 1;
                continue;
            }
            values.extend(words.map(f64::from_bits));
        }
        let batch = Batch {
            first,
            rows: to.saturating_sub(first) as usize,
            lost: first - self.next,
            ended: ended && to == head,
        };
        self.next = to.max(first);
        Ok(batch)
    }

    /// Copies the slots of these rows into `bytes`, in two pieces where they go over the end of the ring.
    fn copy(&mut self, from: u64, to: u64) -> std::io::Result<()> {
        let (capacity, row_bytes) = (self.shape.capacity as u64, 8 * self.shape.row_words());
        let slot = from % capacity;
        let first = (to.max(from) - from).min(capacity - slot);
        let rest = to.max(from) - from - first;
        self.bytes.resize((first + rest) as usize * row_bytes, 0);
        let (one, two) = self.bytes.split_at_mut(first as usize * row_bytes);
        self.file.read_exact_at(one, 8 * HEADER_WORDS as u64 + slot * row_bytes as u64)?;
        self.file.read_exact_at(two, 8 * HEADER_WORDS as u64)
    }

    /// Whether the writer lives: it holds a lock as long as it does.
    #[must_use]
    pub fn writer_lives(&self) -> bool {
        let free = flock(&self.file, FlockOperation::NonBlockingLockShared).is_ok();
        if free {
            let _ = flock(&self.file, FlockOperation::Unlock);
        }
        !free
    }
}

fn word(file: &File, at: usize) -> std::io::Result<u64> {
    let mut bytes = [0; 8];
    file.read_exact_at(&mut bytes, 8 * at as u64)?;
    fence(Ordering::Acquire);
    Ok(u64::from_ne_bytes(bytes))
}

fn header(file: &File) -> std::io::Result<[u64; HEADER_WORDS]> {
    let mut bytes = vec![0; 8 * HEADER_WORDS];
    file.read_exact_at(&mut bytes, 0)?;
    let mut header = [0; HEADER_WORDS];
    for (word, chunk) in header.iter_mut().zip(bytes.chunks_exact(8)) {
        *word = u64::from_ne_bytes(chunk.try_into().unwrap_or_default());
    }
    Ok(header)
}

/// Text padded with zeros.
fn text(words: &[u64]) -> String {
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_ne_bytes()).take_while(|byte| *byte != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Names of the recorders whose memory is there, in the order of the alphabet.
#[must_use]
pub fn rings() -> Vec<String> {
    let entries = std::fs::read_dir("/dev/shm").into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().to_str()?.strip_prefix("gib-").map(str::to_owned));
    let mut names: Vec<String> = names.filter(|name| super::is_name(name)).collect();
    names.sort();
    names
}
