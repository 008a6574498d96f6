//! The table of all functions, for kernels that load gib with `dlopen` and want to look up one symbol only.
//!
//! Only ever append: a kernel compiled against a shorter table keeps its offsets, and tells from `struct_size`
//! what a library has. A function is one line in the struct and one in the table; the compiler compares the
//! signatures, and `tests/header.rs` fails when an exported function is not here. The table itself is in `entry.rs`.

use super::backlash::*;
use super::calibration::*;
use super::diagnosis::*;
use super::homing::*;
use super::inertia::*;
use super::learning::*;
use super::machine::*;
use super::program::*;
use super::recorder::*;
use super::speed_variation::*;
use super::tilt::*;
use super::types::GibErrorDetail;
use super::vibration::*;
use crate::cycle::backlash::config::BacklashConfig;
use crate::cycle::backlash::io::{BacklashInput, BacklashOutput};
use crate::cycle::backlash::verdict::{BacklashComparison, BacklashReport};
use crate::cycle::calibration::config::CalibrationConfig;
use crate::cycle::calibration::io::{CalibrationInput, CalibrationOutput};
use crate::cycle::calibration::table::CalibrationTable;
use crate::cycle::homing::config::HomingConfig;
use crate::cycle::homing::io::{HomingInput, HomingOutput};
use crate::cycle::homing::verdict::HomingReport;
use crate::cycle::inertia::config::InertiaConfig;
use crate::cycle::inertia::io::{InertiaInput, InertiaOutput};
use crate::cycle::inertia::report::InertiaReport;
use crate::cycle::learning::config::LearningConfig;
use crate::cycle::learning::io::{LearningInput, LearningOutput, LearningPoint, LearningReport};
use crate::cycle::speed_variation::config::{SpeedVariationConfig, SpeedVariationLimits};
use crate::cycle::speed_variation::io::{SpeedVariationInput, SpeedVariationOutput};
use crate::cycle::tilt::config::TiltConfig;
use crate::cycle::tilt::io::{TiltInput, TiltOutput};
use crate::cycle::tilt::table::{TiltTable, TiltTwoPointResult};
use crate::cycle::tilt::verdict::TiltReport;
use crate::cycle::vibration::config::VibrationConfig;
use crate::cycle::vibration::io::{VibrationInput, VibrationOutput, VibrationReport};
use core::ffi::{c_char, c_void};

/// All functions of the library, each named as in this header without its `gib_`.
///
/// Get it from `gib_api`. A member whose offset is not below `struct_size` is not in this library.
#[repr(C)]
pub struct GibApiTable {
    /// Size of the table that this library has, in bytes.
    pub struct_size: u32,
    /// Zero.
    pub reserved: u32,

    /// See gib_abi_version.
    pub abi_version: extern "C" fn() -> u32,
    /// See gib_version.
    pub version: extern "C" fn() -> *const c_char,
    /// See gib_status_text.
    pub status_text: extern "C" fn(status: i32) -> *const c_char,

    /// See gib_backlash_size.
    pub backlash_size: extern "C" fn() -> usize,
    /// See gib_backlash_init_in.
    pub backlash_init_in: unsafe extern "C" fn(memory: *mut c_void, size: usize, out: *mut *mut GibBacklash) -> i32,
    /// See gib_backlash_new.
    pub backlash_new: extern "C" fn() -> *mut GibBacklash,
    /// See gib_backlash_free.
    pub backlash_free: unsafe extern "C" fn(handle: *mut GibBacklash),
    /// See gib_backlash_start.
    pub backlash_start: unsafe extern "C" fn(handle: *mut GibBacklash, config: *const BacklashConfig) -> i32,
    /// See gib_backlash_step.
    pub backlash_step:
        unsafe extern "C" fn(handle: *mut GibBacklash, input: *const BacklashInput, output: *mut BacklashOutput) -> i32,
    /// See gib_backlash_abort.
    pub backlash_abort: unsafe extern "C" fn(handle: *mut GibBacklash) -> i32,
    /// See gib_backlash_restore.
    pub backlash_restore: unsafe extern "C" fn(handle: *mut GibBacklash) -> i32,
    /// See gib_backlash_enable.
    pub backlash_enable: unsafe extern "C" fn(handle: *mut GibBacklash, on: i32) -> i32,
    /// See gib_backlash_result.
    pub backlash_result: unsafe extern "C" fn(handle: *const GibBacklash, report: *mut BacklashReport) -> i32,
    /// See gib_backlash_curve.
    pub backlash_curve: unsafe extern "C" fn(
        handle: *const GibBacklash,
        sense: i32,
        travel_um: *mut f64,
        torque_nm: *mut f64,
        capacity: usize,
        count: *mut usize,
    ) -> i32,
    /// See gib_backlash_compare.
    pub backlash_compare: unsafe extern "C" fn(
        handle: *mut GibBacklash,
        measured_um: f64,
        uncertainty_um: f64,
        comparison: *mut BacklashComparison,
    ) -> i32,
    /// See gib_backlash_last_error.
    pub backlash_last_error: unsafe extern "C" fn(handle: *const GibBacklash, detail: *mut GibErrorDetail) -> i32,

