//! Family `diagnosis`: what a simulation gets wrong, why, and what knowing it is worth, as seen from C. Off the cycle.

use super::guard::{CONFIG, Instance, guarded, instance, versioned};
use super::last_error::{LastError, Refused};
use super::machine::{GibMachine, file_status};
use super::text::{copy_out, path_if_any, path_of, text_if_any};
use crate::diagnosis::{Diagnosis, Excerpt, Verdict, axis_of, diagnose};
use crate::error::{
    Fault, GIB_DONE, GIB_ERR_ABORTED, GIB_ERR_DIAGNOSIS_AXIS, GIB_ERR_DIAGNOSIS_HOLDOUT, GIB_ERR_FORMAT, GIB_ERR_NULL,
    GIB_ERR_STATE, GIB_ERR_STRUCT_SIZE, GIB_OK,
};
use crate::machine::Machine;
use crate::plant::plausible::plausible;
use crate::recording::{Recording, is_same_file};
use core::ffi::{c_char, c_void};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, TryLockError};

/// The machine does what the simulation believes.
pub const GIB_DIAGNOSIS_NO_DISCREPANCY: i32 = 0;
/// The named causes explain the discrepancy down to the noise.
pub const GIB_DIAGNOSIS_EXPLAINED: i32 = 1;
/// The named causes explain most of the discrepancy.
pub const GIB_DIAGNOSIS_PARTLY_EXPLAINED: i32 = 2;
/// The simulation is wrong, and no known cause fits.
pub const GIB_DIAGNOSIS_UNKNOWN_CAUSE: i32 = 3;
/// The recording does not suffice; the JSON says what is missing.
pub const GIB_DIAGNOSIS_INSUFFICIENT_DATA: i32 = 4;

/// Told how far a diagnosis is; answers 0 to go on, anything else to stop.
///
/// It is called from threads that gib starts for the work, one call at a time; it must return, and may call
/// gib_diagnosis_abort and no other function of that instance.
///
/// @param user what was given to gib_diagnosis_run.
/// @param share of the work that is done, 0 to 1, never falling.
/// @param stage what is being done, in a few words; valid during the call.
pub type GibDiagnosisProgress =
    Option<unsafe extern "C" fn(user: *mut c_void, share: f64, stage: *const c_char) -> i32>;

/// What is to be diagnosed. Zero it, set `struct_size`, then `machine` and `recording`.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct GibDiagnosisConfig {
    /// `sizeof(gib_diagnosis_config)`.
    pub struct_size: u32,
    /// Zero.
    pub reserved: u32,
    /// What the simulation believes; is copied.
    pub machine: *const GibMachine,
    /// Path of the recording, NUL-terminated.
    pub recording: *const c_char,
    /// Path of a second recording, not used for fitting, on which the gain is measured; NULL or "" for none: then it
    /// is measured on blocks of the first that are held out.
    pub holdout: *const c_char,
    /// Name of the axis; NULL or "" for the first that machine and recording share.
    pub axis: *const c_char,
}

/// What a diagnosis came to; the JSON has all of it.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
pub struct GibDiagnosisReport {
    /// `GIB_DIAGNOSIS_…`.
    pub verdict: i32,
    /// Number of causes named.
    pub findings: u32,
    /// RMS of measured minus predicted torque on rows that were not fitted, unfiltered, as believed; N·m, or N for a linear
    /// drive; 0 where not judged.
    pub residual_before: f64,
    /// The same with what was found.
    pub residual_after: f64,
    /// Noise floor of that residual below the frequency up to which it is judged, in the same unit.
    pub noise: f64,
}

/// Marks memory that holds an instance.
const ALIVE: u64 = 0x6769_625f_6469_0001;

/// A diagnosis of one axis. Opaque; it owns memory of its own, so that it comes from `gib_diagnosis_new` alone.
pub struct GibDiagnosis {
    alive: u64,
    /// Set by an abort, from whatever thread.
    stop: AtomicBool,
    work: Mutex<Work>,
}

