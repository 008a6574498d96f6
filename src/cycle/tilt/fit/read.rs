//! What can be read off a fit.

use super::{Block, Fit, floor};

impl Fit {
    /// More than half of the blocks lie on the plane to the last digit.
    #[must_use]
    pub fn exact(&self) -> bool {
        self.scale <= 2.0 * floor(0.0, self.beta[0])
    }

    /// What a block's load departs from the plane, worn as the tool was.
    #[must_use]
    pub fn residual(&self, block: &Block) -> f64 {
        let row = self.basis(block);
        let value: f64 = self.beta.iter().zip(row).map(|(b, part)| b * part).sum();
        (block.value - value) * block.gain
    }

    /// Bounds of the path, from its start: x then y, low then high, mm.
    #[must_use]
    pub fn extent(&self) -> [[f64; 2]; 2] {
        self.bounds
    }

    /// Value of the plane at x y (mm from the start of the path) for the tool as it was at the start.
    #[must_use]
    pub fn at(&self, x: f64, y: f64) -> f64 {
        let row = self.basis(&Block { x, y, ..Block::default() });
        self.beta[0] + self.beta[1] * row[1] + self.beta[2] * row[2]
    }
}
