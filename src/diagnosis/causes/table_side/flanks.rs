//! Tables behind the flanks of a clearance. Before flanks that meet the motor gives way between its rows, as [`Giving`] says.
//!
//! While the link of a clearance is loaded one way, c = J₂·ẍ₁ + φ·(Tc·sign(ẋ₁) + Tv·ẋ₁) + T0 keeps one flank in contact, the
//! table moves with the motor, and nothing need be simulated.

use super::*;
use crate::plant::coupling::Giving;

/// How long flanks swing after they have met, s: three time constants of their damping.
const SWING_S: f64 = 4e-3;

/// Where the tables are.
#[derive(Clone, Copy)]
struct State<const N: usize> {
    position: Lanes<N>,
    speed: Lanes<N>,
    /// Rows in which the flanks pushed since the encoder would have told them apart, and the way they push.
    together: Lanes<N>,
    side: Lanes<N>,
    /// How the motor has given way.
    given: [Lanes<N>; 3],
    /// Not known to move with the motor.
    loose: Which<N>,
}

impl<const N: usize, R: Resisted<N>> Tables<'_, N, R> {
    /// Moves tables along the rows, under friction that builds up or that is there at once.
    #[inline(always)]
    pub(super) fn behind_flanks<const BUILDS_UP: bool>(
        &self,
        rows: Range<usize>,
        extra: &mut [[f64; N]],
        lag: &mut [[f64; N]],
    ) {
        let unit = self.frame.unit;
        let nothing = Lanes::splat(0.0);
        let giving = Giving::new(self.frame.columns.period_s, self.step_s);
        let settled = Lanes::splat((SWING_S / self.frame.columns.period_s).ceil());
        // Where the table of a rigid link is at a load.
        let behind = |motor: Lanes<N>, load: Lanes<N>| motor - self.half.copysign(load) - load / self.stiffness;
        let firmly = self.share * 0.1;
        let mut load = self.carried(rows.start);
        let mut state = State {
            position: nothing,
            speed: nothing,
            together: nothing,
            side: nothing,
            given: [nothing; 3],
            loose: Which::splat(false),
        };
        // How friction has built up on the way of each table, and as the motor's way has it where a table moves with that.
        let mut bristles = if BUILDS_UP { self.bristles } else { None };
        let mut with_motor = bristles.filter(|bristles| !bristles.are_told_by_force());
        let held: Option<[&[f64]; N]> = bristles
            .filter(Bristles::are_told_by_force)
            .map(|_| std::array::from_fn(|l| self.resistance.lane(l).held(self.frame)));
        let mut any = false;
        extra[rows.start] = [0.0; N];
        if let Some(last) = lag.get_mut(rows.end - 1) {
            *last = [0.0; N];
        }
        for i in rows.start..rows.end - 1 {
            extra[i + 1] = [0.0; N];
            let next = self.carried(i + 1);
            let motor = Lanes::splat(self.frame.columns.position[i] * unit);
            let steady = i > rows.start && self.frame.direction[i] * self.frame.direction[i + 1] > 0.5;
            let level = self.resistance.each(|r| r.level[i]);
            if let Some(bristles) = with_motor.as_mut().filter(|_| i > rows.start) {
                let way = (self.frame.columns.position[i] - self.frame.columns.position[i - 1]) * unit;
                bristles.moved_together(way, self.resistance.each(|r| r.level[i]), R::DISTINCT);
            }
            // Near no load the flanks may part within the row.
            let both = load.abs().smaller(next.abs());
            let loaded = both.above(firmly * level) & (load * next).above(nothing);
            let firm = Which::splat(steady) & !self.swings & loaded;
            // In most rows of most tables this is all.
            if firm.all() && !any {
                if let Some(lag) = lag.get_mut(i) {
                    *lag = ((behind(motor, load) - motor) / unit).to_array();
                }
                load = next;
                continue;
            }
            let touching = state.together.reach(settled) & (state.side * load).above(nothing);
            let with_it = firm & (!state.loose | touching);
            let begins = with_it | !state.loose;
            if begins.any() {
                state.position = begins.choose(behind(motor, load), state.position);
                state.speed = begins.choose(Lanes::splat(self.frame.raw_speed[i] * unit), state.speed);
                state.together = (!begins).keep(state.together);
                let [give, giving, answered] = state.given;
                state.given = [(!begins).keep(give), (!begins).keep(giving), begins.choose(load, answered)];
                if let Some(bristles) = &mut bristles {
                    match (&with_motor, held) {
                        (Some(with_motor), _) => bristles.take(begins, with_motor),
                        (None, Some(held)) => bristles.hold(begins, Lanes::each(|l| held[l][i])),
                        (None, None) => {}
                    }
                }
            }
            state.loose = !with_it;
            any = state.loose.any();
            if let Some(lag) = lag.get_mut(i) {
                *lag = ((state.position - motor) / unit).to_array();
            }
            if any {
                let ([near, far], rigid) = (self.between(i, giving, &mut state, bristles.as_mut()), self.rigid(i));
                extra[i] = (Lanes::from(extra[i]) + state.loose.keep(near - rigid[0])).to_array();
                extra[i + 1] = state.loose.keep(far - rigid[1]).to_array();
            }
            load = next;
        }
    }

    /// Moves the tables on by one row; answers the share of each link's torque that belongs to the row and to the next one, by
    /// how near it acts.
    #[inline(always)]
    fn between(
        &self,
        row: usize,
        yielding: Giving,
        state: &mut State<N>,
        bristles: Option<&mut Bristles<N>>,
    ) -> [Lanes<N>; 2] {
        let resisting = self.resisting_tables(row);
        let at = (row, yielding, &resisting);
        let Some(bristles) = bristles else {
            // Dry friction takes what speed it can, and never turns it.
            let dry = self.mobility * resisting.friction;
            return self.stepping(
                at,
                state,
                #[inline(always)]
                |free, _| free.smaller(dry).larger(-dry),
            );
        };
        if let Some(shares) = self.slipping(at, state, bristles) {
            return shares;
        }
        let rubs = self.mobility * self.share;
        self.stepping(
            at,
            state,
            #[inline(always)]
            |_, v| rubs * bristles.moved(v * self.step_s, resisting.level),
        )
    }

    /// The same where all slide on one way and friction has built up, as in most rows: then it is dry friction, and bristles stay as they
    /// are. `None` where one does not, with the tables where they were.
    #[inline(always)]
    fn slipping(
        &self,
        at: (usize, Giving, &Resisting<N>),
        state: &mut State<N>,
        bristles: &Bristles<N>,
    ) -> Option<[Lanes<N>; 2]> {
        let torque = bristles.slipping(state.speed, at.2.level)?;
        let (before, rubbed) = (*state, self.mobility * self.share * torque);
        let goes_on = |v: Lanes<N>| (v * torque).reach(Lanes::splat(0.0));
        let mut all_go_on = Which::splat(true);
        let shares = self.stepping(
            at,
            state,
            #[inline(always)]
            |_, v| {
                all_go_on = all_go_on & goes_on(v);
                rubbed
            },
        );
        if (all_go_on & goes_on(state.speed)).all() {
            return Some(shares);
        }
        *state = before;
        None
    }

    /// The same by what `rub` takes off the speeds that the tables would have, from those that they had.
    #[inline(always)]
    fn stepping(
        &self,
        (row, yielding, resisting): (usize, Giving, &Resisting<N>),
        state: &mut State<N>,
        mut rub: impl FnMut(Lanes<N>, Lanes<N>) -> Lanes<N>,
    ) -> [Lanes<N>; 2] {
        let way = self.way(row);
        let (per_step, per_span) = (1.0 / self.steps as f64, 1.0 / self.frame.columns.period_s);
        let half_step = 0.5 * self.step_s;
        // Each step waits for the one before it: what does not depend on that is worked out beside it, not within.
        let pull = self.mobility * resisting.load;
        let nothing = Lanes::splat(0.0);
        let mut v = state.speed;
        let mut middle = state.position + v * half_step;
        let [mut give, mut giving, mut answered] = state.given;
        let (mut sum, mut far, mut nearest) = (nothing, nothing, Lanes::splat(f64::INFINITY));
        for step in 0..self.steps {
            let s = (step as f64 + 0.5) * per_step;
            let (motor, speed) = (Lanes::splat(way.position(s)), Lanes::splat(way.speed(s) * per_span));
            let wind = (motor + give) - middle;
            let (side, far_apart) = (wind.sign(), wind.abs());
            let outward = self.damping * ((speed + giving) - v);
            // Flanks push and never pull.
            let spring = (self.stiffness * far_apart + (outward * side - self.slack)).larger(nothing);
            let push = far_apart.above(self.half).keep(spring) * side;
            nearest = far_apart.smaller(nearest);
            [give, giving, answered] = yielding.step([give, giving, answered], push, self.motor_mobility);
            sum = sum + push;
            far = far + push * s;
            let free = (self.kept * v - pull) + self.mobility * push;
            v = free - rub(free, v);
            middle = middle + v * self.step_s;
        }
        // The last step ends in the middle of one that is not made.
        (state.position, state.speed, state.side) = (middle - v * half_step, v, sum);
        state.given = [give, giving, answered];
        // A measured motor trembles by its encoder, and would part flanks that rest on each other for ever.
        let told_apart = Lanes::splat(self.frame.resolution * self.frame.unit);
        let touched = (sum.above(nothing) | nothing.above(sum)).keep(Lanes::splat(1.0));
        state.together = nearest.above(self.half - told_apart).keep(state.together + touched);
        [(sum - far) * per_step, far * per_step]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::frame::Columns;
    use crate::machine::Machine;
    use crate::plant::noise::Noise;

    /// Ways there and back, each taking two seconds, as an encoder with such a grid (mm) shows them.
    fn there_and_back(grid: f64) -> Columns {
        let rows = 8000;
        let time: Vec<f64> = (0..rows).map(|i| f64::from(i) * 1e-3).collect();
        let position: Vec<f64> =
            time.iter().map(|t| (1.37 * (1.0 - ((t % 4.0) - 2.0).abs() / 2.0) / grid).round() * grid).collect();
        let mut noise = Noise::new(1);
        let torque = position.iter().map(|_| noise.normal(0.1)).collect();
        Columns { position_grid: grid, ..Columns::every_millisecond(position, torque) }
    }

    #[test]
    fn flanks_that_rest_on_each_other_are_not_parted_by_the_steps_of_the_encoder() {
        let axis = Machine::parse(include_str!("../../../../examples/machines/believed.json")).unwrap().axes.remove(0);
        let clearance = Effect::Backlash {
            width_um: 30.0,
            table_inertia_share: 0.5,
            table_friction_share: 0.5,
            contact_hz: 700.0,
            contact_damping_ratio: 0.3,
        };
        for grid in [1e-3, 1e-6] {
            let columns = there_and_back(grid);
            let frame = Frame::new(&axis, &columns, Some(5));
            let resistance = Resistance::of(&frame, &axis);
            let trace = terms(&frame, &resistance, &[Some(clearance)]).swap_remove(0).fixed.unwrap();
            let (mut crossing, mut together) = (0.0f64, 0.0f64);
            for (row, torque) in frame.kept.iter().zip(&trace.torque) {
                // At 0.7 mm/s the clearance is crossed in 44 ms.
                let since = *row % 2000;
                let most = if since < 40 { &mut crossing } else { &mut together };
                if since < 40 || since > 100 && since < 1980 {
                    *most = most.max(torque.abs());
                }
            }
            assert!(crossing > 0.3 && together < 1e-9, "grid {grid}: {crossing} {together}");
        }
    }
}