/// What one thread at a time works with.
#[derive(Default)]
struct Work {
    task: Option<Task>,
    diagnosis: Option<Diagnosis>,
    /// The machine with what was found.
    extended: Option<Machine>,
    last: LastError,
}

/// What was read by `start`.
struct Task {
    machine: Machine,
    /// Number of the axis in the machine.
    axis: usize,
    recording: Excerpt,
    holdout: Option<Excerpt>,
}

impl Instance for GibDiagnosis {
    fn alive(&self) -> bool {
        self.alive == ALIVE
    }
    fn new() -> GibDiagnosis {
        GibDiagnosis { alive: ALIVE, stop: AtomicBool::new(false), work: Mutex::new(Work::default()) }
    }
    fn bury(&mut self) {
        self.alive = 0;
    }
}

impl GibDiagnosis {
    /// The work, for this thread alone; `GIB_ERR_STATE` while another thread has it.
    fn work(&self) -> Result<MutexGuard<'_, Work>, i32> {
        match self.work.try_lock() {
            Ok(work) => Ok(work),
            Err(TryLockError::WouldBlock) => Err(GIB_ERR_STATE),
            // A call panicked half way: what it left is whole, since every field is set at once.
            Err(TryLockError::Poisoned(work)) => Ok(work.into_inner()),
        }
    }
}

impl Work {
    /// Does the work, if it is told to go on.
    fn diagnosed(&mut self, go_on: &(dyn Fn(f64, &'static str) -> bool + Sync)) -> Result<i32, Refused> {
        let not_started = || Refused(GIB_ERR_STATE, "gib_diagnosis_start has not succeeded yet".into());
        let task = self.task.as_ref().ok_or_else(not_started)?;
        let axis = task.machine.axes.get(task.axis).ok_or_else(not_started)?;
        let diagnosis = diagnose(axis, &task.recording, task.holdout.as_ref(), go_on)
            .map_err(|_| Refused(GIB_ERR_ABORTED, "stopped before a result was reached".into()))?;
        let mut extended = task.machine.clone();
        if let Some(axis) = extended.axes.get_mut(task.axis) {
            *axis = diagnosis.extended.clone();
        }
        (self.diagnosis, self.extended) = (Some(diagnosis), Some(extended));
        Ok(GIB_DONE)
    }

    /// What was found, and the machine with it.
    fn found(&self) -> Result<(&Diagnosis, &Machine), Refused> {
        let both = self.diagnosis.as_ref().zip(self.extended.as_ref());
        both.ok_or_else(|| Refused(GIB_ERR_STATE, "no gib_diagnosis_run is done yet".into()))
    }
}

impl Task {
    /// Reads what a configuration names.
    fn read(machine: &Machine, recording: &Path, holdout: Option<&Path>, axis: Option<&str>) -> Result<Task, Refused> {
        let open = |path: &Path| Recording::open(path).map_err(|why| Refused(file_status(path), why.to_string()));
        if holdout.is_some_and(|holdout| is_same_file(holdout, recording)) {
            let why = "the hold-out is the recording itself, on which a gain says nothing".to_owned();
            return Err(Refused(GIB_ERR_DIAGNOSIS_HOLDOUT, why));
        }
        let mut recording = open(recording)?;
        let number = axis_of(machine, &recording, axis).map_err(|why| Refused(GIB_ERR_DIAGNOSIS_AXIS, why))?;
        let axis = machine.axes.get(number).ok_or(GIB_ERR_DIAGNOSIS_AXIS)?;
        let check = |recording: &mut Recording| plausible(recording, axis).map_err(|why| Refused(GIB_ERR_FORMAT, why));
        check(&mut recording)?;
        // One after the other, so that there is room for either.
        let excerpt = Excerpt::of(&recording, axis);
        drop(recording);
        let read = |file: &Path| -> Result<Excerpt, Refused> {
            let mut recording = open(file)?;
            check(&mut recording)?;
            Ok(Excerpt::of(&recording, axis))
        };
        let holdout = holdout.map(read).transpose()?;
        if let Some(Err(why)) = holdout.as_ref().map(Excerpt::usable) {
            return Err(Refused(GIB_ERR_DIAGNOSIS_HOLDOUT, why.to_string()));
        }
        Ok(Task { machine: machine.clone(), axis: number, recording: excerpt, holdout })
    }
}

/// Makes an empty instance.
///
/// @return the handle, to be given to `gib_diagnosis_free`; NULL when there is no memory.
///
/// [thread: setup] [real-time: no] [state: none]
#[unsafe(no_mangle)]
pub extern "C" fn gib_diagnosis_new() -> *mut GibDiagnosis {
    super::guard::allocated()
}

/// Frees an instance. NULL is allowed and does nothing.
///
/// @param handle an instance from `gib_diagnosis_new`, in use by no call.
///
/// [thread: setup] [real-time: no] [state: not busy]
///
/// # Safety
/// `handle` is NULL or came from `gib_diagnosis_new` and was not freed before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_diagnosis_free(handle: *mut GibDiagnosis) {
    // SAFETY: the caller's promise is `release`'s.
    unsafe { super::guard::release(handle) }
}

/// Takes the configuration and reads the recordings; `gib_diagnosis_run` then does the work.
///
/// Recordings are read here, on the calling thread: never call it from a servo thread.
///
/// @param handle the instance; an earlier result is forgotten.
/// @param config what to diagnose; nothing of it is kept.
/// @return GIB_OK; GIB_ERR_IO or GIB_ERR_FORMAT for a recording (gib_diagnosis_last_error_text names file, row and
/// column), GIB_ERR_DIAGNOSIS_AXIS, GIB_ERR_DIAGNOSIS_HOLDOUT, GIB_ERR_STRUCT_SIZE; GIB_ERR_STATE when no machine was
/// read or another thread works; GIB_ERR_NULL, GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
///
/// [thread: setup] [real-time: no] [state: not busy]
///
/// # Safety
/// `handle` is NULL or an instance; `config` is NULL or points to `struct_size` bytes whose pointers are NULL or as
/// said there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_diagnosis_start(handle: *mut GibDiagnosis, config: *const GibDiagnosisConfig) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance(handle) }?;
        let mut work = handle.work()?;
        *work = Work::default();
        handle.stop.store(false, Ordering::Relaxed);
        // SAFETY: the caller's promise.
        let started = unsafe { read_config(config) }.map(|task| {
            work.task = Some(task);
            GIB_OK
        });
        work.last.of(started)
    })
}

