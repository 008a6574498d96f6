//! A speed that changes: the harmonics stand for one, and a scalar says how far they have grown since. Only a speed far from
//! that one makes them stand for another.

use super::*;

impl Vibration {
    /// The harmonics follow the speed.
    pub(super) fn follow(&mut self) {
        self.growth = self.spindle.growth();
        if self.spindle.far() {
            self.settle();
        }
    }

    /// The harmonics say the same as before, and stand for the present speed from now on.
    #[inline(never)]
    pub(super) fn settle(&mut self) {
        let (growth, pairs) = (self.growth, self.plan.pairs);
        grow(&mut self.trackers.harmonics, pairs, growth * growth);
        grow(&mut self.displacement, pairs, growth);
        self.known.iter_mut().flatten().for_each(|known| known.grow(growth));
        self.renewal.grow(growth);
        self.growth = 1.0;
        self.spindle.settle(&self.plan);
    }
}
