//! Prediction on recordings whose answer is known from elsewhere.

use gib::machine::Machine;
use gib::plant::observed::Observed;
use gib::plant::predict::predict_torque;
use gib::recording::Recording;
use std::path::PathBuf;

/// The folder of measured data; says so once where it is absent.
fn data(file: &str) -> Option<PathBuf> {
    let root = std::env::var_os("GIB_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    let path = root.join(file);
    if !path.exists() {
        println!("{} is absent: not checked", path.display());
        return None;
    }
    Some(path)
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0.0), |(sum, n), v: f64| (sum + v * v, n + 1.0));
    (sum / n).sqrt()
}

#[test]
fn explore() {
    for (m, r) in [("rig-clean/machine.json", "rig-clean/recording.csv"), ("emps/machine.json", "emps/emps.csv")] {
        let (Some(m), Some(r)) = (data(m), data(r)) else { return };
        let machine = Machine::load(&m).unwrap();
        let recording = Recording::open(&r).unwrap();
        let observed = Observed::of(&recording, &machine.axes[0]).unwrap();
        let p = predict_torque(&machine.axes[0], &observed).unwrap();
        let e: Vec<f64> = observed.torque.iter().zip(&p.torque).map(|(a, b)| a - b).collect();
        println!(
            "{} runs, cut-off {} Hz, resolution {} mm, rms {}, moving {}",
            observed.runs.len(),
            observed.motion.cutoff_hz,
            observed.motion.resolution,
            rms(e.iter().copied()),
            rms(e.iter().zip(&observed.motion.velocity).filter(|(_, v)| v.abs() > 4.0).map(|(e, _)| *e))
        );
    }
}
