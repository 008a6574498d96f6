//! How many times real time the plant runs on one core at a 25 µs step, beside a plain C loop of the same model.
//!
//! `cargo bench --bench plant_speed`. Needs a C compiler as `cc`; without one only the plant's own figure is printed.
//! Where python3 has `mujoco`, its figure for one slide with friction stands below.
//! The two must end at the same position, else they are not the same model and the benchmark fails.

use gib::machine::{Axis, Effect, Machine};
use gib::plant::simulate::{Setup, simulate};
use std::f64::consts::TAU;
use std::path::Path;
use std::process::{Command, ExitCode};

const RIG: &str = r#"{ "schema": "gib.machine/1", "name": "rig", "axes": [ {
    "name": "x", "drive": "ball_screw", "lead_mm": 10.0, "inertia_kg_m2": 0.0028, "coulomb_friction_nm": 0.9,
    "viscous_friction_nm_s": 0.008, "torque_limit_nm": 16.0,
    "servo": { "period_s": 0.001, "position_gain_1_s": 40.0, "velocity_gain_nm_s": 0.528, "velocity_integral_time_s": 0.02,
               "velocity_feedforward": 1.0, "torque_time_constant_s": 0.0005 } } ] }"#;
/// Simulated servo cycles of 1 ms.
const CYCLES: usize = 120_000;
/// The best of so many runs counts: others use the machine too.
const RUNS: usize = 7;

fn main() -> ExitCode {
    let Ok(machine) = Machine::parse(RIG) else { return ExitCode::FAILURE };
    let rigid = machine.axes[0].clone();
    let two_masses = rigid.with_effects(vec![
        Effect::DriveCompliance {
            resonance_hz: 60.0,
            stiffness_n_um: 30.0,
            table_inertia_share: 0.5,
            table_friction_share: 0.5,
            damping_ratio: 0.05,
        },
        Effect::Backlash {
            width_um: 20.0,
            table_inertia_share: 0.5,
            table_friction_share: 0.5,
            contact_hz: 700.0,
            contact_damping_ratio: 0.3,
        },
        Effect::PreslidingFriction { displacement_um: 8.0, exponent: 1.0, maxwell_slip: 0.0, micro_damping_s: 0.0 },
        Effect::StribeckFriction { torque: 0.3, velocity_mm_s: 4.0, exponent: 2.0 },
    ]);
    let c = compiled();
    let mut same = true;
    println!("times real time, one core, 25 µs plant step, best of {RUNS}");
    for (model, name, axis, target) in
        [(0, "rigid axis under its servo", &rigid, 2000.0), (1, "two masses, clearance, LuGre", &two_masses, 800.0)]
    {
        let (seconds, end) = best(|| of_plant(axis));
        print!("{name:30} {:7.0} (target {target})", CYCLES as f64 * 1e-3 / seconds);
        if let Some(program) = &c {
            let (c_seconds, c_end) = best(|| of_c(program, model));
            print!(
                "   plain C {:7.0}, plant takes {:.2} of its time",
                CYCLES as f64 * 1e-3 / c_seconds,
                seconds / c_seconds
            );
            if (end - c_end).abs() > 1e-6 {
                print!("   NOT THE SAME MODEL: ends at {end} and {c_end} mm");
                same = false;
            }
        }
        println!();
    }
    match of_mujoco() {
        Some(speed) => println!("MuJoCo, one slide with friction {speed:6.1}"),
        None => println!("MuJoCo: not installed for python3, left out"),
    }
    if same { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn best(run: impl Fn() -> (f64, f64)) -> (f64, f64) {
    (0..RUNS).map(|_| run()).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::NAN, f64::NAN))
}

/// Seconds of computing and the last encoder position.
fn of_plant(axis: &Axis) -> (f64, f64) {
    let command: Vec<f64> = (0..CYCLES).map(|k| 20.0 * (1.0 - (TAU * 0.5 * k as f64 * 1e-3).cos())).collect();
    let begin = cpu_s();
    let trace = simulate(axis, &command, &Setup::default());
    let seconds = cpu_s() - begin;
    (seconds, trace.ok().and_then(|trace| trace.position.last().copied()).unwrap_or(f64::NAN))
}

/// Times real time of MuJoCo, where Python has it.
fn of_mujoco() -> Option<f64> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/plant_speed/mujoco_slide.py");
    let output = Command::new("python3").arg(script).output().ok()?;
    String::from_utf8_lossy(&output.stdout).trim().parse().ok()
}

/// Seconds of computing by this process, so that others on the machine do not count.
fn cpu_s() -> f64 {
    let mut now = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `now` is a valid timespec for the whole call.
    unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &raw mut now) };
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

/// The C program in a folder that goes with it; `None` without a compiler.
fn compiled() -> Option<tempfile::TempPath> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/plant_speed/plant.c");
    let program = tempfile::Builder::new().prefix("gib-plant").tempfile().ok()?.into_temp_path();
    let status = Command::new("cc").arg("-O3").arg("-o").arg(&*program).arg(source).arg("-lm").status();
    if status.is_ok_and(|status| status.success()) { Some(program) } else { None }
}

fn of_c(program: &Path, model: usize) -> (f64, f64) {
    let nothing = (f64::NAN, f64::NAN);
    let Ok(output) = Command::new(program).args([model.to_string(), CYCLES.to_string()]).output() else {
        return nothing;
    };
    let text = String::from_utf8_lossy(&output.stdout);
    let mut numbers = text.split_whitespace().filter_map(|word| word.parse().ok());
    numbers.next().zip(numbers.next()).unwrap_or(nothing)
}
