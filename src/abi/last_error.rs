//! Why the last call of an instance failed, as a sentence.

use crate::error::status_text;
use std::sync::{Mutex, PoisonError};

/// Why a call did not do its work: the status, and a sentence for people.
pub struct Refused(pub i32, pub String);

impl From<i32> for Refused {
    fn from(status: i32) -> Self {
        Refused(status, status_text(status).trim_end_matches('\0').to_owned())
    }
}

/// The sentence of the last call that failed.
#[derive(Default)]
pub struct LastError(Mutex<String>);

impl LastError {
    /// Keeps the sentence of this call, none where it did its work, so that no call shows that of another.
    ///
    /// # Errors
    /// Those of the call.
    pub fn of(&self, outcome: Result<i32, Refused>) -> Result<i32, i32> {
        let (status, sentence) = match outcome {
            Ok(status) => (Ok(status), String::new()),
            Err(Refused(status, sentence)) => (Err(status), sentence),
        };
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = sentence;
        status
    }

    /// The sentence.
    pub fn sentence(&self) -> String {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

#[cfg(test)]
mod tests {
    use super::super::diagnosis::*;
    use super::super::machine::*;
    use crate::error::*;
    use core::ffi::c_char;
    use core::ptr::{null, null_mut};

    fn sentence(ask: impl FnOnce(*mut c_char, usize) -> i32) -> String {
        let mut text = [0u8; 256];
        assert_eq!(ask(text.as_mut_ptr().cast(), text.len()), GIB_OK);
        core::ffi::CStr::from_bytes_until_nul(&text).unwrap().to_str().unwrap().to_owned()
    }

    fn of_machine(handle: *const GibMachine) -> String {
        // SAFETY: an instance, a buffer as large as said.
        sentence(|text, size| unsafe { gib_machine_last_error_text(handle, text, size) })
    }

    fn of_diagnosis(handle: *const GibDiagnosis) -> String {
        // SAFETY: an instance, a buffer as large as said.
        sentence(|text, size| unsafe { gib_diagnosis_last_error_text(handle, text, size) })
    }

    #[test]
    fn of_a_machine_each_call_says_why_it_failed_or_forgets_it() {
        let handle = gib_machine_new();
        let mut needed = 0;
        // SAFETY: an instance, texts with a NUL, NULL where it is allowed.
        unsafe {
            assert_eq!(gib_machine_load(handle, c"/none.json".as_ptr()), GIB_ERR_IO);
            assert!(of_machine(handle).contains("/none.json"));
            assert_eq!(gib_machine_save(handle, c"/none/m.json".as_ptr()), GIB_ERR_STATE);
            assert!(of_machine(handle).contains("no machine was read"));
            assert_eq!(gib_machine_load(handle, null()), GIB_ERR_NULL);
            assert!(of_machine(handle).contains("NULL"));
            let json = r#"{"schema":"gib.machine/1","axes":[{"name":"x","drive":"linear","mass_kg":9}]}"#;
            assert_eq!(gib_machine_read(handle, json.as_ptr().cast(), json.len()), GIB_OK);
            assert_eq!(of_machine(handle), "");
            assert_eq!(gib_machine_save(handle, c"/none/m.json".as_ptr()), GIB_ERR_IO);
            assert!(of_machine(handle).contains("/none/m.json"));
            assert_eq!(gib_machine_ignored_keys(handle, null_mut(), 0, &raw mut needed), GIB_ERR_BUFFER);
            assert!(of_machine(handle).contains("too small"));
            let mut keys = [0; 8];
            assert_eq!(gib_machine_ignored_keys(handle, keys.as_mut_ptr(), 8, null_mut()), GIB_OK);
            assert_eq!(of_machine(handle), "");
            gib_machine_free(handle);
        }
    }

    #[test]
    fn of_a_diagnosis_each_call_says_why_it_failed_or_forgets_it() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("r.csv");
        let rows: String = (0..20).map(|i| format!("0.{i:03},{i},1\n")).collect();
        std::fs::write(&file, format!("time_s,x.position_mm,x.force_n\n{rows}")).unwrap();
        let path = std::ffi::CString::new(file.to_str().unwrap()).unwrap();
        let json = r#"{"schema":"gib.machine/1","axes":[{"name":"x","drive":"linear","mass_kg":9}]}"#;
        let (handle, machine) = (gib_diagnosis_new(), gib_machine_new());
        let mut config = GibDiagnosisConfig {
            struct_size: size_of::<GibDiagnosisConfig>() as u32,
            reserved: 0,
            machine,
            recording: path.as_ptr(),
            holdout: null(),
            axis: null(),
        };
        // SAFETY: instances, texts with a NUL, NULL where it is allowed or refused.
        unsafe {
            let said = |status: i32, wanted: i32, told: &str| {
                let why = of_diagnosis(handle);
                assert!(status == wanted && (why == told || !told.is_empty() && why.contains(told)), "{status} {why}");
            };
            said(gib_diagnosis_run(handle, None, null_mut()), GIB_ERR_STATE, "gib_diagnosis_start");
            said(gib_diagnosis_start(handle, null()), GIB_ERR_NULL, "config is NULL");
            said(gib_diagnosis_start(handle, &raw const config), GIB_ERR_STATE, "config.machine");
            assert_eq!(gib_machine_read(machine, json.as_ptr().cast(), json.len()), GIB_OK);
            config.axis = c"\xff".as_ptr();
            said(gib_diagnosis_start(handle, &raw const config), GIB_ERR_FORMAT, "config.axis is not UTF-8");
            (config.axis, config.holdout) = (null(), path.as_ptr());
            said(gib_diagnosis_start(handle, &raw const config), GIB_ERR_DIAGNOSIS_HOLDOUT, "the recording itself");
            config.holdout = null();
            said(gib_diagnosis_start(handle, &raw const config), GIB_OK, "");
            said(gib_diagnosis_json(handle, null_mut(), 0, null_mut()), GIB_ERR_STATE, "no gib_diagnosis_run");
            said(gib_diagnosis_run(handle, None, null_mut()), GIB_DONE, "");
            said(gib_diagnosis_result(handle, null_mut()), GIB_ERR_NULL, "report is NULL");
            said(gib_diagnosis_machine(handle, null_mut()), GIB_ERR_NULL, "machine is NULL");
            said(gib_diagnosis_machine(handle, machine), GIB_OK, "");
            gib_diagnosis_free(handle);
            gib_machine_free(machine);
        }
    }
}
