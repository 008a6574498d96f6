//! Several columns low-passed side by side, as tables are simulated.

use super::Frame;
use crate::diagnosis::many::widest;
use std::ops::Range;

impl Frame<'_> {
    /// [`Frame::low_passed`] of several columns side by side, known in these stretches; 0 of rows about which they are not.
    #[must_use]
    pub fn low_passed_together<const N: usize>(
        &self,
        stretches: &[Range<usize>],
        values: &[[f64; N]],
    ) -> [Vec<f64>; N] {
        let kernel = &self.low_pass_kernel;
        let mut columns: [Vec<f64>; N] = std::array::from_fn(|_| vec![0.0; self.kept.len()]);
        widest(
            #[inline(always)]
            || {
                for known in stretches {
                    for at in self.kept_within(known) {
                        let from = self.kept[at] - kernel.len() / 2;
                        let mut sums = [0.0; N];
                        for (value, weight) in values[from..from + kernel.len()].iter().zip(kernel) {
                            for (sum, value) in sums.iter_mut().zip(value) {
                                *sum += weight * value;
                            }
                        }
                        columns.iter_mut().zip(sums).for_each(|(column, sum)| column[at] = sum);
                    }
                }
            },
        );
        columns
    }

    /// Which of the judged rows the low-pass makes of these rows alone.
    #[must_use]
    pub fn kept_within(&self, rows: &Range<usize>) -> Range<usize> {
        // What acts between two rows is shared by both.
        let reach = self.low_pass_kernel.len() / 2 + 1;
        let first = self.kept.partition_point(|row| *row < rows.start + reach);
        first..self.kept.partition_point(|row| row + reach < rows.end).max(first)
    }
}
