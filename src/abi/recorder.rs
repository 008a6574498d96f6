//! Family `recorder`: channels at servo rate into shared memory, as seen from C.

use super::guard::{CONFIG, guarded, instance, instance_mut, placed, versioned};
use super::shared_memory::{SharedMemory, copy, gather};
use super::types::GibErrorDetail;
use crate::cycle::recorder::layout::{HEAD, Shape};
use crate::cycle::recorder::writer::{self, Plan, State};
use crate::error::{
    Fault, GIB_BUSY, GIB_ERR_ABORTED, GIB_ERR_CONFIG, GIB_ERR_HANDLE, GIB_ERR_NULL, GIB_ERR_RECORDER_COUNT,
    GIB_ERR_STATE, GIB_OK,
};
use crate::recording::ring::{self, NAME_MOST, Wanted};
use core::ffi::{CStr, c_char, c_void};

/// Marks memory that holds an instance; its absence tells memory that never did, or does no more.
const ALIVE: u32 = 0x6769_7201;
/// The mark while rows are written: one comparison says that the instance lives, records, and has its memory.
const RECORDING: u32 = ALIVE + 1;

/// What to record, under which name. Zero in a field means its default; fields marked "required" have none.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct GibRecorderConfig {
    /// Size of this struct as the caller knows it: `sizeof(gib_recorder_config)`. Required.
    pub struct_size: u32,
    /// Values in every row, 1 to 64. Required.
    pub channels: u32,
    /// Rows in the ring, 16 to what makes 1 GiB (default: four seconds of rows). A reader that is away longer loses rows.
    pub capacity_rows: u32,
    /// Servo cycles from row to row, 1 to 1000000 (default 1).
    pub every_cycles: u32,
    /// Permissions of the shared memory, to read and write alone, from 0600 (default: who records may read) to 0666.
    pub mode: u32,
    /// Zero.
    pub reserved: u32,
    /// Servo period, 0.000001 to 1 s. Required.
    pub cycle_s: f64,
    /// Name under which `gib record` finds it: 1 to 40 letters, digits, `-`, `_`, `.`. Copied. Required.
    pub name: *const c_char,
    /// Name of the machine, which every recording carries: 1 to 40 letters, digits, `-`, `_`. Copied. Required.
    pub machine: *const c_char,
    /// Names of the columns, one a channel, separated by commas: "x.position_mm,x.torque_nm". At most 3775 bytes. A
    /// signal of the recording format must have a unit that it can have; other names are recorded as they are.
    /// Copied. Required.
    pub columns: *const c_char,
}

impl GibRecorderConfig {
    /// Size of the struct in the first published ABI.
    const FIRST_SIZE: usize = 56;
}

/// What a recorder has done.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
pub struct GibRecorderReport {
    /// Rows written since the start.
    pub rows: u64,
    /// Bytes of shared memory.
    pub bytes: u64,
    /// Rows in the ring.
    pub capacity_rows: u32,
    /// Values in a row.
    pub channels: u32,
    /// 1: the memory is locked and never paged out. 0: the system refused the lock (RLIMIT_MEMLOCK); the pages are there
    /// all the same, and only a machine short of memory can take them away.
    pub locked: i32,
    /// What the last step returned.
    pub status: i32,
}

/// A recorder. Opaque; its size is `gib_recorder_size()`.
#[repr(C, align(16))]
pub struct GibRecorder {
    alive: u32,
    /// What a step returns: GIB_OK at rest, GIB_BUSY while rows are written, or the error that ended it.
    status: i32,
    last: Fault,
    plan: Plan,
    state: State,
    memory: Option<SharedMemory>,
    shape: Option<Shape>,
    /// The name, NUL-terminated.
    name: [u8; NAME_MOST + 1],
}

impl super::guard::Instance for GibRecorder {
    fn alive(&self) -> bool {
        self.alive == ALIVE || self.alive == RECORDING
    }
    fn new() -> GibRecorder {
        GibRecorder {
            alive: ALIVE,
            status: GIB_OK,
            last: Fault::NONE,
            plan: Plan::REST,
            state: State::START,
            memory: None,
            shape: None,
            name: [0; NAME_MOST + 1],
        }
    }
    fn bury(&mut self) {
        self.close();
        self.alive = 0;
    }
}