/// Reads what the caller's configuration names.
///
/// # Safety
/// As [`gib_diagnosis_start`].
unsafe fn read_config(config: *const GibDiagnosisConfig) -> Result<Task, Refused> {
    // SAFETY: the caller's promise.
    let config = unsafe { versioned(CONFIG, config, size_of::<GibDiagnosisConfig>()) }.map_err(|fault| {
        let Fault { code, value, high, .. } = fault;
        match code {
            GIB_ERR_STRUCT_SIZE => Refused(
                code,
                format!("struct_size is {value}, not {high}: set it to sizeof, and zero the rest before you fill it"),
            ),
            GIB_ERR_NULL => Refused(code, "config is NULL".into()),
            _ => code.into(),
        }
    })?;
    // SAFETY: the caller's promise.
    let machine = unsafe { instance(config.machine) }
        .map_err(|status| Refused(status, "config.machine is NULL or no machine".into()))?;
    let machine = machine
        .machine
        .as_ref()
        .ok_or_else(|| Refused(GIB_ERR_STATE, "no machine was read into config.machine".into()))?;
    // SAFETY: the caller's promise, for the three of them.
    let (recording, holdout, axis) =
        unsafe { (path_of(config.recording), path_if_any(config.holdout), text_if_any(config.axis)) };
    let recording = recording.map_err(|status| Refused(status, "config.recording is NULL".into()))?;
    let axis = axis.map_err(|status| Refused(status, "config.axis is not UTF-8; it is one letter, a to z".into()))?;
    Task::read(machine, recording, holdout, axis)
}

