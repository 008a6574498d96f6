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
    position: [f64; N],
    speed: [f64; N],
    /// Rows in which the flanks pushed since the encoder would have told them apart, and the way they push.
    together: [usize; N],
    side: [f64; N],
    /// How the motor has given way.
    given: [[f64; N]; 3],
    /// Not known to move with the motor.
    loose: [bool; N],
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
        let giving = Giving::new(self.frame.columns.period_s, self.step_s);
        let settled = (SWING_S / self.frame.columns.period_s).ceil() as usize;
        // Where the table of a rigid link is at a load.
        let behind = |l: usize, motor: f64, load: f64| motor - self.half[l].copysign(load) - load / self.stiffness[l];
        let mut load = self.carried(rows.start);
        let mut state = State {
            position: [0.0; N],
            speed: [0.0; N],
            together: [0; N],
            side: [0.0; N],
            given: [[0.0; N]; 3],
            loose: [false; N],
        };
        // How friction has built up on the way of each table, and as the motor's way has it where a table moves with that.
        let mut bristles = if BUILDS_UP { self.bristles } else { None };
        let mut with_motor = bristles;
        let mut any = false;
        extra[rows.start] = [0.0; N];
        if let Some(last) = lag.get_mut(rows.end - 1) {
            *last = [0.0; N];
        }
        for i in rows.start..rows.end - 1 {
            extra[i + 1] = [0.0; N];
            let next = self.carried(i + 1);
            let motor = self.frame.columns.position[i] * unit;
            let steady = i > rows.start && self.frame.direction[i] * self.frame.direction[i + 1] > 0.5;
            let level = self.resistance.each(|r| r.level[i]);
            if let Some(bristles) = with_motor.as_mut().filter(|_| i > rows.start) {
                let way = (self.frame.columns.position[i] - self.frame.columns.position[i - 1]) * unit;
                bristles.moved_together(way, level, R::DISTINCT);
            }
            let mut firm = [false; N];
            let mut all_firm = steady;
            for l in 0..N {
                let both = smaller(load[l].abs(), next[l].abs());
                // Near no load the flanks may part within the row.
                firm[l] =
                    steady & !self.swings[l] & (both > 0.1 * self.share[l] * level[l]) & (load[l] * next[l] > 0.0);
                all_firm &= firm[l];
            }
            // In most rows of most tables this is all.
            if all_firm && !any {
                if let Some(lag) = lag.get_mut(i) {
                    *lag = lanes(|l| (behind(l, motor, load[l]) - motor) / unit);
                }
                load = next;
                continue;
            }
            any = false;
            for l in 0..N {
                let firm = firm[l];
                let held = !state.loose[l] || state.together[l] >= settled && state.side[l] * load[l] > 0.0;
                if firm && held || !state.loose[l] {
                    state.position[l] = behind(l, motor, load[l]);
                    state.speed[l] = self.frame.raw_speed[i] * unit;
                    state.together[l] = 0;
                    (state.given[0][l], state.given[1][l], state.given[2][l]) = (0.0, 0.0, load[l]);
                    if let (Some(bristles), Some(with_motor)) = (&mut bristles, &with_motor) {
                        bristles.take(l, with_motor);
                    }
                }
                state.loose[l] = !(firm && held);
                any |= state.loose[l];
            }
            if let Some(lag) = lag.get_mut(i) {
                *lag = lanes(|l| (state.position[l] - motor) / unit);
            }
            if any {
                let [near, far] = self.between(i, giving, &mut state, bristles.as_mut());
                let rigid = self.rigid(i);
                for l in (0..N).filter(|l| state.loose[*l]) {
                    extra[i][l] += near[l] - rigid[0][l];
                    extra[i + 1][l] += far[l] - rigid[1][l];
                }
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
    ) -> [[f64; N]; 2] {
        let resisting = self.resisting_tables(row);
        let at = (row, yielding, &resisting);
        let Some(bristles) = bristles else {
            // Dry friction takes what speed it can, and never turns it.
            let dry: [f64; N] = lanes(|l| self.mobility[l] * resisting.friction[l]);
            return self.stepping(
                at,
                state,
                #[inline(always)]
                |free, _| lanes(|l| larger(smaller(free[l], dry[l]), -dry[l])),
            );
        };
        if let Some(shares) = self.slipping(at, state, bristles) {
            return shares;
        }
        self.stepping(
            at,
            state,
            #[inline(always)]
            |_, v| {
                let torque = bristles.moved(lanes(|l| self.step_s * v[l]), resisting.level);
                lanes(|l| self.mobility[l] * self.share[l] * torque[l])
            },
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
    ) -> Option<[[f64; N]; 2]> {
        let torque = bristles.slipping(state.speed, at.2.level)?;
        let (before, rubbed) = (*state, lanes(|l| self.mobility[l] * self.share[l] * torque[l]));
        let goes_on = |v: &[f64; N]| (0..N).fold(true, |all, l| all & (v[l] * torque[l] >= 0.0));
        let mut all_go_on = true;
        let shares = self.stepping(
            at,
            state,
            #[inline(always)]
            |_, v| {
                all_go_on &= goes_on(&v);
                rubbed
            },
        );
        if all_go_on && goes_on(&state.speed) {
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
        mut rub: impl FnMut([f64; N], [f64; N]) -> [f64; N],
    ) -> [[f64; N]; 2] {
        let way = self.way(row);
        let (per_step, per_span) = (1.0 / self.steps as f64, 1.0 / self.frame.columns.period_s);
        let half_step = 0.5 * self.step_s;
        // What swings slower than the rows come is in the motor's measured way.
        let motor_mobility = lanes::<N>(|l| if self.swings[l] { 0.0 } else { self.step_s / self.motor_inertia[l] });
        // Each step waits for the one before it: what does not depend on that is worked out beside it, not within.
        let pull: [f64; N] = lanes(|l| self.mobility[l] * resisting.load[l]);
        let slack = lanes::<N>(|l| self.stiffness[l] * self.half[l]);
        let mut v = state.speed;
        let mut middle: [f64; N] = lanes(|l| state.position[l] + half_step * v[l]);
        let [mut give, mut giving, mut answered] = state.given;
        let (mut sum, mut far, mut nearest) = ([0.0; N], [0.0; N], [f64::INFINITY; N]);
        for step in 0..self.steps {
            let s = (step as f64 + 0.5) * per_step;
            let (motor, speed) = (way.position(s), way.speed(s) * per_span);
            // One number of all tables after the other, so that registers hold four at a time.
            let wind: [f64; N] = lanes(|l| (motor + give[l]) - middle[l]);
            let side: [f64; N] = lanes(|l| 1.0f64.copysign(wind[l]));
            let far_apart: [f64; N] = lanes(|l| wind[l].abs());
            let outward: [f64; N] = lanes(|l| self.damping[l] * ((speed + giving[l]) - v[l]));
            // Flanks push and never pull.
            let spring: [f64; N] =
                lanes(|l| larger(self.stiffness[l] * far_apart[l] + (outward[l] * side[l] - slack[l]), 0.0));
            let push: [f64; N] = lanes(|l| if far_apart[l] > self.half[l] { spring[l] } else { 0.0 });
            let push: [f64; N] = lanes(|l| push[l] * side[l]);
            nearest = lanes(|l| smaller(far_apart[l], nearest[l]));
            let given: [[f64; 3]; N] =
                std::array::from_fn(|l| yielding.step([give[l], giving[l], answered[l]], push[l], motor_mobility[l]));
            give = lanes(|l| given[l][0]);
            giving = lanes(|l| given[l][1]);
            answered = lanes(|l| given[l][2]);
            sum = lanes(|l| sum[l] + push[l]);
            far = lanes(|l| far[l] + s * push[l]);
            let free: [f64; N] = lanes(|l| (self.kept[l] * v[l] - pull[l]) + self.mobility[l] * push[l]);
            let rubbed = rub(free, v);
            for l in 0..N {
                v[l] = free[l] - rubbed[l];
                middle[l] += self.step_s * v[l];
            }
        }
        // The last step ends in the middle of one that is not made.
        let x = lanes(|l| middle[l] - half_step * v[l]);
        (state.position, state.speed, state.side) = (x, v, sum);
        state.given = [give, giving, answered];
        // A measured motor trembles by its encoder, and would part flanks that rest on each other for ever.
        let told_apart = self.frame.resolution * self.frame.unit;
        for l in 0..N {
            let touched = usize::from(sum[l] != 0.0);
            state.together[l] = if nearest[l] > self.half[l] - told_apart { state.together[l] + touched } else { 0 };
        }
        [lanes(|l| (sum[l] - far[l]) * per_step), far.map(|far| far * per_step)]
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
