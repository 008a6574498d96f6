//! What is known of one harmonic's displacement beside its value: how strong it is, how much of it noise explains, and how
//! fast it may be followed.
//!
//! ```text
//! share s of the news in a revolution:   drift leaves (D/2s)²·P, noise leaves N·s;   least of both near s = D·√(P/N)
//! displacement believed:                 X·(P − m·N·s)/P
//! ```
//!
//! P: mean square of the displacement, N: what noise leaves in an average over one revolution, D: what part of itself the
//! amplitude drifts by in a revolution, from the change of speed. A strong harmonic follows fast, a weak one is averaged
//! long. µm, µm².

/// A harmonic counts in full when its power is far above what noise leaves in it. The power is averaged twice as long
/// as the harmonic itself, so that noise alone seldom exceeds its own mean by this.
const NOISE_MARGIN: f32 = 1.5;
/// Power above which a harmonic that has just come is believed at once, in powers of its noise.
const SUDDEN: f32 = 10.0;

/// One harmonic of one sensor.
#[derive(Debug, Clone, Copy, Default)]
pub struct Known {
    /// Mean square, with its noise.
    power: f32,
    /// The displacement averaged once more.
    slow: [f32; 2],
}

impl Known {
    /// Takes up a displacement that averaged `news` of itself since the last time, and puts it ahead of its lag: what lags
    /// behind a ramp by one average lags by two after another (Brown's double smoothing). `ahead`: 0 to 1.
    #[inline(always)]
    pub fn look(&mut self, [x, y]: [f32; 2], news: f32, ahead: f32) -> [f32; 2] {
        let news = if news < 1.0 { news } else { 1.0 };
        let [u, v] = &mut self.slow;
        *u += news * (x - *u);
        *v += news * (y - *v);
        let ahead = if ahead > 0.0 { ahead } else { 0.0 };
        let now = [x + ahead * (x - *u), y + ahead * (y - *v)];
        self.power += 0.5 * news * (now[0] * now[0] + now[1] * now[1] - self.power);
        now
    }

    /// The displacement, less what a noise of some mean square explains.
    #[inline(always)]
    pub fn believed(&mut self, [x, y]: [f32; 2], noise: f32) -> [f32; 2] {
        let square = x * x + y * y;
        if square > self.power + SUDDEN * noise {
            self.power = square;
        }
        let left = self.power - NOISE_MARGIN * noise;
        let part = if left > 0.0 { left / self.power } else { 0.0 };
        [part * x, part * y]
    }

    /// Share of a revolution's news to let in from now on, `least` to 1.
    #[inline(always)]
    pub fn share(&self, drift: f32, noise: f32, least: f32) -> f32 {
        // N below any sensor's keeps the quotient finite.
        let best = drift * (self.power / (noise + 1e-12)).sqrt();
        let best = if best > least { best } else { least };
        if best < 1.0 { best } else { 1.0 }
    }
}
