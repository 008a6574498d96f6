//! What laws do at their starts, laid out once for all sets that they may join.

use super::starts::seldom_starts;
use super::*;

/// Most bytes that the seldom starts of a law are kept in; of a longer recording they are made anew for each set.
const ROOM: usize = 64 << 20;
/// Starts of a law that are laid out in one go; tables are stepped half as many side by side.
const AT_A_TIME: usize = 16;

/// Terms at the starts of the laws whose starts do not depend on the rest: they are made once.
pub type Shelf = HashMap<Cause, Vec<Part>>;

impl Search<'_, '_, '_> {
    /// Lays out what tables would do, unless that is done.
    pub(super) fn lay_out_tables(&self) -> Result<(), Stopped> {
        let lay_out = || {
            let empty = self.bench.fit(Vec::new());
            let tables = self.laws.iter().filter(|law| law.is_simulated());
            let starts = tables.map(|law| (*law, self.bench.starts(law, &empty)));
            shelf(self.bench, &self.approach, starts, self.watch)
        };
        self.tables.get_or_try_init(lay_out).map(|_| ())
    }

    /// The same of seldom starts, of those that there is room for.
    pub(super) fn lay_out_seldom(&self) -> Result<(), Stopped> {
        let lay_out = || {
            let empty = self.bench.fit(Vec::new());
            let row = self.bench.measured.len() * size_of::<f64>();
            let starts = self.laws.iter().map(|law| (*law, seldom_starts(self.bench, &empty, law)));
            let starts = starts.filter(|(_, shapes)| shapes.len() * row < ROOM);
            shelf(self.bench, &self.approach, starts, self.watch)
        };
        self.seldom.get_or_try_init(lay_out).map(|_| ())
    }

    /// Terms at the starts of a law.
    pub(super) fn shelved(&self, law: &Law) -> &[Part] {
        self.shelf.get(&law.cause).or_else(|| self.tables.get()?.get(&law.cause)).map_or(&[], Vec::as_slice)
    }
}

/// Lays out laws at these starts.
pub(super) fn shelf(
    bench: &Bench,
    approach: &Approach,
    starts: impl Iterator<Item = (&'static Law, Vec<Vec<f64>>)>,
    watch: &Watch,
) -> Result<Shelf, Stopped> {
    // Few starts at a time, so that all cores have work on the laws that take long.
    let starts: Vec<(&'static Law, Vec<Vec<f64>>)> = starts
        .filter(|(law, _)| !law.manner.starts_from_rest)
        .flat_map(|(law, starts)| starts.chunks(AT_A_TIME).map(|c| (law, c.to_vec())).collect::<Vec<_>>())
        .collect();
    let laid = watch.each(&starts, (0.05, 0.15), "laying out what each cause would do", |(law, shapes)| {
        (
            law.cause,
            if law.manner.approached { approach.starts(law, shapes.clone()) } else { bench.parts(law, shapes.clone()) },
        )
    })?;
    let mut shelf = Shelf::new();
    for (cause, parts) in laid {
        shelf.entry(cause).or_default().extend(parts);
    }
    Ok(shelf)
}
