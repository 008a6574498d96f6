//! Reasons not to believe a torque, whatever the fit says: a sensor that is stuck, dead or turned round for a part of the
//! run can look like another inertia with another friction, with a small uncertainty.

use super::blocks::{BLOCKS, Block};
use super::fit::{Balance, HOLD, quantile};
use super::robust::{Regression, Rows};
use crate::error::{Fault, GIB_ERR_INERTIA_TORQUE};

/// Why torque and motion do not belong together; `None` where they do.
pub fn doubt(blocks: &[Block], rows: &Rows, found: &Regression, balance: &Balance) -> Option<Fault> {
    stuck(blocks)
        .or_else(|| if balance.both_ways { dead(rows, found) } else { None })
        .or_else(|| torn(found))
        .or_else(|| halves(rows, found))
        .or_else(|| denied(rows, found))
        // Of one pace the gentle part would be holds and corners.
        .or_else(|| if balance.one_acceleration { None } else { paces(rows, found) })
}

fn fault(field: &'static str, value: f64, high: f64) -> Fault {
    Fault { code: GIB_ERR_INERTIA_TORQUE, field, value, low: 0.0, high }
}

/// The torque is, to the last bit, the same in blocks that follow one another, while the acceleration goes from a hold to a
/// ramp or from one ramp to another: no torque sensor does that, and a coarse one that does can tell no inertia.
pub fn stuck(blocks: &[Block]) -> Option<Fault> {
    const TELLING: f64 = 0.6; // of the largest acceleration seen
    const RUN: usize = 3;
    let clear = TELLING * quantile(blocks, 0.98, |b| b.acceleration.abs());
    let telling = |run: &&[Block]| {
        let (least, most) =
            run.iter().fold((f64::MAX, f64::MIN), |(low, high), b| (low.min(b.acceleration), high.max(b.acceleration)));
        run.len() >= RUN && clear > 0.0 && most - least > clear
    };
    let run = blocks.chunk_by(|a, b| a.torque == b.torque).find(telling)?;
    Some(fault("torque_stuck_blocks\0", run.len() as f64, (RUN - 1) as f64))
}

/// The torque is nothing but noise: neither inertia nor friction stands out of it.
fn dead(rows: &Rows, found: &Regression) -> Option<Fault> {
    const CLEAR: f64 = 4.0; // standard deviations
    let counted = || rows.blocks.iter().filter(|b| rows.counts(b));
    let sum: f64 = counted().map(|b| b.torque * b.speed.signum()).sum();
    let noise = found.scatter * (counted().count() as f64).sqrt();
    let inertia = found.terms[0].abs() / found.variance[0].max(f64::MIN_POSITIVE).sqrt();
    let most = inertia.max(sum.abs() / noise.max(f64::MIN_POSITIVE));
    (most < CLEAR).then(|| Fault { low: CLEAR, ..fault("torque_over_noise\0", most, f64::MAX) })
}

/// More of the motion contradicts the balance than outliers do, which are rare and come one by one: of 960 sound measurements
/// none had five blocks of them in a row.
fn torn(found: &Regression) -> Option<Fault> {
    const MOST: f64 = 0.15;
    const IN_A_ROW: (usize, f64) = (8, 0.05);
    let all = (found.used + found.dropped).max(1) as f64;
    let (share, row) = (found.dropped as f64 / all, found.in_a_row as f64 / all);
    if share > MOST {
        return Some(fault("blocks_dropped_ratio\0", share, MOST));
    }
    (found.in_a_row >= IN_A_ROW.0 && row > IN_A_ROW.1)
        .then(|| fault("blocks_dropped_in_a_row_ratio\0", row, IN_A_ROW.1))
}

/// Beyond what is called a weakened field or a saturation the motor gives less than is reported, never more. Where the blocks left out
/// for that show less torque than the balance of the others asks for, that balance is wrong: what was left out was the motor as it is,
/// and what was kept is something else, as a load that came on.
fn denied(rows: &Rows, found: &Regression) -> Option<Fault> {
    const CLEAR: f64 = 4.0; // standard deviations
    const MOST: f64 = 0.15; // of what was left out, as of outliers
    let left_out = || rows.blocks.iter().filter(|b| !rows.counts(b));
    let short = |block: &&Block| {
        let motion = rows.row(block);
        let expected = found.terms.dot(&motion);
        let variance = found.scatter.powi(2) + found.variance.dot(&motion.component_mul(&motion));
        (block.torque - expected) * expected.signum() < -CLEAR * variance.sqrt()
    };
    let share = left_out().filter(short).count() as f64 / left_out().count().max(1) as f64;
    (share > MOST).then(|| fault("blocks_left_out_short_ratio\0", share, MOST))
}

