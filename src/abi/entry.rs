//! The one symbol that a kernel looks up after `dlopen`: `gib_api`, and the table it returns.
//!
//! The struct is in `api.rs`; the compiler compares the signatures.

use super::api::GibApiTable;
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
use super::vibration::*;
use super::{GIB_ABI_VERSION, gib_abi_version, gib_status_text, gib_version};

static API: GibApiTable = GibApiTable {
    struct_size: size_of::<GibApiTable>() as u32,
    reserved: 0,

    abi_version: gib_abi_version,
    version: gib_version,
    status_text: gib_status_text,

    backlash_size: gib_backlash_size,
    backlash_init_in: gib_backlash_init_in,
    backlash_new: gib_backlash_new,
    backlash_free: gib_backlash_free,
    backlash_start: gib_backlash_start,
    backlash_step: gib_backlash_step,
    backlash_abort: gib_backlash_abort,
    backlash_restore: gib_backlash_restore,
    backlash_enable: gib_backlash_enable,
    backlash_result: gib_backlash_result,
    backlash_curve: gib_backlash_curve,
    backlash_compare: gib_backlash_compare,
    backlash_last_error: gib_backlash_last_error,

    program_size: gib_program_size,
    program_init_in: gib_program_init_in,
    program_new: gib_program_new,
    program_free: gib_program_free,
    program_get: gib_program_get,
    program_set: gib_program_set,
    program_remove: gib_program_remove,
    program_last_error: gib_program_last_error,
    program_last_error_text: gib_program_last_error_text,

    homing_size: gib_homing_size,
    homing_init_in: gib_homing_init_in,
    homing_new: gib_homing_new,
    homing_free: gib_homing_free,
    homing_start: gib_homing_start,
    homing_step: gib_homing_step,
    homing_abort: gib_homing_abort,
    homing_result: gib_homing_result,
    homing_last_error: gib_homing_last_error,
    inertia_size: gib_inertia_size,
    inertia_init_in: gib_inertia_init_in,
    inertia_new: gib_inertia_new,
    inertia_free: gib_inertia_free,
    inertia_start: gib_inertia_start,
    inertia_step: gib_inertia_step,
    inertia_abort: gib_inertia_abort,
    inertia_result: gib_inertia_result,
    inertia_last_error: gib_inertia_last_error,

    speed_variation_size: gib_speed_variation_size,
    speed_variation_init_in: gib_speed_variation_init_in,
    speed_variation_new: gib_speed_variation_new,
    speed_variation_free: gib_speed_variation_free,
    speed_variation_start: gib_speed_variation_start,
    speed_variation_step: gib_speed_variation_step,
    speed_variation_abort: gib_speed_variation_abort,
    speed_variation_result: gib_speed_variation_result,
    speed_variation_possible: gib_speed_variation_possible,
    speed_variation_last_error: gib_speed_variation_last_error,

    recorder_size: gib_recorder_size,
    recorder_init_in: gib_recorder_init_in,
    recorder_new: gib_recorder_new,
    recorder_free: gib_recorder_free,
    recorder_start: gib_recorder_start,
    recorder_step: gib_recorder_step,
    recorder_abort: gib_recorder_abort,
    recorder_close: gib_recorder_close,
    recorder_result: gib_recorder_result,
    recorder_last_error: gib_recorder_last_error,

    vibration_size: gib_vibration_size,
    vibration_init_in: gib_vibration_init_in,
    vibration_new: gib_vibration_new,
    vibration_free: gib_vibration_free,
    vibration_start: gib_vibration_start,
    vibration_step: gib_vibration_step,
    vibration_abort: gib_vibration_abort,
    vibration_result: gib_vibration_result,
    vibration_last_error: gib_vibration_last_error,

    calibration_size: gib_calibration_size,
    calibration_init_in: gib_calibration_init_in,
    calibration_new: gib_calibration_new,
    calibration_free: gib_calibration_free,
    calibration_start: gib_calibration_start,
    calibration_step: gib_calibration_step,
    calibration_abort: gib_calibration_abort,
    calibration_result: gib_calibration_result,
    calibration_save: gib_calibration_save,
    calibration_load: gib_calibration_load,
    calibration_last_error: gib_calibration_last_error,
    tilt_size: gib_tilt_size,
    tilt_init_in: gib_tilt_init_in,
    tilt_new: gib_tilt_new,
    tilt_free: gib_tilt_free,
    tilt_start: gib_tilt_start,
    tilt_step: gib_tilt_step,
    tilt_abort: gib_tilt_abort,
    tilt_result: gib_tilt_result,
    tilt_last_error: gib_tilt_last_error,
    tilt_table_add: gib_tilt_table_add,
    tilt_table_check: gib_tilt_table_check,
    tilt_table_save: gib_tilt_table_save,
    tilt_table_load: gib_tilt_table_load,
    tilt_two_point: gib_tilt_two_point,
    machine_new: gib_machine_new,
    machine_free: gib_machine_free,
    machine_read: gib_machine_read,
    machine_load: gib_machine_load,
    machine_save: gib_machine_save,
    machine_result: gib_machine_result,
    machine_ignored_keys: gib_machine_ignored_keys,
    machine_last_error_text: gib_machine_last_error_text,
    diagnosis_new: gib_diagnosis_new,
    diagnosis_free: gib_diagnosis_free,
    diagnosis_start: gib_diagnosis_start,
    diagnosis_run: gib_diagnosis_run,
    diagnosis_abort: gib_diagnosis_abort,
    diagnosis_result: gib_diagnosis_result,
    diagnosis_json: gib_diagnosis_json,
    diagnosis_machine: gib_diagnosis_machine,
    diagnosis_last_error_text: gib_diagnosis_last_error_text,
    learning_size: gib_learning_size,
    learning_init_in: gib_learning_init_in,
    learning_new: gib_learning_new,
    learning_free: gib_learning_free,
    learning_start: gib_learning_start,
    learning_step: gib_learning_step,
    learning_abort: gib_learning_abort,
    learning_result: gib_learning_result,
    learning_points: gib_learning_points,
    learning_save: gib_learning_save,
    learning_load: gib_learning_load,
    learning_last_error: gib_learning_last_error,

    recorder_step_from: gib_recorder_step_from,
};

/// The table of all functions, so that `dlsym` needs one name: "gib_api".
///
/// @param version pass `GIB_ABI_VERSION`.
/// @return a table that lives as long as the library is loaded and is never freed; NULL when this library cannot serve
/// that version, because its major differs or its minor is older.
///
/// [thread: any] [real-time: yes] [state: any]
#[unsafe(no_mangle)]
pub extern "C" fn gib_api(version: u32) -> *const GibApiTable {
    if serves(GIB_ABI_VERSION, version) { &raw const API } else { core::ptr::null() }
}

/// Whether a library of version `have` serves a caller of version `wanted`: same major, minor not older.
fn serves(have: u32, wanted: u32) -> bool {
    have >> 16 == wanted >> 16 && wanted & 0xffff <= have & 0xffff
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_is_served_for_this_major_and_older_minors_only() {
        assert!(core::ptr::eq(gib_api(GIB_ABI_VERSION), &raw const API));
        assert!(gib_api(GIB_ABI_VERSION + 1).is_null());
        assert!(gib_api(GIB_ABI_VERSION + 0x1_0000).is_null());
        assert!(serves(0x2_0005, 0x2_0003) && !serves(0x2_0005, 0x2_0006) && !serves(0x2_0005, 0x1_0005));
    }
}