    /// See gib_program_size.
    pub program_size: extern "C" fn() -> usize,
    /// See gib_program_init_in.
    pub program_init_in: unsafe extern "C" fn(memory: *mut c_void, size: usize, out: *mut *mut GibProgram) -> i32,
    /// See gib_program_new.
    pub program_new: extern "C" fn() -> *mut GibProgram,
    /// See gib_program_free.
    pub program_free: unsafe extern "C" fn(handle: *mut GibProgram),
    /// See gib_program_get.
    pub program_get:
        unsafe extern "C" fn(handle: *mut GibProgram, path: *const c_char, step: u32, inertia_kg_m2: *mut f64) -> i32,
    /// See gib_program_set.
    pub program_set: unsafe extern "C" fn(
        handle: *mut GibProgram,
        path: *const c_char,
        step: u32,
        inertia_kg_m2: f64,
        dialect: i32,
    ) -> i32,
    /// See gib_program_remove.
    pub program_remove: unsafe extern "C" fn(handle: *mut GibProgram, path: *const c_char, step: u32) -> i32,
    /// See gib_program_last_error.
    pub program_last_error: unsafe extern "C" fn(handle: *const GibProgram, detail: *mut GibErrorDetail) -> i32,
    /// See gib_program_last_error_text.
    pub program_last_error_text: unsafe extern "C" fn(handle: *const GibProgram, text: *mut c_char, size: usize) -> i32,

    /// See gib_homing_size.
    pub homing_size: extern "C" fn() -> usize,
    /// See gib_homing_init_in.
    pub homing_init_in: unsafe extern "C" fn(memory: *mut c_void, size: usize, out: *mut *mut GibHoming) -> i32,
    /// See gib_homing_new.
    pub homing_new: extern "C" fn() -> *mut GibHoming,
    /// See gib_homing_free.
    pub homing_free: unsafe extern "C" fn(handle: *mut GibHoming),
    /// See gib_homing_start.
    pub homing_start: unsafe extern "C" fn(handle: *mut GibHoming, config: *const HomingConfig) -> i32,
    /// See gib_homing_step.
    pub homing_step:
        unsafe extern "C" fn(handle: *mut GibHoming, input: *const HomingInput, output: *mut HomingOutput) -> i32,
    /// See gib_homing_abort.
    pub homing_abort: unsafe extern "C" fn(handle: *mut GibHoming) -> i32,
    /// See gib_homing_result.
    pub homing_result: unsafe extern "C" fn(handle: *const GibHoming, report: *mut HomingReport) -> i32,
    /// See gib_homing_last_error.
    pub homing_last_error: unsafe extern "C" fn(handle: *const GibHoming, detail: *mut GibErrorDetail) -> i32,
    /// See gib_inertia_size.
    pub inertia_size: extern "C" fn() -> usize,
    /// See gib_inertia_init_in.
    pub inertia_init_in: unsafe extern "C" fn(memory: *mut c_void, size: usize, out: *mut *mut GibInertia) -> i32,
    /// See gib_inertia_new.
    pub inertia_new: extern "C" fn() -> *mut GibInertia,
    /// See gib_inertia_free.
    pub inertia_free: unsafe extern "C" fn(handle: *mut GibInertia),
    /// See gib_inertia_start.
    pub inertia_start: unsafe extern "C" fn(handle: *mut GibInertia, config: *const InertiaConfig) -> i32,
    /// See gib_inertia_step.
    pub inertia_step:
        unsafe extern "C" fn(handle: *mut GibInertia, input: *const InertiaInput, output: *mut InertiaOutput) -> i32,
    /// See gib_inertia_abort.
    pub inertia_abort: unsafe extern "C" fn(handle: *mut GibInertia) -> i32,
    /// See gib_inertia_result.
    pub inertia_result: unsafe extern "C" fn(handle: *mut GibInertia, report: *mut InertiaReport) -> i32,
    /// See gib_inertia_last_error.
    pub inertia_last_error: unsafe extern "C" fn(handle: *const GibInertia, detail: *mut GibErrorDetail) -> i32,

