//! Tables behind springs. While a table slides one way all is linear: what the steps between two rows make of position, speed,
//! the motor's way, load and friction is worked out once, and a row is a few products instead of many steps. Where a table may
//! turn or stick within the row, the steps are made. Friction that builds up over a way neither turns nor sticks within a row: it is
//! taken from half of the way that the table is about to go.

use super::*;

/// Most steps that are made in one go: two radians of the fastest swing, so that the speed half way tells whether it turns.
pub(super) const MOST_STEPS: f64 = 16.0;
/// Share of the bend of the speed over such a piece (half way against its ends) by which the speed may dip between these places:
/// of a swing over two radians it is an eighth.
const DIP: f64 = 0.25;

/// Where tables are, seen from where the motor was at the beginning of a piece of its way, and what their springs made.
struct Moved<const N: usize> {
    position: [f64; N],
    speed: [f64; N],
    /// Speed half way.
    half_way: [f64; N],
    /// Σ torque over the steps, and Σ torque·share of the time since the beginning of the piece.
    sum: [f64; N],
    far: [f64; N],
}

/// What one number of [`Moved`] is by one unit of all that makes it.
struct Made<const N: usize> {
    position: [f64; N],
    speed: [f64; N],
    rate: [f64; N],
    bend: [f64; N],
    twist: [f64; N],
    /// Torque against moving forward.
    resisting: [f64; N],
}

impl<const N: usize> Made<N> {
    #[inline(always)]
    fn of(&self, way: &Way, x: &[f64; N], v: &[f64; N], resisting: &[f64; N]) -> [f64; N] {
        lanes(|l| {
            let motor = self.rate[l] * way.rate + self.bend[l] * way.bend + self.twist[l] * way.twist;
            let table = self.position[l] * x[l] + self.speed[l] * v[l];
            motor + (table + self.resisting[l] * resisting[l])
        })
    }
}

/// What a piece of the way makes of tables that slide one way.
pub(super) struct Sliding<const N: usize> {
    /// Steps of a piece, and its share of the time.
    steps: usize,
    share: f64,
    position: Made<N>,
    speed: Made<N>,
    half_way: Made<N>,
    sum: Made<N>,
    far: Made<N>,
}

