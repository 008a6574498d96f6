//! The noise in what a fit leaves.

use super::{Bench, Fit};

impl Bench<'_, '_> {
    /// Noise floor of what a fit leaves of each channel, in their own units; 0 of one that there is not. Worked out once, since a fit is
    /// asked by many.
    #[must_use]
    pub fn noise_left(&self, fit: &Fit) -> [f64; 2] {
        // Outside of the cell, lest a thread that waits within it take up work that waits for the cell.
        if let Some(noise) = fit.noise.get() {
            return *noise;
        }
        let rest = self.rest(fit);
        let floor = |left: &[f64], averaged| if left.is_empty() { 0.0 } else { self.frame.floor(left, averaged) };
        let (torque, table) = rayon::join(|| floor(&rest[0], true), || floor(&rest[1], false));
        *fit.noise.get_or_init(|| [torque, table])
    }
}