    /// See gib_speed_variation_size.
    pub speed_variation_size: extern "C" fn() -> usize,
    /// See gib_speed_variation_init_in.
    pub speed_variation_init_in:
        unsafe extern "C" fn(memory: *mut c_void, size: usize, out: *mut *mut GibSpeedVariation) -> i32,
    /// See gib_speed_variation_new.
    pub speed_variation_new: extern "C" fn() -> *mut GibSpeedVariation,
    /// See gib_speed_variation_free.
    pub speed_variation_free: unsafe extern "C" fn(handle: *mut GibSpeedVariation),
    /// See gib_speed_variation_start.
    pub speed_variation_start:
        unsafe extern "C" fn(handle: *mut GibSpeedVariation, config: *const SpeedVariationConfig) -> i32,
    /// See gib_speed_variation_step.
    pub speed_variation_step: unsafe extern "C" fn(
        handle: *mut GibSpeedVariation,
        input: *const SpeedVariationInput,
        output: *mut SpeedVariationOutput,
    ) -> i32,
    /// See gib_speed_variation_abort.
    pub speed_variation_abort: unsafe extern "C" fn(handle: *mut GibSpeedVariation) -> i32,
    /// See gib_speed_variation_result.
    pub speed_variation_result:
        unsafe extern "C" fn(handle: *mut GibSpeedVariation, limits: *mut SpeedVariationLimits) -> i32,
    /// See gib_speed_variation_possible.
    pub speed_variation_possible:
        unsafe extern "C" fn(config: *const SpeedVariationConfig, limits: *mut SpeedVariationLimits) -> i32,
    /// See gib_speed_variation_last_error.
    pub speed_variation_last_error:
        unsafe extern "C" fn(handle: *const GibSpeedVariation, detail: *mut GibErrorDetail) -> i32,

    /// See gib_recorder_size.
    pub recorder_size: extern "C" fn() -> usize,
    /// See gib_recorder_init_in.
    pub recorder_init_in: unsafe extern "C" fn(memory: *mut c_void, size: usize, out: *mut *mut GibRecorder) -> i32,
    /// See gib_recorder_new.
    pub recorder_new: extern "C" fn() -> *mut GibRecorder,
    /// See gib_recorder_free.
    pub recorder_free: unsafe extern "C" fn(handle: *mut GibRecorder),
    /// See gib_recorder_start.
    pub recorder_start: unsafe extern "C" fn(handle: *mut GibRecorder, config: *const GibRecorderConfig) -> i32,
    /// See gib_recorder_step.
    pub recorder_step: unsafe extern "C" fn(handle: *mut GibRecorder, values: *const f64, count: u32) -> i32,
    /// See gib_recorder_abort.
    pub recorder_abort: unsafe extern "C" fn(handle: *mut GibRecorder) -> i32,
    /// See gib_recorder_close.
    pub recorder_close: unsafe extern "C" fn(handle: *mut GibRecorder) -> i32,
    /// See gib_recorder_result.
    pub recorder_result: unsafe extern "C" fn(handle: *const GibRecorder, report: *mut GibRecorderReport) -> i32,
    /// See gib_recorder_last_error.
    pub recorder_last_error: unsafe extern "C" fn(handle: *const GibRecorder, detail: *mut GibErrorDetail) -> i32,

    /// See gib_vibration_size.
    pub vibration_size: extern "C" fn() -> usize,
    /// See gib_vibration_init_in.
    pub vibration_init_in: unsafe extern "C" fn(memory: *mut c_void, size: usize, out: *mut *mut GibVibration) -> i32,
    /// See gib_vibration_new.
    pub vibration_new: extern "C" fn() -> *mut GibVibration,
    /// See gib_vibration_free.
    pub vibration_free: unsafe extern "C" fn(handle: *mut GibVibration),
    /// See gib_vibration_start.
    pub vibration_start: unsafe extern "C" fn(
        handle: *mut GibVibration,
        config: *const VibrationConfig,
        table: *const CalibrationTable,
    ) -> i32,
    /// See gib_vibration_step.
    pub vibration_step: unsafe extern "C" fn(
        handle: *mut GibVibration,
        input: *const VibrationInput,
        output: *mut VibrationOutput,
    ) -> i32,
    /// See gib_vibration_abort.
    pub vibration_abort: unsafe extern "C" fn(handle: *mut GibVibration) -> i32,
    /// See gib_vibration_result.
    pub vibration_result: unsafe extern "C" fn(handle: *const GibVibration, report: *mut VibrationReport) -> i32,
    /// See gib_vibration_last_error.
    pub vibration_last_error: unsafe extern "C" fn(handle: *const GibVibration, detail: *mut GibErrorDetail) -> i32,