/// The first and the second half of the motion each say clearly what the other denies.
fn halves(rows: &Rows, found: &Regression) -> Option<Fault> {
    apart("halves_apart_ratio\0", rows.blocks.split_at(rows.blocks.len() / 2), rows, found)
}

/// Brisk ramps and gentle ones, each with the holds, say clearly what the other denies: the motor saturates at both.
fn paces(rows: &Rows, found: &Regression) -> Option<Fault> {
    const BRISK: f64 = 0.8; // of the largest acceleration seen
    let most = quantile(rows.blocks, 0.98, |b| b.acceleration.abs());
    let (mut brisk, mut gentle) = ([Block::default(); BLOCKS], [Block::default(); BLOCKS]);
    let of = |place: &mut [Block; BLOCKS], wanted: fn(f64) -> bool| {
        let chosen = rows.blocks.iter().filter(|b| wanted(b.acceleration.abs() / most));
        place.iter_mut().zip(chosen).map(|(place, block)| *place = *block).count()
    };
    let n = of(&mut brisk, |share| !(HOLD..BRISK).contains(&share));
    let m = of(&mut gentle, |share| share < BRISK);
    apart("paces_apart_ratio\0", (brisk.get(..n)?, gentle.get(..m)?), rows, found)
}

/// Two parts of the motion that say clearly what the other denies.
fn apart(field: &'static str, parts: (&[Block], &[Block]), rows: &Rows, found: &Regression) -> Option<Fault> {
    const CLEAR: f64 = 4.0; // standard deviations
    const MOST: f64 = 0.1; // of the inertia: below, it is the ripple
    let part = |blocks| Rows { blocks, ..*rows }.fit();
    let (first, second) = (part(parts.0)?, part(parts.1)?);
    let apart = (first.terms[0] - second.terms[0]).abs();
    let chance = (first.variance[0] + second.variance[0]).max(0.0).sqrt();
    let share = apart / found.terms[0].abs().max(f64::MIN_POSITIVE);
    (share > MOST && apart > CLEAR * chance).then(|| fault(field, share, MOST))
}

#[cfg(test)]
mod tests {
    use super::super::fit::{Question, fit};
    use super::super::robust::{Limit, Terms};
    use super::*;
    use crate::error::GIB_ERR_INERTIA_TORQUE;

    /// Four ramps up and down with J 0.3, Tc 4 and some scatter; `torque` is what the sensor makes of it.
    fn told(torque: impl Fn(usize, f64) -> f64) -> Result<f64, (i32, &'static str)> {
        let block = |i: usize| {
            let (acceleration, speed) = match i % 40 {
                k @ 0..15 => (60.0, 30.0 + 4.0 * k as f64),
                k @ 20..35 => (-60.0, 90.0 - 4.0 * (k - 20) as f64),
                k => (0.0, if k < 20 { 90.0 } else { 30.0 }),
            };
            let truth = 0.3 * acceleration + 4.0 + 0.05 * (i as f64 * 2.7).sin();
            Block { torque: torque(i, truth), speed, acceleration }
        };
        let blocks: Vec<Block> = (0..160).map(block).collect();
        let (balance, verdict) = fit(&blocks, 20, &Question::PLAIN);
        verdict.map(|()| balance.inertia.value).map_err(|fault| (fault.code, fault.field))
    }

    #[test]
    fn a_torque_that_is_stuck_dead_or_turned_round_is_named() {
        assert!((told(|_, truth| truth).unwrap() - 0.3).abs() < 1e-3);
        let code = |torque: fn(usize, f64) -> f64| told(torque).unwrap_err().0;
        assert_eq!(code(|_, _| 7.0), GIB_ERR_INERTIA_TORQUE, "stuck from the start");
        assert_eq!(code(|i, truth| if i < 110 { truth } else { 7.0 }), GIB_ERR_INERTIA_TORQUE, "stuck on the way");
        assert_eq!(code(|i, _| 0.05 * (i as f64 * 2.7).sin()), GIB_ERR_INERTIA_TORQUE, "dead");
        assert_eq!(code(|i, truth| if i < 60 { truth } else { -truth }), GIB_ERR_INERTIA_TORQUE, "turned round");
        assert_eq!(code(|i, truth| if i < 80 { truth } else { 2.0 * truth }), GIB_ERR_INERTIA_TORQUE, "changed");
    }