impl GibRecorder {
    /// Makes the shared memory and begins.
    fn start(&mut self, shape: Shape, wanted: &Wanted) -> Result<(), Fault> {
        let memory =
            SharedMemory::map(ring::create(wanted)?.file, shape.words()).inspect_err(|_| ring::remove(wanted.name))?;
        shape.write(memory.words(), wanted.machine.as_bytes(), wanted.columns.as_bytes());
        self.name.fill(0);
        self.name.iter_mut().zip(wanted.name.bytes()).for_each(|(place, byte)| *place = byte);
        (self.plan, self.state) = (Plan::new(&shape), State::START);
        (self.memory, self.shape, self.status) = (Some(memory), Some(shape), GIB_BUSY);
        self.alive = RECORDING;
        Ok(())
    }

    /// What a step returns that writes no row.
    #[cold]
    fn why_no_row(&self, no_values: bool) -> i32 {
        match self.alive {
            ALIVE => self.status,
            RECORDING if no_values => GIB_ERR_NULL,
            RECORDING => GIB_ERR_RECORDER_COUNT,
            _ => GIB_ERR_HANDLE,
        }
    }

    /// Ends and gives the shared memory back.
    fn close(&mut self) {
        if let Some(memory) = self.memory.take() {
            writer::end(memory.words());
            // The name first: once the lock is gone, it may be the next writer's.
            let name = self.name.split(|byte| *byte == 0).next().unwrap_or(&[]);
            ring::remove(&String::from_utf8_lossy(name));
            memory.unmap();
        }
        (self.plan, self.status, self.alive) = (Plan::REST, GIB_OK, ALIVE);
    }
}

/// A text of the configuration.
///
/// # Safety
/// `text` is NULL or NUL-terminated, and lives as long as the result is used.
unsafe fn text<'a>(field: &'static str, text: *const c_char) -> Result<&'a str, Fault> {
    let wrong = Fault { field, ..Fault::of(GIB_ERR_CONFIG) };
    if text.is_null() {
        return Err(wrong);
    }
    // SAFETY: not NULL, NUL-terminated by the caller's promise.
    unsafe { CStr::from_ptr(text) }.to_str().map_err(|_| wrong)
}

/// Bytes that an instance needs in memory of your own, to be aligned to 16.
///
/// @return the size in bytes, below 1 KiB; the ring is not in it.
///
/// [thread: any] [real-time: yes] [state: any]
#[unsafe(no_mangle)]
pub extern "C" fn gib_recorder_size() -> usize {
    size_of::<GibRecorder>()
}

/// Makes an instance at rest in memory of your own. Call gib_recorder_close before the memory is used for anything else.
///
/// @param memory at least `gib_recorder_size()` bytes, aligned to 16; stays yours.
/// @param size bytes at `memory`.
/// @param out receives the handle; NULL on error.
/// @return GIB_OK; GIB_ERR_NULL; GIB_ERR_MEMORY when too small or misaligned.
///
/// [thread: setup] [real-time: no] [state: none]
///
/// # Safety
/// `memory` is NULL or points to `size` writable bytes; `out` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_recorder_init_in(memory: *mut c_void, size: usize, out: *mut *mut GibRecorder) -> i32 {
    // SAFETY: the caller's promise is `placed`'s.
    guarded(|| unsafe { placed(memory, size, out) })
}

/// Makes an instance at rest in memory that gib allocates.
///
/// @return the handle, to be given to `gib_recorder_free`; NULL when there is no memory.
///
/// [thread: setup] [real-time: no] [state: none]
#[unsafe(no_mangle)]
pub extern "C" fn gib_recorder_new() -> *mut GibRecorder {
    super::guard::allocated()
}

/// Closes and frees an instance made by `gib_recorder_new`. NULL is allowed and does nothing.
///
/// @param handle an instance from `gib_recorder_new`, never one from `gib_recorder_init_in`.
///
/// [thread: setup] [real-time: no] [state: no step runs]
///
/// # Safety
/// `handle` is NULL or came from `gib_recorder_new` and was not freed before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_recorder_free(handle: *mut GibRecorder) {
    // A panic on the way must not reach C.
    // SAFETY: the caller's promise is `release`'s.
    let _ = guarded(|| unsafe {
        super::guard::release(handle);
        Ok(GIB_OK)
    });
}

