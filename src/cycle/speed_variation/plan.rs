//! The configuration of a variation, checked once and turned into the constants of a cycle.

use super::config::{GIB_SPEED_VARIATION_PUBLISHED, SpeedVariationConfig, SpeedVariationLimits};
use super::limit::{Limit, Motor, Wave};
use crate::error::{
    Fault, GIB_ERR_SPEED_VARIATION_NONE, GIB_ERR_SPEED_VARIATION_POWER, GIB_ERR_SPEED_VARIATION_SPEED,
    GIB_ERR_SPEED_VARIATION_TORQUE, in_range,
};
use crate::units::{rad_s_from_rpm, rpm_from_rad_s};

/// Status that names a limit.
#[must_use]
pub fn code(limit: Limit) -> i32 {
    match limit {
        Limit::Power => GIB_ERR_SPEED_VARIATION_POWER,
        Limit::Torque => GIB_ERR_SPEED_VARIATION_TORQUE,
        Limit::Speed => GIB_ERR_SPEED_VARIATION_SPEED,
        Limit::Nothing => GIB_ERR_SPEED_VARIATION_NONE,
    }
}

/// A validated configuration. SI units, time in s unless a name says cycles.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    /// Shape.
    pub wave: Wave,
    /// Limits as published instead of exact.
    pub published: bool,
    /// The motor without what cutting uses; the reserve is taken off.
    pub motor: Motor,
    /// Cutting torque to be reserved at least, N·m.
    pub cutting: f64,
    /// Sense of rotation, ±1.
    pub sense: f64,
    /// Mean speed, rad/s, above 0.
    pub mean: f64,
    /// Amplitude and period to begin with; 0: not given.
    pub amplitude: f64,
    /// See `amplitude`.
    pub period: f64,
    /// Servo period.
    pub cycle_s: f64,
    /// Frequency of the chatter, Hz.
    pub chatter_hz: Option<f64>,
}

/// Largest torque that cutting may use, N·m.
pub const MOST_CUTTING: f64 = 1e6;
/// Shortest and longest period, s.
const PERIODS: [f64; 2] = [0.02, 600.0];
/// Smallest amplitude that counts as one.
const LEAST: f64 = 1e-6;
/// Largest amplitude: at 1 the spindle would stop.
const MOST: f64 = 0.999;

impl Plan {
    /// What holds before the first start.
    pub const REST: Plan = Plan {
        wave: Wave::Triangle,
        published: false,
        motor: Motor { inertia: 1.0, power: 1.0, torque: 1.0, speeds: [0.0, 1.0], used: 0.0, viscous: 0.0 },
        cutting: 0.0,
        sense: 1.0,
        mean: 1.0,
        amplitude: 0.0,
        period: 0.0,
        cycle_s: 1e-3,
        chatter_hz: None,
    };

    /// Checks what limits need to know.
    ///
    /// # Errors
    /// `GIB_ERR_CONFIG` with the field, its value and the range allowed.
    pub fn new(c: &SpeedVariationConfig) -> Result<Plan, Fault> {
        let or = |value: f64, default: f64| if value == 0.0 { default } else { value };
        let flag = |field, value: i32| in_range(field, f64::from(value), 0.0, 1.0).map(|v| v != 0.0);
        in_range("reserved\0", f64::from(c.reserved), 0.0, 0.0)?;
        let sine = flag("waveform\0", c.waveform)?;
        flag("formula\0", c.formula)?;
        let load = in_range("inertia_kg_m2\0", c.inertia_kg_m2, 1e-9, 1e6)?;
        let own = in_range("own_inertia_kg_m2\0", c.own_inertia_kg_m2, 0.0, 1e6)?;
        let keep = 1.0 - in_range("reserve_ratio\0", c.reserve_ratio, 0.0, 0.9)?;
        let power = in_range("power_w\0", c.power_w, 1e-3, 1e9)?;
        let torque = in_range("torque_nm\0", or(c.torque_nm, f64::MAX), 1e-6, f64::MAX)?;
        let highest = in_range("speed_max_rpm\0", or(c.speed_max_rpm, 2e5), 1e-3, 2e5)?;
        let lowest = in_range("speed_min_rpm\0", c.speed_min_rpm, 0.0, highest)?;
        let speed = in_range("speed_rpm\0", c.speed_rpm, -2e5, 2e5)?;
        in_range("speed_rpm\0", speed.abs(), lowest.max(1e-3), highest)?;
        let chatter = in_range("chatter_hz\0", c.chatter_hz, 0.0, 1e5)?;
        Ok(Plan {
            wave: if sine { Wave::Sine } else { Wave::Triangle },
            published: c.formula == GIB_SPEED_VARIATION_PUBLISHED,
            motor: Motor {
                inertia: load + own,
                power: keep * power,
                torque: keep * torque,
                speeds: [rad_s_from_rpm(lowest), rad_s_from_rpm(highest)],
                used: in_range("coulomb_nm\0", c.coulomb_nm, 0.0, 1e6)?,
                viscous: in_range("viscous_nm_s\0", c.viscous_nm_s, 0.0, 1e6)?,
            },
            cutting: in_range("cutting_nm\0", c.cutting_nm, 0.0, MOST_CUTTING)?,
            sense: speed.signum(),
            mean: rad_s_from_rpm(speed.abs()),
            amplitude: in_range("amplitude_ratio\0", c.amplitude_ratio, 0.0, MOST)?,
            period: if c.period_s == 0.0 { 0.0 } else { in_range("period_s\0", c.period_s, PERIODS[0], PERIODS[1])? },
            cycle_s: 0.0,
            chatter_hz: (chatter > 0.0).then_some(chatter),
        })
    }