    /// A motor that delivers less than it says beyond 15 N·m, at brisk ramps and at gentle ones: each alone is another inertia.
    #[test]
    fn paces_that_deny_each_other_are_named() {
        let saturates = |block: usize, gentle: f64| {
            let pace = if (block / 40).is_multiple_of(2) { 1.0 } else { gentle };
            let acceleration = pace * [60.0, 0.0, -60.0, 0.0][block / 10 % 4];
            let delivered = 0.8 * acceleration + 2.0 + 0.3 * (block as f64 * 2.7).sin();
            let torque = delivered + 0.6 * (delivered.abs() - 15.0).max(0.0).copysign(delivered);
            Block { torque, speed: 60.0 + (block % 10) as f64, acceleration }
        };
        let doubted = |gentle: f64| {
            let blocks: Vec<Block> = (0..160).map(|i| saturates(i, gentle)).collect();
            let trusted = Limit::none(Terms::zeros());
            let rows = Rows { blocks: &blocks, both_senses: false, noise: 0.0, trusted, suspected: None };
            paces(&rows, &rows.fit().unwrap()).map(|fault| (fault.code, fault.field))
        };
        assert_eq!(doubted(0.4), Some((GIB_ERR_INERTIA_TORQUE, "paces_apart_ratio\0")));
        assert_eq!(doubted(1.0), None, "one acceleration tells nothing");
    }

    /// Of one pace the gentle part is holds and corners: however the drive swings there, it is not doubted.
    #[test]
    fn one_pace_is_not_held_against_its_corners() {
        let block = |i: usize| {
            let corner = i % 10 == 9;
            let acceleration = [60.0, 0.0, -60.0, 0.0][i / 10 % 4] * if corner { 0.5 } else { 1.0 };
            let swing = if corner { 0.1 * acceleration } else { 0.0 };
            let torque = 0.3 * acceleration + 4.0 + swing + 0.5 * ((i * i) as f64 * 2.7).sin();
            Block { torque, speed: 60.0 + (i % 10) as f64, acceleration }
        };
        let blocks: Vec<Block> = (0..160).map(block).collect();
        let trusted = Limit::none(Terms::zeros());
        let rows = Rows { blocks: &blocks, both_senses: false, noise: 0.0, trusted, suspected: None };
        let doubted = |one_acceleration: bool| {
            let balance = Balance { one_acceleration, ..Balance::default() };
            doubt(&blocks, &rows, &rows.fit().unwrap(), &balance).map(|fault| fault.field)
        };
        assert_eq!((doubted(true), doubted(false)), (None, Some("paces_apart_ratio\0")));
    }

    /// Beyond a limit a motor may be reported to give more than it does. Where a part of what is left out shows less, as where what was
    /// kept is a load that came on, the balance is refused; that part may be as large as that of outliers, and no larger.
    #[test]
    fn what_is_left_out_shows_no_less_torque() {
        const BEYOND: f64 = 15.0;
        let denied_of = |short: usize, excess: f64| {
            let block = |i: usize| {
                let acceleration = [60.0, 24.0, -60.0, -24.0][i / 10 % 4];
                let delivered = 0.3 * acceleration + 0.5 + 0.05 * (i as f64 * 2.7).sin();
                let beyond = (delivered.abs() - BEYOND).max(0.0).copysign(delivered);
                let share = if i % 20 < short { -0.5 } else { excess };
                Block { torque: delivered + share * beyond, speed: 60.0 + (i % 10) as f64, acceleration }
            };
            let blocks: Vec<Block> = (0..160).map(block).collect();
            let trusted = Limit { torque: BEYOND, ..Limit::none(Terms::new(0.3, 0.0, 0.5, 0.0, 0.0)) };
            let rows = Rows { blocks: &blocks, both_senses: false, noise: 0.0, trusted, suspected: None };
            denied(&rows, &rows.fit().unwrap()).map(|fault| (fault.code, fault.field, fault.value > fault.high))
        };
        let named = Some((GIB_ERR_INERTIA_TORQUE, "blocks_left_out_short_ratio\0", true));
        assert_eq!([denied_of(0, 0.0), denied_of(0, 0.6), denied_of(0, 3.0), denied_of(1, 0.6)], [None; 4]);
        assert_eq!([denied_of(3, 0.6), denied_of(10, 0.0)], [named; 2]);
    }

    #[test]
    fn outliers_in_a_row_are_named() {
        let row = |n: usize| told(|i, truth| if (85..85 + n).contains(&i) { 1.5 * truth } else { truth });
        assert_eq!(row(12), Err((GIB_ERR_INERTIA_TORQUE, "blocks_dropped_in_a_row_ratio\0")));
        assert!((row(4).unwrap() - 0.3).abs() < 2e-3);
    }

    /// Wild blocks that come one by one are no reason for doubt.
    #[test]
    fn outliers_are_not_doubted() {
        let value = told(|i, truth| if i % 11 == 4 { -3.0 * truth - 20.0 } else { truth }).unwrap();
        assert!((value - 0.3).abs() < 2e-3, "{value}");
    }
}