/// Makes the shared memory, touches and locks all of it, and begins to record with the next step.
///
/// The memory is `/dev/shm/gib-<name>`. What a process that died left under this name is cleared away; a living one keeps it.
///
/// @param handle the instance.
/// @param config what to record; copied. Set `struct_size`, zero the rest, then set what you want.
/// @return GIB_OK; GIB_ERR_CONFIG and GIB_ERR_RECORDER_COLUMN (gib_recorder_last_error names the field and its range, or
/// the number of the column), GIB_ERR_RECORDER_IN_USE, GIB_ERR_RECORDER_FOREIGN, GIB_ERR_MEMORY when there is not that much
/// shared memory, GIB_ERR_IO, GIB_ERR_STRUCT_SIZE, GIB_ERR_STATE unless closed, GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: setup] [real-time: no] [state: closed]
///
/// # Safety
/// `handle` is NULL or an instance; `config` is NULL or points to its `struct_size` readable bytes, and its texts are
/// NULL or NUL-terminated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_recorder_start(handle: *mut GibRecorder, config: *const GibRecorderConfig) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance_mut(handle) }?;
        if handle.memory.is_some() {
            return Err(GIB_ERR_STATE);
        }
        // SAFETY: the caller's promise; zero is a legal value of every field.
        let config = unsafe { versioned(CONFIG, config, GibRecorderConfig::FIRST_SIZE) };
        let begun = config.and_then(|c| {
            let shape = Shape::new(c.channels, c.capacity_rows, c.every_cycles, c.cycle_s)?;
            let mode = if c.mode == 0 { 0o600 } else { c.mode };
            // SAFETY: the caller promises NUL-terminated texts, used within this call only.
            let (name, machine, columns) =
                unsafe { (text("name\0", c.name)?, text("machine\0", c.machine)?, text("columns\0", c.columns)?) };
            handle.start(shape, &Wanted { name, machine, columns, mode, shape })
        });
        handle.last = begun.err().unwrap_or(Fault::NONE);
        Ok(handle.last.code)
    })
}

/// One servo cycle: writes a row when one is due. Never waits for a reader.
///
/// @param handle the instance.
/// @param values one number a channel, in the order of the columns. A NaN or an infinity is recorded as an empty cell.
/// @param count numbers at `values`; must be `channels`.
/// @return GIB_BUSY while recording; GIB_OK at rest; GIB_ERR_ABORTED after gib_recorder_abort; GIB_ERR_RECORDER_COUNT,
/// GIB_ERR_NULL, GIB_ERR_HANDLE of this call, which wrote no row.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `values` is NULL or points to `count` readable numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_recorder_step(handle: *mut GibRecorder, values: *const f64, count: u32) -> i32 {
    let write = |to: *mut f64| {
        // SAFETY: `count` readable numbers by the caller's promise, room for them in a row by `step`'s.
        unsafe { copy(values, count as usize, to) }
    };
    // SAFETY: the caller's promise; `count` values are written.
    unsafe { step(handle, values.is_null(), count, write) }
}

/// One servo cycle, as `gib_recorder_step`, of values that lie scattered: each is read from its own address, once, when a row
/// is due. Saves a kernel that keeps its signals in places of their own, such as LinuxCNC's pins, to gather them first.
///
/// @param handle the instance.
/// @param sources where the number of each channel lies now, in the order of the columns. A NaN or an infinity is recorded as
/// an empty cell, and so is a NULL among them. Read during this call only.
/// @param count addresses at `sources`; must be `channels`.
/// @return as `gib_recorder_step`.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `sources` is NULL or points to `count` addresses, each NULL or of a readable number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_recorder_step_from(
    handle: *mut GibRecorder,
    sources: *const *const f64,
    count: u32,
) -> i32 {
    let write = |to: *mut f64| {
        // SAFETY: `count` addresses, NULL or of readable numbers, by the caller's promise, room for them in a row by `step`'s.
        unsafe { gather(sources, count as usize, to) }
    };
    // SAFETY: the caller's promise; `count` values are written.
    unsafe { step(handle, sources.is_null(), count, write) }
}