    /// See gib_calibration_size.
    pub calibration_size: extern "C" fn() -> usize,
    /// See gib_calibration_init_in.
    pub calibration_init_in:
        unsafe extern "C" fn(memory: *mut c_void, size: usize, out: *mut *mut GibCalibration) -> i32,
    /// See gib_calibration_new.
    pub calibration_new: extern "C" fn() -> *mut GibCalibration,
    /// See gib_calibration_free.
    pub calibration_free: unsafe extern "C" fn(handle: *mut GibCalibration),
    /// See gib_calibration_start.
    pub calibration_start: unsafe extern "C" fn(handle: *mut GibCalibration, config: *const CalibrationConfig) -> i32,
    /// See gib_calibration_step.
    pub calibration_step: unsafe extern "C" fn(
        handle: *mut GibCalibration,
        input: *const CalibrationInput,
        output: *mut CalibrationOutput,
    ) -> i32,
    /// See gib_calibration_abort.
    pub calibration_abort: unsafe extern "C" fn(handle: *mut GibCalibration) -> i32,
    /// See gib_calibration_result.
    pub calibration_result: unsafe extern "C" fn(handle: *const GibCalibration, table: *mut CalibrationTable) -> i32,
    /// See gib_calibration_save.
    pub calibration_save: unsafe extern "C" fn(handle: *mut GibCalibration, path: *const c_char) -> i32,
    /// See gib_calibration_load.
    pub calibration_load: unsafe extern "C" fn(handle: *mut GibCalibration, path: *const c_char) -> i32,
    /// See gib_calibration_last_error.
    pub calibration_last_error: unsafe extern "C" fn(handle: *const GibCalibration, detail: *mut GibErrorDetail) -> i32,
    /// See gib_tilt_size.
    pub tilt_size: extern "C" fn() -> usize,
    /// See gib_tilt_init_in.
    pub tilt_init_in: unsafe extern "C" fn(memory: *mut c_void, size: usize, out: *mut *mut GibTilt) -> i32,
    /// See gib_tilt_new.
    pub tilt_new: extern "C" fn() -> *mut GibTilt,
    /// See gib_tilt_free.
    pub tilt_free: unsafe extern "C" fn(handle: *mut GibTilt),
    /// See gib_tilt_start.
    pub tilt_start:
        unsafe extern "C" fn(handle: *mut GibTilt, config: *const TiltConfig, table: *const TiltTable) -> i32,
    /// See gib_tilt_step.
    pub tilt_step: unsafe extern "C" fn(handle: *mut GibTilt, input: *const TiltInput, output: *mut TiltOutput) -> i32,
    /// See gib_tilt_abort.
    pub tilt_abort: unsafe extern "C" fn(handle: *mut GibTilt) -> i32,
    /// See gib_tilt_result.
    pub tilt_result: unsafe extern "C" fn(handle: *const GibTilt, report: *mut TiltReport) -> i32,
    /// See gib_tilt_last_error.
    pub tilt_last_error: unsafe extern "C" fn(handle: *const GibTilt, detail: *mut GibErrorDetail) -> i32,
    /// See gib_tilt_table_add.
    pub tilt_table_add: unsafe extern "C" fn(
        table: *mut TiltTable,
        depth_mm: f64,
        load: f64,
        load_std: f64,
        detail: *mut GibErrorDetail,
    ) -> i32,
    /// See gib_tilt_table_check.
    pub tilt_table_check: unsafe extern "C" fn(table: *const TiltTable, detail: *mut GibErrorDetail) -> i32,
    /// See gib_tilt_table_save.
    pub tilt_table_save:
        unsafe extern "C" fn(table: *const TiltTable, path: *const c_char, detail: *mut GibErrorDetail) -> i32,
    /// See gib_tilt_table_load.
    pub tilt_table_load:
        unsafe extern "C" fn(table: *mut TiltTable, path: *const c_char, detail: *mut GibErrorDetail) -> i32,
    /// See gib_tilt_two_point.
    pub tilt_two_point: unsafe extern "C" fn(
        table: *const TiltTable,
        position_mm: *const f64,
        load: *const f64,
        result: *mut TiltTwoPointResult,
        detail: *mut GibErrorDetail,
    ) -> i32,