    /// Checks what a start needs beyond that, and that the motor can do what is asked.
    ///
    /// # Errors
    /// As [`Plan::new`]; `GIB_ERR_SPEED_VARIATION_…` naming the amplitude, with the largest possible as upper bound.
    pub fn to_start(c: &SpeedVariationConfig) -> Result<Plan, Fault> {
        let plan = Plan { cycle_s: in_range("cycle_s\0", c.cycle_s, 5e-5, 0.02)?, ..Plan::new(c)? };
        in_range("amplitude_ratio\0", plan.amplitude, LEAST, MOST)?;
        in_range("period_s\0", plan.period, PERIODS[0].max(8.0 * plan.cycle_s), PERIODS[1])?;
        let motor = plan.motor_cutting(plan.cutting);
        let (possible, limit) =
            plan.or_published(&motor, plan.mean, plan.period, || motor.amplitude(plan.wave, plan.mean, plan.period));
        if plan.amplitude > possible * (1.0 + 1e-9) {
            let (field, value) = ("amplitude_ratio\0", plan.amplitude);
            return Err(Fault { code: code(limit), field, value, low: 0.0, high: possible });
        }
        Ok(plan)
    }

    /// The motor while cutting uses at least `cutting` N·m.
    #[must_use]
    pub fn motor_cutting(&self, cutting: f64) -> Motor {
        Motor { used: self.motor.used + cutting.max(self.cutting), ..self.motor }
    }

    /// That motor as the command may use it.
    #[must_use]
    pub fn driving(&self, motor: Motor) -> Motor {
        // The print knows no limit at the top of the swing, and is shown without one.
        const ENDLESS: f64 = 1e30;
        if self.published { Motor { power: ENDLESS, torque: ENDLESS, ..motor } } else { motor }
    }

    /// Change of speed (rad/s) in a cycle that the command makes of a N·m left to accelerate with.
    #[must_use]
    pub fn change_per_nm(&self) -> f64 {
        // The last trifle is the speed loop's, which follows the command with a little overshoot. It is kept of what accelerates, as
        // the overshoot is: kept of all torque it could be all that friction and cutting leave, and a corner out of reach.
        const FOLLOWED: f64 = 0.9955;
        FOLLOWED * self.cycle_s / self.motor.inertia
    }

    /// Friction that helps to brake beside `used` (N·m): without cutting, which may end at any moment.
    #[must_use]
    pub fn brake_help(&self, used: f64) -> f64 {
        used + self.motor.used
    }

    /// Whether the limits are those of a sine that has no closed solution.
    #[must_use]
    pub fn in_rounds(&self) -> bool {
        self.wave == Wave::Sine && !self.published
    }

    /// Largest amplitude by the formula chosen; `moment` of a sine's largest power.
    #[must_use]
    pub fn possible(&self, motor: &Motor, mean: f64, period: f64, moment: f64) -> (f64, Limit) {
        self.or_published(motor, mean, period, || motor.amplitude_at(self.wave, mean, period, moment))
    }

    fn or_published(&self, motor: &Motor, mean: f64, period: f64, exact: impl Fn() -> (f64, Limit)) -> (f64, Limit) {
        if self.published {
            // The print knows no bound of speed either, but that is the machine's.
            let (amplitude, by_speed) = (motor.published_amplitude(mean, period).min(MOST), motor.by_speed(mean));
            return if by_speed < amplitude { (by_speed, Limit::Speed) } else { (amplitude, Limit::Power) };
        }
        let (amplitude, limit) = exact();
        if amplitude > MOST { (MOST, Limit::Speed) } else { (amplitude, limit) }
    }

