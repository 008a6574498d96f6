use super::*;

/// A small generator of its own: sums of uniform numbers, near normal, σ = 1.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// Passes of 200 blocks over 100 mm, forth and back, with a step aside between; depth from a law.
fn passes(count: usize, aside: f64, depth: impl Fn(f64, f64, f64) -> f64) -> Vec<Block> {
    (0..200 * count)
        .map(|i| {
            let (pass, k) = (i / 200, i % 200);
            let x = 0.5 * if pass % 2 == 0 { k as f64 } else { 199.0 - k as f64 };
            let (y, cut) = (aside * pass as f64, 5e-4 * i as f64);
            Block { x, y, value: depth(x, y, cut), gain: 7.0, cut, ..Block::default() }
        })
        .collect()
}

fn fitted(blocks: &mut [Block]) -> Fit {
    let mut fit = Fit::REST;
    fit.begin(0.02);
    let mut slices = 0;
    while !fit.step(blocks) {
        slices += 1;
        assert!(slices < 100_000);
    }
    fit
}

/// Slopes along x and y.
fn slopes(fit: &Fit) -> [f64; 2] {
    let [c, s] = fit.along;
    [c * fit.beta[1] - s * fit.beta[2], s * fit.beta[1] + c * fit.beta[2]]
}

#[test]
fn an_exact_plane_with_wear_comes_out_exactly() {
    let mut blocks = passes(4, 20.0, |x, y, cut| (3.0 + 0.01 * x - 0.004 * y) * (1.0 + 0.05 * cut));
    // The steps aside go one way with time: only cuts back over the same y tell wear from a slope along y.
    let back: Vec<Block> = passes(4, 20.0, |_, _, _| 0.0)
        .into_iter()
        .map(|b| {
            let (y, cut) = (60.0 - b.y, b.cut + 0.4);
            Block { y, cut, value: (3.0 + 0.01 * b.x - 0.004 * y) * (1.0 + 0.05 * cut), ..b }
        })
        .collect();
    blocks.extend(back);
    let fit = fitted(&mut blocks);
    let [gx, gy] = slopes(&fit);
    assert!((gx - 0.01).abs() < 1e-9 && (gy + 0.004).abs() < 1e-9 && (fit.beta[3] - 0.05).abs() < 1e-7, "{fit:?}");
    assert!(fit.planar && fit.separable);
}

#[test]
fn a_line_in_any_direction() {
    for degrees in [0.0f64, 30.0, 90.0, 135.0, 179.0] {
        let (s, c) = degrees.to_radians().sin_cos();
        let mut blocks = passes(2, 0.0, |x, _, _| 2.0 - 0.02 * x);
        blocks.iter_mut().for_each(|b| (b.x, b.y) = (b.x * c, b.x * s));
        let fit = fitted(&mut blocks);
        assert!(!fit.planar && fit.separable);
        let along = fit.beta[1] * (fit.along[0] * c + fit.along[1] * s).signum();
        assert!((along + 0.02).abs() < 1e-9, "{degrees}: {fit:?}");
    }
}

#[test]
fn entry_exit_and_chips_do_not_move_it() {
    let mut noise = Noise(7);
    let mut blocks = passes(3, 10.0, |x, y, _| 3.0 + 0.01 * x + 0.002 * y);
    for (i, b) in blocks.iter_mut().enumerate() {
        let k = i % 200;
        b.value += 0.02 * noise.normal();
        // A tenth of each pass in entry, seven hundredths in exit, chips here and there.
        b.value -= if k < 20 { 0.12 * (20 - k) as f64 } else { 0.0 };
        b.value -= if k > 185 { 0.15 * (k - 185) as f64 } else { 0.0 };
        b.value += if noise.uniform() < 0.03 { 1.5 } else { 0.0 };
    }
    let fit = fitted(&mut blocks);
    let [gx, gy] = slopes(&fit);
    assert!((gx - 0.01).abs() < 2e-4 && (gy - 0.002).abs() < 4e-4, "{gx} {gy}");
    assert!(fit.rejected > 80 && fit.rejected < 140, "{}", fit.rejected);
}