/// One servo cycle; when a row is due, `write` writes its values where it is told.
///
/// # Safety
/// `handle` is NULL or an instance; `write` writes `count` values, and is not called when there are none.
#[inline(always)]
unsafe fn step(handle: *mut GibRecorder, none: bool, count: u32, write: impl FnOnce(*mut f64)) -> i32 {
    // SAFETY: the caller promises NULL or an instance.
    let Some(handle) = (unsafe { handle.as_mut() }) else { return GIB_ERR_NULL };
    if handle.alive != RECORDING || count != handle.plan.channels || none {
        return handle.why_no_row(none);
    }
    // SAFETY: the mark is RECORDING only while there is a memory.
    let memory = unsafe { handle.memory.as_ref().unwrap_unchecked() };
    // SAFETY: the plan is of the memory's own shape, so that each of its places has room for a row of `channels`.
    let row = |place: usize, number: u64| unsafe { memory.put_row(place, number, write) };
    // SAFETY: every mapping has a header.
    writer::step(&handle.plan, &mut handle.state, row, |rows| unsafe { memory.release(HEAD, rows) });
    GIB_BUSY
}

/// Ends the recording: no row is written any more, and readers end by themselves once they have all. Does nothing at rest.
///
/// The shared memory stays until gib_recorder_close, which setup calls.
///
/// @param handle the instance.
/// @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_recorder_abort(handle: *mut GibRecorder) -> i32 {
    // SAFETY: the caller's promise.
    match unsafe { instance_mut(handle) } {
        Ok(handle) => {
            if let (Some(memory), GIB_BUSY) = (&handle.memory, handle.status) {
                writer::end(memory.words());
                (handle.status, handle.alive) = (GIB_ERR_ABORTED, ALIVE);
            }
            GIB_OK
        }
        Err(status) => status,
    }
}

/// Ends the recording and gives the shared memory back. Readers that have it open read it to its end.
///
/// @param handle the instance.
/// @return GIB_OK, also at rest; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: setup] [real-time: no] [state: no step runs]
///
/// # Safety
/// `handle` is NULL or an instance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_recorder_close(handle: *mut GibRecorder) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        unsafe { instance_mut(handle) }?.close();
        Ok(GIB_OK)
    })
}

/// Reads what the recorder has done.
///
/// @param handle the instance.
/// @param report receives it.
/// @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: cycle] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `report` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_recorder_result(handle: *const GibRecorder, report: *mut GibRecorderReport) -> i32 {
    // SAFETY: the caller's promise.
    let (handle, report) = match unsafe { (instance(handle), report.as_mut()) } {
        (Ok(handle), Some(report)) => (handle, report),
        (Err(status), _) => return status,
        (_, None) => return GIB_ERR_NULL,
    };
    let words = handle.memory.as_ref().map_or(0, |memory| memory.words().len());
    *report = GibRecorderReport {
        rows: handle.state.rows,
        bytes: 8 * words as u64,
        capacity_rows: handle.shape.map_or(0, |shape| shape.capacity as u32),
        channels: handle.shape.map_or(0, |shape| shape.channels as u32),
        locked: handle.memory.as_ref().map_or(0, |memory| i32::from(memory.locked)),
        status: handle.status,
    };
    GIB_OK
}

/// Why the last start was refused: code, field, value and bounds.
///
/// @param handle the instance.
/// @param detail receives it; its `code` is GIB_OK when nothing went wrong.
/// @return GIB_OK; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: any] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `detail` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_recorder_last_error(handle: *const GibRecorder, detail: *mut GibErrorDetail) -> i32 {
    // SAFETY: the caller's promise.
    match unsafe { (instance(handle), detail.as_mut()) } {
        (Ok(handle), Some(detail)) => {
            *detail = handle.last.into();
            GIB_OK
        }
        (Err(status), _) => status,
        (_, None) => GIB_ERR_NULL,
    }
}