/// Does the whole work, and returns when it is done or stopped: seconds for a minute of recording. It starts threads
/// of its own for the time of the call, with the scheduling of the calling thread: never call it from a servo thread.
///
/// @param handle the instance.
/// @param progress told how far the work is, ten times a second or more; may be NULL.
/// @param user given to `progress`.
/// @return GIB_DONE; GIB_ERR_ABORTED; GIB_ERR_STATE before `gib_diagnosis_start` or while another thread works;
/// GIB_ERR_NULL, GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
///
/// [thread: setup] [real-time: no] [state: started]
///
/// # Safety
/// `handle` is NULL or an instance; `progress` is NULL or a function that may be called with `user` from other threads
/// until this call returns.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_diagnosis_run(
    handle: *mut GibDiagnosis,
    progress: GibDiagnosisProgress,
    user: *mut c_void,
) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let handle = unsafe { instance(handle) }?;
        let mut work = handle.work()?;
        let told = Told { progress, user };
        let go_on = |share: f64, stage: &'static str| !handle.stop.load(Ordering::Relaxed) && told.say(share, stage);
        let done = work.diagnosed(&go_on);
        work.last.of(done)
    })
}

/// The caller's progress function with what it wants back.
struct Told {
    progress: GibDiagnosisProgress,
    user: *mut c_void,
}

// SAFETY: the caller of gib_diagnosis_run promises that `progress` may be called with `user` from other threads.
unsafe impl Sync for Told {}

impl Told {
    fn say(&self, share: f64, stage: &str) -> bool {
        let Some(progress) = self.progress else { return true };
        let mut text = [0; 64];
        // SAFETY: the buffer is as large as said; a longer stage is cut, which is as good.
        let _ = unsafe { copy_out(stage, text.as_mut_ptr(), text.len(), core::ptr::null_mut()) };
        // SAFETY: the caller's promise.
        unsafe { progress(self.user, share, text.as_ptr()) == 0 }
    }
}

/// Stops a diagnosis that another thread works at: its `gib_diagnosis_run` returns GIB_ERR_ABORTED soon.
///
/// @param handle the instance.
/// @return GIB_OK, also when nothing is running; GIB_ERR_NULL, GIB_ERR_HANDLE.
///
/// [thread: any] [real-time: yes] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_diagnosis_abort(handle: *mut GibDiagnosis) -> i32 {
    // SAFETY: the caller's promise.
    match unsafe { instance(handle) } {
        Ok(handle) => {
            handle.stop.store(true, Ordering::Relaxed);
            GIB_OK
        }
        Err(status) => status,
    }
}

/// What the diagnosis came to, in numbers.
///
/// @param handle the instance.
/// @param report receives it; zeroed on an error.
/// @return GIB_OK; GIB_ERR_STATE before a `gib_diagnosis_run` is done, or while another thread works; GIB_ERR_NULL,
/// GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
///
/// [thread: setup] [real-time: no] [state: done]
///
/// # Safety
/// `handle` is NULL or an instance; `report` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_diagnosis_result(handle: *const GibDiagnosis, report: *mut GibDiagnosisReport) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let mut report = unsafe { report.as_mut() };
        if let Some(report) = &mut report {
            **report = GibDiagnosisReport::default();
        }
        // SAFETY: the caller's promise.
        let work = unsafe { instance(handle) }?.work()?;
        let report = report.ok_or_else(|| Refused(GIB_ERR_NULL, "report is NULL".into()));
        work.last.of(report.and_then(|report| {
            *report = GibDiagnosisReport::of(work.found()?.0);
            Ok(GIB_OK)
        }))
    })
}

impl GibDiagnosisReport {
    fn of(diagnosis: &Diagnosis) -> Self {
        let word = diagnosis.extended.drive.torque_word();
        let gain = diagnosis.gains.iter().find(|gain| gain.channel == word);
        Self {
            verdict: number(diagnosis.verdict),
            findings: diagnosis.findings.len() as u32,
            residual_before: gain.map_or(0.0, |gain| gain.before),
            residual_after: gain.map_or(0.0, |gain| gain.after),
            noise: diagnosis.unexplained.torque.noise_rms,
        }
    }
}