/// One pass in one direction cannot tell wear from tilt: the uncertainty says so. Back again, and it can.
#[test]
fn wear_is_told_apart_only_where_the_passes_can() {
    let wear = |x: f64, _: f64, cut: f64| (3.0 + 0.005 * x) * (1.0 + 0.04 * cut);
    let fit = fitted(&mut passes(1, 0.0, wear));
    assert!(!fit.separable && fit.beta[3].abs() < 1e-6);
    // 4 % of 3 mm a metre look like a slope of 1.2e-4, and the product adds 2e-5; expected are 2 % (k = 1), 7e-5.
    let std = fit.covariance[1][1].sqrt();
    assert!((slopes(&fit)[0] - 0.005_14).abs() < 1e-6, "{:?}", slopes(&fit));
    assert!(std > 6.9e-5 && std < 7.4e-5, "{std}");
    let fit = fitted(&mut passes(2, 0.0, wear));
    assert!(fit.separable && (slopes(&fit)[0] - 0.005).abs() < 1e-8 && (fit.beta[3] - 0.04).abs() < 1e-6);
}

/// The stated standard deviations are those of the scatter, with and without outliers, and of unknown wear.
#[test]
fn uncertainty_is_that_of_the_scatter() {
    let mut noise = Noise(20);
    for (chips, slow) in [(0.0, 0.0), (0.05, 0.0), (0.0, 0.6)] {
        let (mut squares, mut stated, mut covered) = (0.0, 0.0, 0);
        let runs = 200;
        for _ in 0..runs {
            let mut last = 0.0;
            let wear = 0.02 * noise.normal();
            let mut blocks = passes(1, 0.0, |x, _, cut| (3.0 + 0.01 * x) * (1.0 + wear * cut));
            for b in &mut blocks {
                last = slow * last + 1e-3 * noise.normal();
                b.value += last + if noise.uniform() < chips { 1.0 } else { 0.0 };
            }
            let fit = fitted(&mut blocks);
            let (error, std) = (slopes(&fit)[0] - 0.01, fit.covariance[1][1].sqrt());
            squares += error * error / f64::from(runs);
            stated += std * std / f64::from(runs);
            covered += u32::from(error.abs() <= 2.0 * std);
        }
        let ratio = (stated / squares).sqrt();
        println!("chips {chips}, correlation {slow}: stated/found {ratio:.2}, covered {covered} of {runs}");
        assert!(ratio > 0.75 && ratio < 1.35, "{ratio}");
        assert!(covered >= 180 && covered <= 199, "{covered}");
    }
}

/// A load that jumps leaves its blocks in one row until it is back; entry, exit and chips do not.
#[test]
fn blocks_without_weight_are_counted_by_rows() {
    for (jumps, from, to) in [(false, 1, 50), (true, 120, 160)] {
        let mut noise = Noise(11);
        let mut blocks = passes(3, 0.0, |x, _, _| 3.0 + 0.01 * x);
        for (i, b) in blocks.iter_mut().enumerate() {
            b.value += 0.01 * noise.normal() - 0.12 * 20usize.saturating_sub(i % 200) as f64;
            b.value += if noise.uniform() < 0.03 { 1.5 } else { 0.0 };
            b.value += if jumps && (230..370).contains(&i) { 0.8 } else { 0.0 };
        }
        let fit = fitted(&mut blocks);
        assert!(
            (from..=to).contains(&fit.in_a_row) && fit.rejected > fit.in_a_row,
            "{} in a row of {}",
            fit.in_a_row,
            fit.rejected
        );
    }
}

/// Few blocks of a short path alone say little of the wear, and any at all: what is expected of it keeps it, and the slope, down.
#[test]
fn wear_is_not_believed_beyond_what_may_be() {
    let spread = |wear_prior: f64| {
        let mut noise = Noise(3);
        let squares = (0..50).map(|_| {
            let mut blocks = passes(2, 0.0, |x, _, _| 3.0 + 0.001 * x);
            blocks.retain(|b| ((b.cut * 2000.0).round() as usize).is_multiple_of(16));
            blocks.iter_mut().for_each(|b| b.value += 0.03 * noise.normal());
            let mut fit = Fit::REST;
            fit.begin(wear_prior);
            while !fit.step(&mut blocks) {}
            assert!(fit.separable && blocks.len() == 25);
            [fit.beta[3].powi(2), (slopes(&fit)[0] - 0.001).powi(2)]
        });
        squares.fold([0.0; 2], |sum, square| [sum[0] + square[0], sum[1] + square[1]]).map(|sum| (sum / 50.0).sqrt())
    };
    let ([free, slope], [held, better]) = (spread(10.0), spread(1e-3));
    assert!(free > 0.03 && held < 0.01 && better < 1.01 * slope, "{free} {held} {slope} {better}");
}