impl<const N: usize, R: Resisted<N>> Tables<'_, N, R> {
    /// Works out what the steps make of tables that slide.
    pub(super) fn sliding(&self) -> Sliding<N> {
        let steps = self.steps / self.pieces;
        const REST: Way = Way { at: 0.0, rate: 0.0, bend: 0.0, twist: 0.0 };
        let (none, one) = ([0.0; N], [1.0; N]);
        let by = |way, position, speed, load| self.stepped(&way, position, speed, steps, load, |_, _| 0.0);
        let (position, speed) = (by(REST, one, none, none), by(REST, none, one, none));
        let rate = by(Way { rate: 1.0, ..REST }, none, none, none);
        let bend = by(Way { bend: 1.0, ..REST }, none, none, none);
        let twist = by(Way { twist: 1.0, ..REST }, none, none, none);
        let resisting = by(REST, none, none, one);
        let made = |of: fn(&Moved<N>) -> [f64; N]| Made {
            position: of(&position),
            speed: of(&speed),
            rate: of(&rate),
            bend: of(&bend),
            twist: of(&twist),
            resisting: of(&resisting),
        };
        Sliding {
            steps,
            share: 1.0 / self.pieces as f64,
            position: made(|m| m.position),
            speed: made(|m| m.speed),
            half_way: made(|m| m.half_way),
            sum: made(|m| m.sum),
            far: made(|m| m.far),
        }
    }

    #[inline(always)]
    pub(super) fn behind_springs(
        &self,
        sliding: &Sliding<N>,
        rows: Range<usize>,
        extra: &mut [[f64; N]],
        lag: &mut [[f64; N]],
    ) {
        match self.bristles {
            None => self.moving(
                sliding,
                rows,
                extra,
                lag,
                #[inline(always)]
                |way, x, v, at| match sliding.moved(way, x, v, &at.load, &at.friction) {
                    Some(slid) => slid,
                    None => self.rubbed(&Way { at: 0.0, ..*way }, *x, *v, sliding.steps, at),
                },
            ),
            Some(mut bristles) => {
                let half = 0.5 * sliding.share * self.frame.columns.period_s;
                self.moving(
                    sliding,
                    rows,
                    extra,
                    lag,
                    #[inline(always)]
                    |way, x, v, at| {
                        let half_way = bristles.after(lanes(|l| half * v[l]), at.level);
                        let rub = lanes(|l| at.load[l] + self.share[l] * half_way[l]);
                        let moved = sliding.moved_against(way, x, v, &rub);
                        bristles.moved(lanes(|l| moved.position[l] - x[l]), at.level);
                        moved
                    },
                );
            }
        }
    }

    /// Moves tables along the rows, over each piece of the motor's way by what `go` makes of it.
    #[inline(always)]
    fn moving(
        &self,
        sliding: &Sliding<N>,
        rows: Range<usize>,
        extra: &mut [[f64; N]],
        lag: &mut [[f64; N]],
        mut go: impl FnMut(&Way, &[f64; N], &[f64; N], &Resisting<N>) -> Moved<N>,
    ) {
        let unit = self.frame.unit;
        let per_step = 1.0 / self.steps as f64;
        // Seen from the motor.
        let mut x = self.carried_first(rows.clone());
        for l in 0..N {
            x[l] = -x[l] / self.stiffness[l];
        }
        let mut v = [self.frame.raw_speed[rows.start] * unit; N];
        extra[rows.start] = [0.0; N];
        if let Some(last) = lag.get_mut(rows.end - 1) {
            *last = [0.0; N];
        }
        for i in rows.start..rows.end - 1 {
            if let Some(lag) = lag.get_mut(i) {
                // The real spring winds up less.
                *lag = lanes(|l| self.softer[l] * x[l] / unit);
            }
            let mut way = self.way(i);
            let resisting = self.resisting_tables(i);
            let (mut sum, mut far) = ([0.0; N], [0.0; N]);
            for piece in 0..self.pieces {
                let moved = go(&way, &x, &v, &resisting);
                let next = way.from(sliding.share);
                let before = piece as f64 * sliding.share;
                for l in 0..N {
                    x[l] = moved.position[l] - (next.at - way.at);
                    sum[l] += moved.sum[l];
                    far[l] += moved.far[l] + before * moved.sum[l];
                }
                v = moved.speed;
                way = next;
            }
            let rigid = self.rigid(i);
            for l in 0..N {
                extra[i][l] += (sum[l] - far[l]) * per_step - rigid[0][l];
                extra[i + 1][l] = far[l] * per_step - rigid[1][l];
            }
        }
    }

    /// Makes so many steps against dry friction, which may hold a table or turn it.
    #[inline(always)]
    fn rubbed(&self, way: &Way, x: [f64; N], v: [f64; N], steps: usize, at: &Resisting<N>) -> Moved<N> {
        let most: [f64; N] = lanes(|l| self.mobility[l] * at.friction[l]);
        let rub = |l: usize, free: f64| larger(smaller(free, most[l]), -most[l]);
        self.stepped(way, x, v, steps, at.load, rub)
    }

    /// Makes so many steps; `rub` says what dry friction takes off a speed.
    #[inline(always)]
    fn stepped(
        &self,
        way: &Way,
        mut x: [f64; N],
        mut v: [f64; N],
        steps: usize,
        load: [f64; N],
        rub: impl Fn(usize, f64) -> f64,
    ) -> Moved<N> {
        let (per_step, per_span) = (1.0 / self.steps as f64, 1.0 / self.frame.columns.period_s);
        let half_step = 0.5 * self.step_s;
        let (mut sum, mut far, mut half_way) = ([0.0; N], [0.0; N], v);
        for step in 0..steps {
            let s = (step as f64 + 0.5) * per_step;
            let (motor, speed) = (way.position(s), way.speed(s) * per_span);
            for l in 0..N {
                let middle = x[l] + half_step * v[l];
                let push = self.stiffness[l] * (motor - middle) + self.damping[l] * (speed - v[l]);
                sum[l] += push;
                far[l] += s * push;
                // Dry friction takes what speed it can, and never turns it.
                let free = self.kept[l] * v[l] + self.mobility[l] * (push - load[l]);
                v[l] = free - rub(l, free);
                x[l] = middle + half_step * v[l];
            }
            if step + 1 == steps / 2 {
                half_way = v;
            }
        }
        Moved { position: x, speed: v, half_way, sum, far }
    }
}

impl<const N: usize> Sliding<N> {
    /// Tables at a place and speed moved on by a piece of the motor's way, under a load and so much dry friction; `None` where one may
    /// not slide one way all along.
    #[inline(always)]
    fn moved(&self, way: &Way, x: &[f64; N], v: &[f64; N], load: &[f64; N], friction: &[f64; N]) -> Option<Moved<N>> {
        let side: [f64; N] = lanes(|l| 1.0f64.copysign(v[l]));
        let resisting = lanes(|l| load[l] + friction[l] * side[l]);
        let (half_way, speed) = (self.half_way.of(way, x, v, &resisting), self.speed.of(way, x, v, &resisting));
        // By how much it slides on at least.
        let mut least = f64::INFINITY;
        for l in 0..N {
            let (begin, half_way, end) = (v[l] * side[l], half_way[l] * side[l], speed[l] * side[l]);
            let dip = DIP * (begin - 2.0 * half_way + end).abs();
            least = smaller(least, smaller(begin, smaller(half_way, end)) - dip);
        }
        if !(least > 0.0) {
            return None;
        }
        let (position, sum) = (self.position.of(way, x, v, &resisting), self.sum.of(way, x, v, &resisting));
        Some(Moved { position, speed, half_way, sum, far: self.far.of(way, x, v, &resisting) })
    }

    /// The same against a torque that is known.
    #[inline(always)]
    fn moved_against(&self, way: &Way, x: &[f64; N], v: &[f64; N], resisting: &[f64; N]) -> Moved<N> {
        let of = |made: &Made<N>| made.of(way, x, v, resisting);
        Moved {
            position: of(&self.position),
            speed: of(&self.speed),
            half_way: of(&self.half_way),
            sum: of(&self.sum),
            far: of(&self.far),
        }
    }
}

impl Way {
    /// The same way from a later place on.
    #[inline(always)]
    fn from(&self, s: f64) -> Way {
        Way { at: self.position(s), rate: self.speed(s), bend: self.bend + 3.0 * s * self.twist, twist: self.twist }
    }
}
