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
    position: Lanes<N>,
    speed: Lanes<N>,
    /// Speed half way.
    half_way: Lanes<N>,
    /// Σ torque over the steps, and Σ torque·share of the time since the beginning of the piece.
    sum: Lanes<N>,
    far: Lanes<N>,
}

/// What one number of [`Moved`] is by one unit of all that makes it.
struct Made<const N: usize> {
    position: Lanes<N>,
    speed: Lanes<N>,
    rate: Lanes<N>,
    bend: Lanes<N>,
    twist: Lanes<N>,
    /// Torque against moving forward.
    resisting: Lanes<N>,
}

impl<const N: usize> Made<N> {
    #[inline(always)]
    fn of(&self, way: &Way, x: Lanes<N>, v: Lanes<N>, resisting: Lanes<N>) -> Lanes<N> {
        let motor = self.rate * way.rate + self.bend * way.bend + self.twist * way.twist;
        let table = self.position * x + self.speed * v;
        motor + (table + self.resisting * resisting)
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
        let (none, one) = (Lanes::splat(0.0), Lanes::splat(1.0));
        let by = |way, position, speed, load| self.stepped(&way, position, speed, steps, load, |_| none);
        let (position, speed) = (by(REST, one, none, none), by(REST, none, one, none));
        let rate = by(Way { rate: 1.0, ..REST }, none, none, none);
        let bend = by(Way { bend: 1.0, ..REST }, none, none, none);
        let twist = by(Way { twist: 1.0, ..REST }, none, none, none);
        let resisting = by(REST, none, none, one);
        let made = |of: fn(&Moved<N>) -> Lanes<N>| Made {
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
                |way, x, v, at| match sliding.moved(way, x, v, at) {
                    Some(slid) => slid,
                    None => self.rubbed(&Way { at: 0.0, ..*way }, x, v, sliding.steps, at),
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
                        let half_way = bristles.after(v * half, at.level);
                        let moved = sliding.moved_against(way, x, v, at.load + self.share * half_way);
                        bristles.moved(moved.position - x, at.level);
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
        mut go: impl FnMut(&Way, Lanes<N>, Lanes<N>, &Resisting<N>) -> Moved<N>,
    ) {
        let unit = self.frame.unit;
        let per_step = 1.0 / self.steps as f64;
        // Seen from the motor.
        let mut x = -self.carried_first(rows.clone()) / self.stiffness;
        let mut v = Lanes::splat(self.frame.raw_speed[rows.start] * unit);
        extra[rows.start] = [0.0; N];
        if let Some(last) = lag.get_mut(rows.end - 1) {
            *last = [0.0; N];
        }
        for i in rows.start..rows.end - 1 {
            if let Some(lag) = lag.get_mut(i) {
                // The real spring winds up less.
                *lag = (self.softer * x / unit).to_array();
            }
            let mut way = self.way(i);
            let resisting = self.resisting_tables(i);
            let (mut sum, mut far) = (Lanes::splat(0.0), Lanes::splat(0.0));
            for piece in 0..self.pieces {
                let moved = go(&way, x, v, &resisting);
                let next = way.from(sliding.share);
                let before = piece as f64 * sliding.share;
                x = moved.position - Lanes::splat(next.at - way.at);
                sum = sum + moved.sum;
                far = far + (moved.far + moved.sum * before);
                v = moved.speed;
                way = next;
            }
            let rigid = self.rigid(i);
            extra[i] = (Lanes::from(extra[i]) + ((sum - far) * per_step - rigid[0])).to_array();
            extra[i + 1] = (far * per_step - rigid[1]).to_array();
        }
    }

    /// Makes so many steps against dry friction, which may hold a table or turn it.
    #[inline(always)]
    fn rubbed(&self, way: &Way, x: Lanes<N>, v: Lanes<N>, steps: usize, at: &Resisting<N>) -> Moved<N> {
        let most = self.mobility * at.friction;
        // Dry friction takes what speed it can, and never turns it.
        self.stepped(
            way,
            x,
            v,
            steps,
            at.load,
            #[inline(always)]
            |free| free.smaller(most).larger(-most),
        )
    }

    /// Makes so many steps; `rub` says what dry friction takes off speeds.
    #[inline(always)]
    fn stepped(
        &self,
        way: &Way,
        mut x: Lanes<N>,
        mut v: Lanes<N>,
        steps: usize,
        load: Lanes<N>,
        rub: impl Fn(Lanes<N>) -> Lanes<N>,
    ) -> Moved<N> {
        let (per_step, per_span) = (1.0 / self.steps as f64, 1.0 / self.frame.columns.period_s);
        let half_step = 0.5 * self.step_s;
        let (mut sum, mut far, mut half_way) = (Lanes::splat(0.0), Lanes::splat(0.0), v);
        for step in 0..steps {
            let s = (step as f64 + 0.5) * per_step;
            let (motor, speed) = (Lanes::splat(way.position(s)), Lanes::splat(way.speed(s) * per_span));
            let middle = x + v * half_step;
            let push = self.stiffness * (motor - middle) + self.damping * (speed - v);
            sum = sum + push;
            far = far + push * s;
            let free = self.kept * v + self.mobility * (push - load);
            v = free - rub(free);
            x = middle + v * half_step;
            if step + 1 == steps / 2 {
                half_way = v;
            }
        }
        Moved { position: x, speed: v, half_way, sum, far }
    }
}

impl<const N: usize> Sliding<N> {
    /// Tables at a place and speed moved on by a piece of the motor's way, under what resists them; `None` where one may not slide one
    /// way all along.
    #[inline(always)]
    fn moved(&self, way: &Way, x: Lanes<N>, v: Lanes<N>, at: &Resisting<N>) -> Option<Moved<N>> {
        let side = v.sign();
        let resisting = at.load + at.friction * side;
        let (half_way, speed) = (self.half_way.of(way, x, v, resisting), self.speed.of(way, x, v, resisting));
        // By how much they slide on at least.
        let (begin, middle, end) = (v * side, half_way * side, speed * side);
        let dip = (begin - middle * 2.0 + end).abs() * DIP;
        let least = begin.smaller(middle.smaller(end)) - dip;
        least.above(Lanes::splat(0.0)).all().then(|| Moved {
            position: self.position.of(way, x, v, resisting),
            speed,
            half_way,
            sum: self.sum.of(way, x, v, resisting),
            far: self.far.of(way, x, v, resisting),
        })
    }

    /// The same against a torque that is known.
    #[inline(always)]
    fn moved_against(&self, way: &Way, x: Lanes<N>, v: Lanes<N>, resisting: Lanes<N>) -> Moved<N> {
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
