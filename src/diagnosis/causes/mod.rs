//! The causes a diagnosis can name, one file a cause. Each knows the trace it leaves in torque and in table − encoder
//! (its regressors), its non-linear parameters and where to start them, its physical bounds, what it is confused with,
//! and the sentence it says to a machinist.

mod backlash;
mod cable_force;
mod cogging;
mod constant_torque;
mod coulomb_friction_mismatch;
mod dead_time;
mod direction_dependent_friction;
pub mod drive_compliance;
mod external_vibration;
mod inertia_mismatch;
pub mod loose_spring;
pub mod position_dependent_friction;
mod quadratic_drag;
mod screw_periodic_error;
mod screw_pitch_error;
mod stribeck_friction;
pub mod torque_saturation;
mod viscous_friction_mismatch;

pub(super) mod periods;
pub(super) mod presliding_friction;
pub(super) mod table_side;
pub(super) mod thermal_drift;

use super::frame::Frame;
use crate::machine::{Axis, Cause, Effect, TwoMasses};
use rayon::prelude::*;
pub use table_side::{Resistance, Shaking};

/// A regressor at the judged rows: what one unit of a coefficient adds.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Trace {
    /// In the torque, drive's own unit; empty where the cause leaves none.
    pub torque: Vec<f64>,
    /// In table − encoder, load units; empty where the cause leaves none.
    pub table: Vec<f64>,
}

impl Trace {
    /// A trace in the torque alone.
    #[must_use]
    pub fn torque(values: Vec<f64>) -> Self {
        Self { torque: values, table: Vec::new() }
    }

    /// A trace in table − encoder alone.
    #[must_use]
    pub fn table(values: Vec<f64>) -> Self {
        Self { torque: Vec::new(), table: values }
    }
}

/// What a cause adds at given non-linear parameters: one part of fixed size, and regressors whose coefficients are fitted.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Term {
    /// Fixed part.
    pub fixed: Option<Trace>,
    /// One a coefficient.
    pub regressors: Vec<Trace>,
}

impl Term {
    /// One regressor in the torque.
    #[must_use]
    pub fn torque(values: Vec<f64>) -> Self {
        Self { fixed: None, regressors: vec![Trace::torque(values)] }
    }
}

/// How a non-linear parameter is searched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// Positive, by its logarithm, within bounds.
    Log(f64, f64),
    /// Within bounds, with a step over which the trace changes but little.
    Linear(f64, f64, f64),
    /// Positive, by its logarithm, within bounds; what a law is not sure to be, and has at the last value until what it leaves
    /// says otherwise.
    Form(f64, f64, f64),
    /// One of the starts, not refined.
    Choice,
}

/// What is left of the measurement, for causes that look there for a start.
#[derive(Debug)]
pub struct Rest<'a> {
    /// Torque at the judged rows.
    pub torque: &'a [f64],
    /// table − encoder at the judged rows; empty without a table scale.
    pub table: &'a [f64],
}

/// Starts by the parameters of one.
type Others = fn(&[f64]) -> Vec<Vec<f64>>;

/// How a law is looked for.
pub struct Manner {
    /// Starts beside one, with parameters that few machines have, for where all causes leave much; `None` where there are none.
    pub seldom: Option<Others>,
    /// Starts anew from where a fit has strayed beyond the bounds, by what it has found all the same.
    pub restarts: Others,
    /// Where other valleys may be, by the bottom of one.
    pub valleys: Others,
    /// The same with a swing damped more by a factor; `None` where nothing swings.
    pub damped: fn(&[f64], f64) -> Option<Vec<f64>>,
    /// Whether the starts depend on what is left.
    pub starts_from_rest: bool,
    /// Whether the sum of squares is so rugged about the right parameters that they are approached from afar.
    pub approached: bool,
    /// Whether a table behind a spring or a clearance turns round in quite another way with it.
    pub turns_table: bool,
    /// Whether its non-linear parameters are told by means over several rows (`means`) and stay where the rows themselves are fitted.
    pub told_by_means: bool,
    /// Indices of non-linear parameters that are taken for granted, and by how much they may be off (a standard deviation).
    pub taken: &'static [(usize, f64)],
}

