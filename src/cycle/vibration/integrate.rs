//! Displacement by integrating an acceleration twice, as published.
//!
//! ```text
//! v = ∫(a − a0) dt     x = ∫v dt − v0·t − x0     both from 0 at the start of each revolution
//! ```
//!
//! The motion repeats each revolution. So a0 for revolution N+1 is what makes the velocity of revolution N close, v0 what
//! makes its displacement close, and x0 its mean. Within a revolution nothing bounds what noise adds up to: the error
//! that the method `harmonic` is free of. m, s.

/// One acceleration integrated twice, by trapezia.
#[derive(Debug, Clone, Copy, Default)]
pub struct Integrator {
    reading: f64,
    speed: f64,
    way: f64,
    /// ∫ way dt over the revolution.
    area: f64,
    time: f64,
    /// Offsets from the last revolution: of acceleration, velocity, displacement.
    pub offset: f64,
    drift: f64,
    middle: f64,
}

impl Integrator {
    /// One reading in m/s², `cycle` s after the last; returns displacement in m and velocity in m/s.
    #[inline(always)]
    pub fn read(&mut self, reading: f64, cycle: f64) -> [f64; 2] {
        let (speed, way) = (self.speed, self.way);
        self.speed += (0.5 * (self.reading + reading) - self.offset) * cycle;
        self.way += 0.5 * (speed + self.speed) * cycle;
        self.area += 0.5 * (way + self.way) * cycle;
        self.time += cycle;
        self.reading = reading;
        [self.way - self.drift * self.time - self.middle, self.speed - self.drift]
    }

    /// A revolution ended `late` s before the last reading: its offsets serve the next, which started from 0 then.
    pub fn close(&mut self, late: f64) {
        let time = self.time - late;
        if time > 0.0 {
            let speed = self.speed - late * (self.reading - self.offset);
            let way = self.way - late * self.speed;
            // With the offset that closes the velocity, the way at the end would have been this.
            let (more, end) = (speed / time, way - 0.5 * speed * time);
            self.offset += more;
            self.drift = end / time;
            self.middle = (self.area - late * self.way) / time - more * time * time / 6.0 - 0.5 * end;
        }
        self.speed = late * (self.reading - self.offset);
        (self.way, self.area, self.time) = (0.0, 0.0, late);
    }

    /// The revolution is spoilt: begins one anew, with the offset that is known.
    pub fn restart(&mut self) {
        *self = Integrator { offset: self.offset, reading: self.reading, ..Integrator::default() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sinusoid with an offset: from the second revolution on its displacement is right, wherever between two readings
    /// the revolutions end.
    #[test]
    fn the_second_revolution_is_closed() {
        let (cycle, period) = (0.0005, 0.10023);
        let omega = core::f64::consts::TAU / period;
        let (mut integrator, mut end) = (Integrator::default(), period);
        for i in 1..2000 {
            let t = f64::from(i) * cycle;
            let acceleration = -1e-6 * omega * omega * (omega * t + 0.4).cos() + 0.3;
            if i == 1 {
                integrator.reading = acceleration;
            }
            let [x, _] = integrator.read(acceleration, cycle);
            if t > 2.0 * period {
                assert!((x - 1e-6 * (omega * t + 0.4).cos()).abs() < 3e-8, "{i}: {x}");
            }
            if t >= end {
                integrator.close(t - end);
                end += period;
            }
        }
    }
}
