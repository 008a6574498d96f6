//! Long work on the cores at hand, which says how far it is and stops when told to.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Told how far the work is: the share that is done (0 to 1, never falling) and what is being done. Answers false to stop.
/// It is called from the threads that work, one call at a time, some ten times a second of work or more.
pub type Progress<'p> = &'p (dyn Fn(f64, &'static str) -> bool + Sync);

/// The work was stopped by its caller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stopped;

impl std::fmt::Display for Stopped {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("stopped before a result was reached")
    }
}

impl std::error::Error for Stopped {}

/// Reports to a [`Progress`] and remembers that it said stop.
pub struct Watch<'p> {
    progress: Progress<'p>,
    /// Share reported last; the lock also keeps calls one at a time.
    share: Mutex<f64>,
    stopped: AtomicBool,
}

impl<'p> Watch<'p> {
    /// A watch at the start of the work.
    #[must_use]
    pub fn new(progress: Progress<'p>) -> Self {
        Self { progress, share: Mutex::new(0.0), stopped: AtomicBool::new(false) }
    }

    /// Reports that a share of the work is done.
    ///
    /// # Errors
    /// [`Stopped`] when the caller said so, now or before.
    pub fn at(&self, share: f64, stage: &'static str) -> Result<(), Stopped> {
        if !self.stopped.load(Ordering::Relaxed) {
            let Ok(mut last) = self.share.lock() else { return Err(Stopped) };
            *last = last.max(share.min(1.0));
            if !(self.progress)(*last, stage) {
                self.stopped.store(true, Ordering::Relaxed);
            }
        }
        if self.stopped.load(Ordering::Relaxed) { Err(Stopped) } else { Ok(()) }
    }

    /// Does two things at a time.
    ///
    /// # Errors
    /// [`Stopped`] when the caller said so.
    pub fn both<A: Send, B: Send>(
        &self,
        one: impl FnOnce() -> Result<A, Stopped> + Send,
        other: impl FnOnce() -> Result<B, Stopped> + Send,
    ) -> Result<(A, B), Stopped> {
        let (one, other) = rayon::join(one, other);
        Ok((one?, other?))
    }

    /// Runs a function over items on the cores at hand, begun in their order, and answers in it; reports between `from` and `to` as
    /// items are done. What has nothing to do helps with what an item shares out in turn.
    ///
    /// # Errors
    /// [`Stopped`] when the caller said so; items that were begun are finished first.
    pub fn each<T: Sync, R: Send>(
        &self,
        items: &[T],
        (from, to): (f64, f64),
        stage: &'static str,
        work: impl Fn(&T) -> R + Sync,
    ) -> Result<Vec<R>, Stopped> {
        let (next, ready) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let done = Mutex::new(Vec::with_capacity(items.len()));
        let run = || {
            while let Some((i, item)) = {
                let i = next.fetch_add(1, Ordering::Relaxed);
                items.get(i).map(|item| (i, item))
            } {
                let answer = work(item);
                let share = (ready.fetch_add(1, Ordering::Relaxed) + 1) as f64 / items.len() as f64;
                if self.at(from + (to - from) * share, stage).is_err() {
                    break;
                }
                if let Ok(mut list) = done.lock() {
                    list.push((i, answer));
                }
            }
        };
        rayon::scope(|scope| {
            for _ in 1..rayon::current_num_threads().min(items.len()) {
                scope.spawn(|_| run());
            }
            run();
        });
        if self.stopped.load(Ordering::Relaxed) {
            return Err(Stopped);
        }
        let mut list = done.into_inner().map_err(|_| Stopped)?;
        list.sort_by_key(|entry| entry.0);
        Ok(list.into_iter().map(|entry| entry.1).collect())
    }
}

/// Most cores that one diagnosis takes.
const MOST_CORES: usize = 8;

/// Does work on threads of its own, one a core, which end with it; on those of the process where none can be had.
pub fn on_all_cores<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get().min(MOST_CORES));
    match rayon::ThreadPoolBuilder::new().num_threads(cores).build() {
        Ok(pool) => pool.install(work),
        Err(_) => work(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_come_in_order_and_the_share_never_falls() {
        let shares = Mutex::new(Vec::new());
        let progress = |share: f64, _: &'static str| {
            shares.lock().unwrap().push(share);
            true
        };
        let watch = Watch::new(&progress);
        let items: Vec<usize> = (0..100).collect();
        assert_eq!(watch.each(&items, (0.2, 0.6), "squares", |i| i * i).unwrap()[99], 9801);
        watch.at(0.1, "late").unwrap();
        let shares = shares.into_inner().unwrap();
        assert_eq!(shares.len(), 101);
        assert!(shares.windows(2).all(|w| w[0] <= w[1]) && shares[0] > 0.2 && shares[100] == 0.6, "{shares:?}");
    }

    #[test]
    fn two_things_at_a_time_answer_both_or_stop() {
        let watch = Watch::new(&|_, _| true);
        assert_eq!(watch.both(|| Ok(1), || Ok("two")), Ok((1, "two")));
        assert_eq!(watch.both(|| Err::<(), _>(Stopped), || Ok(())), Err(Stopped));
        assert_eq!(watch.both(|| Ok(()), || Err::<(), _>(Stopped)), Err(Stopped));
    }

    #[test]
    fn it_stops_soon_after_it_was_told_to() {
        let watch = Watch::new(&|share, _| share < 0.5);
        let calls = AtomicUsize::new(0);
        let items = [0; 1000];
        let answer = watch.each(&items, (0.0, 1.0), "counting", |_| calls.fetch_add(1, Ordering::Relaxed));
        assert_eq!(answer, Err(Stopped));
        assert!((500..520).contains(&calls.load(Ordering::Relaxed)));
        assert_eq!(watch.at(0.0, "again"), Err(Stopped));
    }
}