/// That of a law that does not stray, with a trace that is worked out row by row, from starts that the recording gives.
const PLAIN: Manner = Manner {
    seldom: None,
    restarts: |_| Vec::new(),
    valleys: |_| Vec::new(),
    damped: |_, _| None,
    starts_from_rest: false,
    approached: false,
    turns_table: false,
    told_by_means: false,
    taken: &[],
};

/// Traces by what is between motor and table.
type TermsBehind = fn(&Frame, Option<&TwoMasses>, &[Vec<f64>]) -> Vec<Term>;

/// Traces by from where on the motor delivers less than its current says, and how much of what its current adds, where it does.
type TermsDelivered = fn(&Frame, Option<(f64, f64)>, &[Vec<f64>]) -> Vec<Term>;

/// How traces are come by, one for each set of non-linear parameters.
pub enum Terms {
    /// Worked out row by row.
    ByRows(fn(&Frame, &[Vec<f64>]) -> Vec<Term>),
    /// The same, by what the motor makes of its current.
    Delivered(TermsDelivered),
    /// The same, by what the axis has between motor and table where a scale shows it, of what shakes the table; and how it does by non-linear parameters and
    /// coefficients.
    Shaking(TermsBehind, fn(&Frame, &[f64], &[f64]) -> Option<Shaking>),
    /// Simulated between the rows under what resists the table: an effect that parts it from the motor, by its non-linear parameters.
    Simulated(fn(&Frame, &[f64]) -> Option<Effect>),
}

/// One cause.
pub struct Law {
    /// Its name.
    pub cause: Cause,
    /// How each non-linear parameter is searched.
    pub scales: &'static [Scale],
    /// Starts of the non-linear parameters; none where this recording cannot show the cause.
    pub starts: fn(&Frame, &Rest) -> Vec<Vec<f64>>,
    /// How it is looked for.
    pub manner: Manner,
    /// The traces at given non-linear parameters.
    pub terms: Terms,
    /// The effect that parameters and coefficients stand for; `None` beyond physical bounds. Asked by [`Law::effect`].
    effect: fn(&Frame, &[f64], &[f64]) -> Option<Effect>,
    /// What leaves a similar trace.
    pub confused_with: &'static [Cause],
    /// What it says to a machinist.
    pub sentence: fn(&Effect, &Axis) -> String,
}

impl Law {
    /// The traces at given non-linear parameters, one for each set of them.
    #[must_use]
    pub fn terms(&self, frame: &Frame, resistance: &Resistance, shapes: &[Vec<f64>]) -> Vec<Term> {
        match self.terms {
            Terms::ByRows(terms) => terms(frame, shapes),
            Terms::Delivered(terms) => terms(frame, resistance.saturation(), shapes),
            Terms::Shaking(terms, _) => terms(frame, resistance.link(), shapes),
            Terms::Simulated(effect) => {
                let effects: Vec<Option<Effect>> = shapes.iter().map(|shape| effect(frame, shape)).collect();
                table_side::terms(frame, resistance, &effects)
            }
        }
    }

    /// The traces under each of these resistances; those of a simulated table side by side.
    #[must_use]
    pub fn terms_under_each(&self, frame: &Frame, resistances: &[&Resistance], shape: &[f64]) -> Vec<Term> {
        match self.terms {
            Terms::Simulated(effect) => table_side::terms_under_each(frame, resistances, effect(frame, shape)),
            _ => resistances.iter().flat_map(|under| self.terms(frame, under, &[shape.to_vec()])).collect(),
        }
    }

    /// Whether the traces are others under another resistance.
    #[must_use]
    pub fn is_otherwise(&self, under: &Resistance, other: &Resistance) -> bool {
        match self.terms {
            Terms::ByRows(_) => false,
            Terms::Delivered(_) => under.saturation() != other.saturation(),
            Terms::Shaking(..) => under.link() != other.link(),
            Terms::Simulated(_) => !under.is_like(other),
        }
    }

    /// The effect that parameters and coefficients stand for; `None` beyond physical bounds, or where no machine file may hold it.
    #[must_use]
    pub fn effect(&self, frame: &Frame, shape: &[f64], coefficients: &[f64]) -> Option<Effect> {
        (self.effect)(frame, shape, coefficients).filter(Effect::is_allowed)
    }

