//! The scoreboard: who was named for whom, and the figures that sum it up.

use super::score::{ParameterScore, Score};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Groups of cases.
fn is_clean(s: &Score) -> bool {
    s.truth.is_empty()
}

fn is_outside(s: &Score) -> bool {
    s.truth.first().is_some_and(|t| t.starts_with("outside"))
}

fn is_named(s: &Score) -> bool {
    !is_clean(s) && !is_outside(s)
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// The figures that the requirement sets limits for. Shares are (hits, of).
pub struct Summary {
    pub first_right: (usize, usize),
    pub tied: (usize, usize),
    pub wrong_beside: (usize, usize),
    pub false_alarms: (usize, usize),
    pub unknown: (usize, usize),
    pub both_of_two: (usize, usize),
    /// Of three and more.
    pub all_of_several: (usize, usize),
    pub parameter_error: Option<f64>,
    pub covered: (usize, usize),
    pub against_truth: Option<f64>,
    pub truth_over_floor: Option<f64>,
    /// Extended machines that are believed on further recordings.
    pub believed_again: (usize, usize),
    pub seconds: Option<f64>,
    pub failures: usize,
}

pub fn summarise(scores: &[Score]) -> Summary {
    let share = |of: &dyn Fn(&Score) -> bool, hit: &dyn Fn(&Score) -> bool| {
        let group: Vec<&Score> = scores.iter().filter(|s| of(s)).collect();
        (group.iter().filter(|s| hit(s)).count(), group.len())
    };
    let parameters: Vec<_> = scores.iter().flat_map(|s| &s.parameters).collect();
    let known =
        |pick: &dyn Fn(&Score) -> Option<f64>| median(scores.iter().filter(|s| is_named(s)).filter_map(pick).collect());
    Summary {
        first_right: share(&is_named, &|s| s.first_right),
        tied: share(&is_named, &|s| s.tied),
        wrong_beside: share(&is_named, &|s| s.first_right && s.wrong > 0),
        false_alarms: share(&is_clean, &|s| !s.named.is_empty() || s.verdict != "no_discrepancy"),
        unknown: share(&is_outside, &|s| s.verdict == "unknown_cause" && s.named.is_empty()),
        both_of_two: share(&|s| is_named(s) && s.truth.len() == 2, &|s| s.found == 2),
        all_of_several: share(&|s| is_named(s) && s.truth.len() > 2, &|s| s.found == s.truth.len()),
        parameter_error: median(parameters.iter().map(|p| p.error.unwrap_or(f64::INFINITY)).collect()),
        covered: (parameters.iter().filter(|p| p.covered).count(), parameters.len()),
        against_truth: known(&|s| s.against_truth),
        truth_over_floor: known(&|s| s.truth_over_floor),
        believed_again: {
            let all: Vec<_> = scores.iter().flat_map(|s| &s.again).collect();
            (all.iter().filter(|(verdict, _)| verdict == "no_discrepancy").count(), all.len())
        },
        seconds: median(scores.iter().map(|s| s.seconds).collect()),
        failures: scores.iter().filter(|s| s.failure.is_some()).count(),
    }
}

fn percent((hits, of): (usize, usize)) -> String {
    if of == 0 { "    –".into() } else { format!("{:5.1} %  ({hits} of {of})", 100.0 * hits as f64 / of as f64) }
}

fn figure(v: Option<f64>, scale: f64, unit: &str) -> String {
    v.map_or("    –".into(), |v| format!("{:7.3}{unit}", v * scale))
}

/// What was named first for each truth, with counts.
fn confusion(scores: &[Score]) -> String {
    let mut rows: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
    for s in scores {
        let truth = match s.truth.len() {
            0 => "(clean)".to_string(),
            1 => s.truth[0].clone(),
            2 => "(two)".to_string(),
            _ => "(several)".to_string(),
        };
        let said = match (&s.failure, s.named.first()) {
            (Some(_), _) => "FAILED".to_string(),
            (None, Some(_)) if s.truth.len() > 1 && s.first_right => format!("{} of {}", s.found, s.truth.len()),
            (None, Some(name)) => name.clone(),
            (None, None) => format!("[{}]", s.verdict),
        };
        *rows.entry(truth).or_default().entry(said).or_default() += 1;
    }
    let mut out = String::from("hidden                                cases  named first\n");
    for (truth, said) in rows {
        let n: usize = said.values().sum();
        let mut said: Vec<_> = said.into_iter().collect();
        said.sort_by_key(|(name, count)| (std::cmp::Reverse(*count), name.clone()));
        let list: Vec<String> = said.iter().map(|(name, count)| format!("{name} {count}")).collect();
        let _ = writeln!(out, "{truth:<37} {n:>5}  {}", list.join(", "));
    }
    out
}

/// Median error by cause and parameter, how many intervals hold the truth, and the median and largest error in standard
/// deviations: honest ones have a median of 0.67.
fn parameters(scores: &[Score]) -> String {
    let mut rows: BTreeMap<(String, String), Vec<&ParameterScore>> = BTreeMap::new();
    for p in scores.iter().flat_map(|s| &s.parameters) {
        rows.entry((p.cause.clone(), p.key.clone())).or_default().push(p);
    }
    let mut out = String::from(
        "parameter                                                    cases  median error  covered  median std  largest\n",
    );
    for ((cause, key), values) in rows {
        let error = median(values.iter().map(|p| p.error.unwrap_or(f64::INFINITY)).collect()).unwrap_or(f64::NAN);
        let covered = values.iter().filter(|p| p.covered).count();
        let off: Vec<f64> = values.iter().map(|p| p.deviations).collect();
        let _ = writeln!(
            out,
            "{:<60} {:>5}  {:>10.2} %  {covered:>7}  {:>10.2}  {:>7.1}",
            format!("{cause}.{key}"),
            values.len(),
            100.0 * error,
            median(off.clone()).unwrap_or(f64::NAN),
            off.into_iter().fold(0.0, f64::max)
        );
    }
    out
}

pub fn print(scores: &[Score]) -> String {
    let s = summarise(scores);
    let mut out = confusion(scores);
    out.push('\n');
    out.push_str(&parameters(scores));
    let lines = [
        ("first-named cause right", percent(s.first_right), "≥ 95 %"),
        ("  … wrong, but said to be tied with it", percent(s.tied), ""),
        ("right, with wrong names beside it", percent(s.wrong_beside), "≤ 5 %"),
        ("false alarms on clean data", percent(s.false_alarms), "≤ 2 %"),
        ("outside effects called unknown", percent(s.unknown), "≥ 90 %"),
        ("both of two right", percent(s.both_of_two), "≥ 85 %"),
        ("all of three and more right", percent(s.all_of_several), ""),
        ("median parameter error", figure(s.parameter_error, 100.0, " %"), "≤ 3 %"),
        ("95 % intervals that hold the truth", percent(s.covered), "90–98 %"),
        ("hold-out residual over the true model's", figure(s.against_truth, 1.0, ""), "≤ 1.10"),
        ("true model's residual over the floor", figure(s.truth_over_floor, 1.0, ""), ""),
        ("extended machine again: no discrepancy", percent(s.believed_again), ""),
        ("seconds a case", figure(s.seconds, 1.0, " s"), ""),
        ("cases without a diagnosis", format!("{:5}", s.failures), "0"),
    ];
    out.push('\n');
    for (what, value, wanted) in lines {
        let _ = writeln!(out, "{what:<42} {value:<24} {wanted}");
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn score(truth: &[&str], named: &[&str], verdict: &str) -> Score {
        let is_hidden = |n: &&&str| truth.contains(n);
        Score {
            truth: truth.iter().map(|s| s.to_string()).collect(),
            named: named.iter().map(|s| s.to_string()).collect(),
            verdict: verdict.into(),
            first_right: named.first().is_some_and(|n| truth.contains(n)),
            found: named.iter().filter(is_hidden).count(),
            wrong: named.iter().filter(|n| !truth.contains(n)).count(),
            ..Score::default()
        }
    }

    #[test]
    fn every_kind_of_case_is_counted_in_its_own_share() {
        let mut hit = score(&["cogging"], &["cogging", "backlash"], "explained");
        hit.parameters = [(0.01, true), (0.05, false), (0.02, true)]
            .map(|(e, covered)| ParameterScore {
                cause: "cogging".into(),
                key: "k".into(),
                error: Some(e),
                deviations: if covered { 1.0 } else { 3.0 },
                covered,
            })
            .to_vec();
        hit.against_truth = Some(1.05);
        let scores = [
            hit,
            score(&["cogging"], &["backlash"], "explained"),
            score(&["cogging", "backlash"], &["backlash", "cogging"], "explained"),
            score(&["cogging", "backlash"], &["backlash"], "explained"),
            score(&[], &[], "no_discrepancy"),
            score(&[], &["cogging"], "explained"),
            score(&[], &[], "unknown_cause"),
            score(&["outside: detent"], &[], "unknown_cause"),
            score(&["outside: detent"], &["cogging"], "partly_explained"),
            score(&["cogging", "backlash", "dead_time"], &["backlash", "cogging", "dead_time"], "explained"),
        ];
        let s = summarise(&scores);
        assert_eq!(s.all_of_several, (1, 1));
        assert_eq!(s.first_right, (4, 5));
        assert_eq!(s.wrong_beside, (1, 5));
        assert_eq!(s.false_alarms, (2, 3));
        assert_eq!(s.unknown, (1, 2));
        assert_eq!(s.both_of_two, (1, 2));
        assert_eq!(s.parameter_error, Some(0.02));
        assert_eq!(s.covered, (2, 3));
        assert_eq!(s.against_truth, Some(1.05));
        assert!(print(&scores).contains("cogging"));
    }
}