    /// Shortest period by the formula chosen; 0: none. `moment` at which a sine is steepest.
    #[must_use]
    pub fn shortest(&self, motor: &Motor, mean: f64, amplitude: f64, moment: f64) -> f64 {
        if self.published {
            return motor.published_period(mean, amplitude);
        }
        motor.period_at(self.wave, mean, amplitude, moment).unwrap_or(0.0)
    }

    /// What is possible and what is recommended for this speed, amplitude and period.
    #[must_use]
    pub fn limits(&self) -> SpeedVariationLimits {
        let motor = self.motor_cutting(self.cutting);
        let (wave, mean, amplitude, period) = (self.wave, self.mean, self.amplitude, self.period);
        let mut limits = SpeedVariationLimits::default();
        if period > 0.0 {
            let (possible, limit) = motor.amplitude(wave, mean, period);
            limits.amplitude_ratio = possible.min(MOST);
            limits.limited_by = code(limit);
            limits.published_amplitude_ratio = motor.published_amplitude(mean, period);
            limits.published_power_w = motor.demand(wave, mean, limits.published_amplitude_ratio, period).1;
        }
        if amplitude > 0.0 {
            limits.period_s = motor.period(wave, mean, amplitude).unwrap_or(0.0);
            limits.published_period_s = motor.published_period(mean, amplitude);
        }
        if amplitude > 0.0 && period > 0.0 {
            (limits.torque_nm, limits.power_w) = motor.demand(wave, mean, amplitude, period);
        }
        let (recommended, shortest) = motor.recommended(wave, mean, self.chatter_hz);
        limits.recommended_amplitude_ratio = recommended;
        // What the motor can do may be shorter than what a start takes.
        let least = PERIODS[0].max(8.0 * self.cycle_s);
        limits.recommended_period_s = if shortest > 0.0 { shortest.max(least) } else { 0.0 };
        limits
    }

    /// Checks values that came in with a cycle: mean speed (rpm), amplitude, period and cutting torque.
    ///
    /// # Errors
    /// `GIB_ERR_CONFIG` or `GIB_ERR_SPEED_VARIATION_SPEED` with the input's name, value and range.
    pub fn wanted(&self, speed_rpm: f64, amplitude: f64, period: f64, cutting: f64) -> Result<[f64; 4], Fault> {
        let speed = self.speed(speed_rpm)?;
        // Less than the least is the least: on the way to nothing it must not become a number too small for a cycle.
        let amplitude = match in_range("amplitude_ratio\0", amplitude, 0.0, MOST)? {
            0.0 => self.amplitude,
            amplitude => amplitude.max(LEAST),
        };
        let period = if period == 0.0 { self.period } else { period };
        Ok([
            speed,
            amplitude,
            in_range("period_s\0", period, PERIODS[0].max(8.0 * self.cycle_s), PERIODS[1])?,
            // Within what is reserved a live reading changes nothing.
            in_range("cutting_nm\0", cutting, 0.0, MOST_CUTTING)?.max(self.cutting),
        ])
    }