    /// What is simulated with these parameters, also where it is said otherwise or is beyond physical bounds; `None` of a law that is
    /// worked out row by row.
    #[must_use]
    pub fn simulated(&self, frame: &Frame, shape: &[f64]) -> Option<Effect> {
        match self.terms {
            Terms::Simulated(effect) => effect(frame, shape),
            _ => None,
        }
    }

    /// Whether the traces are a simulation of what happens between the rows.
    #[must_use]
    pub fn is_simulated(&self) -> bool {
        matches!(self.terms, Terms::Simulated(_))
    }

    /// Whether the traces go by what the motor makes of its current.
    #[must_use]
    pub fn is_delivered(&self) -> bool {
        matches!(self.terms, Terms::Delivered(_))
    }

    /// Whether the cause shakes the table.
    #[must_use]
    pub fn is_shaking(&self) -> bool {
        matches!(self.terms, Terms::Shaking(..))
    }

    /// How the cause shakes a table; `None` of one that does not.
    #[must_use]
    pub fn shakes(&self, frame: &Frame, shape: &[f64], coefficients: &[f64]) -> Option<Shaking> {
        match self.terms {
            Terms::Shaking(_, shakes) => shakes(frame, shape, coefficients),
            _ => None,
        }
    }

    /// Whether a parameter is one of form, and as usual: it is not fitted then.
    #[must_use]
    pub fn is_as_usual(&self, index: usize, value: f64) -> bool {
        matches!(self.scales.get(index), Some(Scale::Form(.., usual)) if *usual == value)
    }
}

impl std::fmt::Debug for Law {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.cause.name())
    }
}

/// All laws, in the order of the vocabulary.
pub static LAWS: &[&Law] = &[
    &inertia_mismatch::LAW,
    &coulomb_friction_mismatch::LAW,
    &viscous_friction_mismatch::LAW,
    &constant_torque::LAW,
    &direction_dependent_friction::LAW,
    &stribeck_friction::LAW,
    &presliding_friction::LAW,
    &backlash::LAW,
    &drive_compliance::LAW,
    &cogging::LAW,
    &position_dependent_friction::LAW,
    &cable_force::LAW,
    &quadratic_drag::LAW,
    &thermal_drift::LAW,
    &dead_time::LAW,
    &external_vibration::LAW,
    &torque_saturation::LAW,
    &screw_pitch_error::LAW,
    &screw_periodic_error::LAW,
];

/// Causes that act about reversals only.
pub const ABOUT_REVERSALS: [Cause; 4] =
    [Cause::StribeckFriction, Cause::PreslidingFriction, Cause::Backlash, Cause::DriveCompliance];

/// The law of a cause.
#[must_use]
pub fn law(cause: Cause) -> &'static Law {
    LAWS.iter().find(|law| law.cause == cause).copied().unwrap_or(&inertia_mismatch::LAW)
}

/// The traces one by one, where nothing is gained by making them together; several at a time where cores have nothing to do.
fn each(shapes: &[Vec<f64>], term: impl Fn(&[f64]) -> Term + Sync) -> Vec<Term> {
    shapes.par_iter().map(|shape| term(shape)).collect()
}

/// The start of a law without non-linear parameters.
fn one_start(_: &Frame, _: &Rest) -> Vec<Vec<f64>> {
    vec![Vec::new()]
}

/// `count` values from low to high, equal ratios.
fn log_spaced(low: f64, high: f64, count: usize) -> impl Iterator<Item = f64> + Clone {
    let ratio = (high / low).powf(1.0 / (count.max(2) - 1) as f64);
    (0..count).map(move |i| low * ratio.powi(i as i32))
}

/// A number for a sentence: three digits.
fn say(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let decimals = (2 - value.abs().log10().floor() as i32).clamp(0, 7) as usize;
    format!("{value:.decimals$}")
}

/// `N·m` or `N`.
fn unit(axis: &Axis) -> &'static str {
    if axis.drive.is_linear() { "N" } else { "N·m" }
}

/// `mm` or `°`.
fn load(axis: &Axis) -> &'static str {
    if axis.drive.is_rotary() { "°" } else { "mm" }
}

/// `µm` or thousandths of a degree.
fn micro(axis: &Axis) -> &'static str {
    if axis.drive.is_rotary() { "thousandths of a degree" } else { "µm" }
}
