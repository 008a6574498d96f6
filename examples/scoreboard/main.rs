//! Scoreboard of the diagnosis: hides effects in random machines and asks `gib diagnose` for them.
//!
//! The generator shares no code with the product: own integrator, own friction law, own servo, own moves; the product is
//! run as a command on files. Build both, then run: `cargo build --release && cargo run --release --example scoreboard --
//! --cases 64 --seed 1`.

mod board;

use board::case::{Case, Kind};
use board::score::{self, Score};
use board::{effects, outside, table};
use clap::Parser;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Hides random effects in random machines and scores what `gib diagnose` says about them.
#[derive(Parser)]
struct Options {
    /// How many cases; every 32 hold each cause once, two at once three times, wrong beliefs, outside effects five times, nothing four times.
    #[arg(long, default_value_t = 32)]
    cases: usize,
    /// Seed; the clock where left out. It is printed, and repeats the run.
    #[arg(long)]
    seed: Option<u64>,
    /// Hide only this: a cause, an outside effect, `none`, `two`, `beliefs`, `loose_spring` (an elastic drive with play) or `before_table`
    /// (a spring or a clearance beside a friction or a load).
    #[arg(long)]
    cause: Option<String>,
    /// Only the case of this number.
    #[arg(long)]
    only: Option<usize>,
    /// Keep the files of each case in this folder.
    #[arg(long)]
    keep: Option<PathBuf>,
    /// The `gib` command; the one built beside this example where left out.
    #[arg(long)]
    gib: Option<PathBuf>,
    /// Cases at a time.
    #[arg(long, default_value_t = 2)]
    jobs: usize,
    /// Longest recording, s (the shortest is 10 s).
    #[arg(long, default_value_t = 60.0)]
    longest: f64,
    /// Rigs with encoder noise, friction in other formulations and pulses on the torque: no faults, but nothing the
    /// belief speaks of.
    #[arg(long)]
    rough: bool,
    /// Diagnose the extended machine again, on the same recording and on the hold-out.
    #[arg(long)]
    again: bool,
    /// Only make the files (with --keep), do not diagnose.
    #[arg(long)]
    generate: bool,
}

fn main() -> ExitCode {
    let options = Options::parse();
    let kind = match options.cause.as_deref().map(|name| Kind::named(name).ok_or(name)) {
        None => None,
        Some(Ok(kind)) => Some(kind),
        Some(Err(name)) => {
            eprintln!(
                "--cause {name}: not a cause. Known: none two beliefs before_table loose_spring {} {}",
                effects::CAUSES.join(" "),
                outside::NAMES.join(" ")
            );
            return ExitCode::from(2);
        }
    };
    let gib = options.gib.clone().or_else(beside_this_example);
    if !options.generate && !gib.as_ref().is_some_and(|g| g.exists()) {
        eprintln!("The gib command is not built: run `cargo build --release` first, or say where it is with --gib.");
        return ExitCode::from(2);
    }
    let seed = options.seed.unwrap_or_else(|| {
        std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(1, |d| d.as_secs() % 1_000_000)
    });
    println!("scoreboard: {} cases, --seed {seed}", options.cases);
    let Ok(scratch) = tempfile::tempdir() else {
        eprintln!("no temporary folder can be made");
        return ExitCode::from(2);
    };
    let indices: Vec<usize> = options.only.map_or_else(|| (0..options.cases).collect(), |i| vec![i]);
    let next = AtomicUsize::new(0);
    let scores: Mutex<Vec<(usize, Score)>> = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..options.jobs.max(1) {
            scope.spawn(|| {
                while let Some(&index) = indices.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let kind = kind.unwrap_or_else(|| Kind::of(seed, index));
                    let case = Case::draw(seed, index, kind, options.longest, options.rough);
                    let folder = options.keep.as_deref().unwrap_or(scratch.path()).join(format!("case-{seed}-{index}"));
                    let gib = gib.as_deref().filter(|_| !options.generate);
                    let score = run(&case, &folder, gib, options.again);
                    println!("{}", line(index, &case, score.as_ref()));
                    if options.keep.is_none() {
                        let _ = std::fs::remove_dir_all(&folder);
                    }
                    if let (Some(score), Ok(mut list)) = (score, scores.lock()) {
                        list.push((index, score));
                    }
                }
            });
        }
    });
    let mut scores = scores.into_inner().unwrap_or_default();
    scores.sort_by_key(|s| s.0);
    let scores: Vec<Score> = scores.into_iter().map(|s| s.1).collect();
    if !options.generate {
        println!("\n{}", table::print(&scores));
        println!("seed {seed}");
    }
    ExitCode::SUCCESS
}

/// target/release/examples/scoreboard → target/release/gib
fn beside_this_example() -> Option<PathBuf> {
    Some(std::env::current_exe().ok()?.parent()?.parent()?.join("gib"))
}

fn run(case: &Case, folder: &Path, gib: Option<&Path>, again: bool) -> Option<Score> {
    match case.write(folder) {
        Ok(files) => gib.map(|gib| {
            let mut score = score::diagnose(gib, case, &files, folder);
            if again && score.is_right(case) && !score.named.is_empty() {
                score.again = score::again(gib, &files, folder);
            }
            score
        }),
        Err(e) => Some(Score {
            failure: Some(format!("{}: {e}", folder.display())),
            ..score::judge(case, &serde_json::Value::Null)
        }),
    }
}

/// One line a case: what was hidden, how large, and what was said.
fn line(index: usize, case: &Case, score: Option<&Score>) -> String {
    let hidden = match case.kind {
        Kind::Nothing => "nothing".to_string(),
        Kind::Outside(name) => name.to_string(),
        _ => case.effects.iter().map(|e| e.cause).collect::<Vec<_>>().join(" + "),
    };
    let sizes: Vec<String> = case.sizes.iter().map(|s| format!("{s:.1}")).collect();
    let rig = &case.rig;
    let about = format!(
        "{index:>4} {hidden} [{}× floor; {:?} {:.0} Hz{} {:.0} s {:?}{}]",
        sizes.join(", "),
        rig.drive,
        1.0 / rig.servo.period,
        if rig.every > 1 { format!("/{}", rig.every) } else { String::new() },
        rig.duration,
        rig.style,
        if rig.table.is_some() { ", table" } else { "" }
    );
    match score {
        None => format!("{about} difference {:.1}, draws {}", case.difference, case.draws),
        Some(s) => {
            let good = s.is_right(case);
            let again: Vec<String> = (s.again.iter().filter(|(verdict, _)| verdict != "no_discrepancy"))
                .map(|(verdict, named)| format!(" AGAIN {verdict} {}", named.join(", ")))
                .collect();
            let ratio = s.against_truth.map_or(String::new(), |r| format!(", {r:.2} of true"));
            let why = s.failure.as_ref().map_or(String::new(), |f| format!(" FAILED {f}"));
            let errors: Vec<String> = s
                .parameters
                .iter()
                .map(|p| p.error.map_or("–".into(), |e| format!("{:.2}% ({:.1}σ)", 100.0 * e, p.deviations)))
                .collect();
            format!(
                "{} {about} → {} {} {}{ratio} {:.2} s{why}{}",
                if good { "ok  " } else { "MISS" },
                s.verdict,
                s.named.join(", "),
                errors.join(" "),
                s.seconds,
                again.concat()
            )
        }
    }
}