    /// See gib_machine_new.
    pub machine_new: extern "C" fn() -> *mut GibMachine,
    /// See gib_machine_free.
    pub machine_free: unsafe extern "C" fn(handle: *mut GibMachine),
    /// See gib_machine_read.
    pub machine_read: unsafe extern "C" fn(handle: *mut GibMachine, json: *const c_char, length: usize) -> i32,
    /// See gib_machine_load.
    pub machine_load: unsafe extern "C" fn(handle: *mut GibMachine, path: *const c_char) -> i32,
    /// See gib_machine_save.
    pub machine_save: unsafe extern "C" fn(handle: *mut GibMachine, path: *const c_char) -> i32,
    /// See gib_machine_result.
    pub machine_result:
        unsafe extern "C" fn(handle: *const GibMachine, json: *mut c_char, size: usize, needed: *mut usize) -> i32,
    /// See gib_machine_ignored_keys.
    pub machine_ignored_keys:
        unsafe extern "C" fn(handle: *const GibMachine, text: *mut c_char, size: usize, needed: *mut usize) -> i32,
    /// See gib_machine_last_error_text.
    pub machine_last_error_text: unsafe extern "C" fn(handle: *const GibMachine, text: *mut c_char, size: usize) -> i32,

    /// See gib_diagnosis_new.
    pub diagnosis_new: extern "C" fn() -> *mut GibDiagnosis,
    /// See gib_diagnosis_free.
    pub diagnosis_free: unsafe extern "C" fn(handle: *mut GibDiagnosis),
    /// See gib_diagnosis_start.
    pub diagnosis_start: unsafe extern "C" fn(handle: *mut GibDiagnosis, config: *const GibDiagnosisConfig) -> i32,
    /// See gib_diagnosis_run.
    pub diagnosis_run:
        unsafe extern "C" fn(handle: *mut GibDiagnosis, progress: GibDiagnosisProgress, user: *mut c_void) -> i32,
    /// See gib_diagnosis_abort.
    pub diagnosis_abort: unsafe extern "C" fn(handle: *mut GibDiagnosis) -> i32,
    /// See gib_diagnosis_result.
    pub diagnosis_result: unsafe extern "C" fn(handle: *const GibDiagnosis, report: *mut GibDiagnosisReport) -> i32,
    /// See gib_diagnosis_json.
    pub diagnosis_json:
        unsafe extern "C" fn(handle: *const GibDiagnosis, json: *mut c_char, size: usize, needed: *mut usize) -> i32,
    /// See gib_diagnosis_machine.
    pub diagnosis_machine: unsafe extern "C" fn(handle: *const GibDiagnosis, machine: *mut GibMachine) -> i32,
    /// See gib_diagnosis_last_error_text.
    pub diagnosis_last_error_text:
        unsafe extern "C" fn(handle: *const GibDiagnosis, text: *mut c_char, size: usize) -> i32,

    /// See gib_learning_size.
    pub learning_size: extern "C" fn() -> usize,
    /// See gib_learning_init_in.
    pub learning_init_in: unsafe extern "C" fn(memory: *mut c_void, size: usize, out: *mut *mut GibLearning) -> i32,
    /// See gib_learning_new.
    pub learning_new: extern "C" fn() -> *mut GibLearning,
    /// See gib_learning_free.
    pub learning_free: unsafe extern "C" fn(handle: *mut GibLearning),
    /// See gib_learning_start.
    pub learning_start: unsafe extern "C" fn(handle: *mut GibLearning, config: *const LearningConfig) -> i32,
    /// See gib_learning_step.
    pub learning_step:
        unsafe extern "C" fn(handle: *mut GibLearning, input: *const LearningInput, output: *mut LearningOutput) -> i32,
    /// See gib_learning_abort.
    pub learning_abort: unsafe extern "C" fn(handle: *mut GibLearning) -> i32,
    /// See gib_learning_result.
    pub learning_result: unsafe extern "C" fn(handle: *const GibLearning, report: *mut LearningReport) -> i32,
    /// See gib_learning_points.
    pub learning_points: unsafe extern "C" fn(
        handle: *const GibLearning,
        points: *mut LearningPoint,
        capacity: usize,
        count: *mut usize,
    ) -> i32,
    /// See gib_learning_save.
    pub learning_save: unsafe extern "C" fn(handle: *mut GibLearning, path: *const c_char) -> i32,
    /// See gib_learning_load.
    pub learning_load: unsafe extern "C" fn(handle: *mut GibLearning, path: *const c_char) -> i32,
    /// See gib_learning_last_error.
    pub learning_last_error: unsafe extern "C" fn(handle: *const GibLearning, detail: *mut GibErrorDetail) -> i32,

    /// See gib_recorder_step_from.
    pub recorder_step_from:
        unsafe extern "C" fn(handle: *mut GibRecorder, sources: *const *const f64, count: u32) -> i32,
}