    /// A speed in rpm, within the limits and in the sense of the configuration, as rad/s in that sense.
    ///
    /// # Errors
    /// `GIB_ERR_SPEED_VARIATION_SPEED` with its value and range.
    pub fn speed(&self, speed_rpm: f64) -> Result<f64, Fault> {
        // A bound that is asked for exactly must not be lost by rounding.
        const ROUNDING: f64 = 1e-12;
        let [low, high] = self.motor.speeds.map(rpm_from_rad_s);
        let (low, high) = (low.max(1e-3) * (1.0 - ROUNDING), high * (1.0 + ROUNDING));
        in_range("speed_rpm\0", speed_rpm * self.sense, low, high)
            .map(rad_s_from_rpm)
            .map_err(|fault| Fault { code: GIB_ERR_SPEED_VARIATION_SPEED, ..fault })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn valid() -> SpeedVariationConfig {
        SpeedVariationConfig {
            struct_size: size_of::<SpeedVariationConfig>() as u32,
            cycle_s: 0.001,
            speed_rpm: 1000.0,
            amplitude_ratio: 0.5,
            period_s: 2.0,
            inertia_kg_m2: 0.5,
            power_w: 1e4,
            ..SpeedVariationConfig::default()
        }
    }

    #[test]
    fn size_is_the_published_one() {
        assert_eq!(size_of::<SpeedVariationConfig>(), SpeedVariationConfig::FIRST_SIZE);
    }

    #[test]
    fn what_the_motor_cannot_do_is_refused_with_what_it_could() {
        assert!(Plan::to_start(&valid()).is_ok());
        let much = SpeedVariationConfig { amplitude_ratio: 0.9, ..valid() };
        let fault = Plan::to_start(&much).unwrap_err();
        assert_eq!((fault.code, fault.field), (GIB_ERR_SPEED_VARIATION_POWER, "amplitude_ratio\0"));
        let possible = SpeedVariationConfig { amplitude_ratio: fault.high, ..much };
        assert!((fault.high - 0.578).abs() < 1e-3 && Plan::to_start(&possible).is_ok());
        let published = SpeedVariationConfig { formula: GIB_SPEED_VARIATION_PUBLISHED, ..much };
        assert!(Plan::to_start(&published).is_ok(), "the print allows 0.9");
        let field = |config| Plan::to_start(&config).unwrap_err().field;
        assert_eq!(field(SpeedVariationConfig { inertia_kg_m2: 0.0, ..valid() }), "inertia_kg_m2\0");
        assert_eq!(field(SpeedVariationConfig { power_w: f64::NAN, ..valid() }), "power_w\0");
        assert_eq!(field(SpeedVariationConfig { speed_rpm: 0.0, ..valid() }), "speed_rpm\0");
        assert_eq!(field(SpeedVariationConfig { amplitude_ratio: 0.0, ..valid() }), "amplitude_ratio\0");
        assert_eq!(field(SpeedVariationConfig { period_s: 0.001, ..valid() }), "period_s\0");
    }

    #[test]
    fn the_print_keeps_to_the_bounds_of_speed() {
        let config = SpeedVariationConfig { formula: GIB_SPEED_VARIATION_PUBLISHED, speed_max_rpm: 1200.0, ..valid() };
        let fault = Plan::to_start(&config).unwrap_err();
        assert!(fault.code == GIB_ERR_SPEED_VARIATION_SPEED && (fault.high - 0.2).abs() < 1e-9, "{fault:?}");
        assert!(Plan::to_start(&SpeedVariationConfig { amplitude_ratio: fault.high, ..config }).is_ok());
    }

    /// To rad/s and back a bound may come out a rounding error beside itself.
    #[test]
    fn a_speed_at_its_bound_is_within_it() {
        for i in 0..1000 {
            let (low, high) = (200.0 + 0.1 * f64::from(i), 900.0 + 0.3 * f64::from(i));
            let config = SpeedVariationConfig { speed_min_rpm: low, speed_rpm: 600.0, speed_max_rpm: high, ..valid() };
            let wanted = |speed| Plan::new(&config).unwrap().wanted(speed, 0.1, 2.0, 0.0);
            assert!(wanted(low).is_ok() && wanted(high).is_ok(), "{low} {high}");
            assert!(wanted(low * (1.0 - 1e-9)).is_err() && wanted(high * (1.0 + 1e-9)).is_err());
        }
    }

    /// A light, fast spindle of which the motor could do more than a start takes.
    #[test]
    fn what_is_recommended_can_be_started() {
        for (cycle_s, speed_rpm) in [(0.001, 2e4), (0.02, 6e3)] {
            let light = SpeedVariationConfig { cycle_s, speed_rpm, inertia_kg_m2: 1e-4, ..valid() };
            let limits = Plan::to_start(&SpeedVariationConfig { amplitude_ratio: 0.01, period_s: 1.0, ..light })
                .unwrap()
                .limits();
            let (amplitude_ratio, period_s) = (limits.recommended_amplitude_ratio, limits.recommended_period_s);
            assert!(Plan::to_start(&SpeedVariationConfig { amplitude_ratio, period_s, ..light }).is_ok(), "{limits:?}");
        }
    }

    #[test]
    fn own_inertia_reserve_and_cutting_all_make_the_limit_smaller() {
        let possible = |config: SpeedVariationConfig| Plan::new(&config).unwrap().limits().amplitude_ratio;
        let all = possible(valid());
        for less in [
            SpeedVariationConfig { own_inertia_kg_m2: 0.1, ..valid() },
            SpeedVariationConfig { reserve_ratio: 0.05, ..valid() },
            SpeedVariationConfig { cutting_nm: 10.0, ..valid() },
            SpeedVariationConfig { coulomb_nm: 10.0, ..valid() },
            SpeedVariationConfig { viscous_nm_s: 0.1, ..valid() },
            SpeedVariationConfig { torque_nm: 50.0, ..valid() },
            SpeedVariationConfig { speed_max_rpm: 1500.0, ..valid() },
            SpeedVariationConfig { speed_min_rpm: 500.0, ..valid() },
        ] {
            assert!(possible(less) < all - 0.01, "{less:?}");
        }
    }
}