fn number(verdict: Verdict) -> i32 {
    match verdict {
        Verdict::NoDiscrepancy => GIB_DIAGNOSIS_NO_DISCREPANCY,
        Verdict::Explained => GIB_DIAGNOSIS_EXPLAINED,
        Verdict::PartlyExplained => GIB_DIAGNOSIS_PARTLY_EXPLAINED,
        Verdict::UnknownCause => GIB_DIAGNOSIS_UNKNOWN_CAUSE,
        Verdict::InsufficientData => GIB_DIAGNOSIS_INSUFFICIENT_DATA,
    }
}

/// The diagnosis as JSON with schema "gib.diagnosis/1".
///
/// Ask for the size first: `gib_diagnosis_json(handle, NULL, 0, &needed)` returns GIB_ERR_BUFFER and sets `needed`.
///
/// @param handle the instance.
/// @param json receives the text, UTF-8, with its NUL; NULL to ask for the size alone.
/// @param size bytes at `json`.
/// @param needed receives the bytes for all of it with its NUL; may be NULL.
/// @return GIB_OK; GIB_ERR_BUFFER when `size` is too small; GIB_ERR_STATE before a `gib_diagnosis_run` is done, or while
/// another thread works; GIB_ERR_NULL, GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
///
/// [thread: setup] [real-time: no] [state: done]
///
/// # Safety
/// `handle` is NULL or an instance; `json` is NULL or points to `size` writable bytes; `needed` is NULL or writable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_diagnosis_json(
    handle: *const GibDiagnosis,
    json: *mut c_char,
    size: usize,
    needed: *mut usize,
) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let work = unsafe { instance(handle) }?.work()?;
        let text = work.found().map(|(diagnosis, _)| format!("{:#}\n", diagnosis.to_json()));
        // SAFETY: the caller's promise.
        let copied = text.and_then(|text| unsafe { copy_out(&text, json, size, needed) }.map_err(Refused::from));
        work.last.of(copied)
    })
}

/// Puts the machine with what was found into a machine handle, to be saved, or to be diagnosed again.
///
/// @param handle the instance.
/// @param machine receives it; may be the one that the diagnosis was started with.
/// @return GIB_OK; GIB_ERR_STATE before a `gib_diagnosis_run` is done, or while another thread works; GIB_ERR_NULL,
/// GIB_ERR_HANDLE, GIB_ERR_INTERNAL.
///
/// [thread: setup] [real-time: no] [state: done]
///
/// # Safety
/// `handle` and `machine` are NULL or instances.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_diagnosis_machine(handle: *const GibDiagnosis, machine: *mut GibMachine) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        let (work, machine) = unsafe { (instance(handle)?.work()?, super::guard::instance_mut(machine)) };
        let machine = machine.map_err(|status| Refused(status, "machine is NULL or no machine".into()));
        work.last.of(machine.and_then(|machine| {
            machine.machine = Some(work.found()?.1.clone());
            Ok(GIB_OK)
        }))
    })
}

/// Why the last call failed, as a sentence that names file, row and column, what was found and what is allowed. Each
/// call of this family on the handle but gib_diagnosis_abort forgets the sentence of the one before and leaves its own if
/// it fails; a call that is refused because of the handle itself, or because another thread works, leaves none.
///
/// @param handle the instance.
/// @param text receives the sentence, UTF-8, with its NUL; empty when the last call did its work.
/// @param size bytes at `text`; a longer sentence is cut.
/// @return GIB_OK; GIB_ERR_BUFFER when the sentence was cut; GIB_ERR_STATE while another thread works; GIB_ERR_NULL,
/// GIB_ERR_HANDLE.
///
/// [thread: setup] [real-time: no] [state: any]
///
/// # Safety
/// `handle` is NULL or an instance; `text` is NULL or points to `size` writable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gib_diagnosis_last_error_text(
    handle: *const GibDiagnosis,
    text: *mut c_char,
    size: usize,
) -> i32 {
    guarded(|| {
        // SAFETY: the caller's promise.
        unsafe { copy_out(&instance(handle)?.work()?.last.sentence(), text, size, core::ptr::null_mut()) }
    })
}
