//! Reads a machine file and says what is wrong with it: the JSON path, the value found, what is allowed, what to do.

use super::cause::{CAUSES, Cause, Effect};
use super::{Axis, Belief, Drive, Machine, Servo, VelocityEstimate};
use serde_json::{Map, Value};
use std::fmt;
use std::path::Path;

/// Why a machine file cannot be used, in a sentence for people.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Error {
    /// JSON path of the value at fault, such as `axes[0].servo.period_s`; empty for the file as a whole.
    pub path: String,
    /// What is wrong, what is allowed and what to do.
    pub message: String,
}

impl Error {
    fn at(path: impl Into<String>, message: impl Into<String>) -> Error {
        Error { path: path.into(), message: message.into() }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.path.is_empty() { f.write_str(&self.message) } else { write!(f, "{}: {}", self.path, self.message) }
    }
}

impl std::error::Error for Error {}

const SCHEMA: &str = "gib.machine/1";
/// Largest magnitude a value may have: beyond it a unit was mistaken.
const HUGE: f64 = 1e9;
/// Smallest positive value where zero is not allowed.
const TINY: f64 = 1e-12;

impl Machine {
    /// Reads a machine file.
    ///
    /// # Errors
    /// The file cannot be read, is not JSON, or says something that is not allowed; the text names file, path and remedy.
    pub fn load(file: &Path) -> Result<Machine, Error> {
        let name = file.display();
        let text = std::fs::read_to_string(file)
            .map_err(|e| Error::at("", format!("{name}: cannot read the machine file: {e}")))?;
        Machine::parse(&text).map_err(|e| Error { message: format!("{e} (in {name})"), path: String::new() })
    }

    /// Reads a machine file's text.
    ///
    /// # Errors
    /// The text is not JSON (with line and column), or says something that is not allowed (with the JSON path).
    pub fn parse(text: &str) -> Result<Machine, Error> {
        let value = super::json::parse(text).map_err(|e| {
            let what = if e.is_data() { "" } else { "not JSON: " };
            Error::at("", format!("{what}{e}"))
        })?;
        let mut ignored_keys = Vec::new();
        let mut root = Object::new(&value, String::new(), &mut ignored_keys)?;
        match root.text("schema")? {
            Some(SCHEMA) => {}
            Some(other) => {
                return Err(Error::at("schema", format!("\"{other}\" is not known; this gib reads \"{SCHEMA}\"")));
            }
            None => {
                return Err(Error::at(
                    "schema",
                    format!("is missing; a machine file begins with \"schema\": \"{SCHEMA}\""),
                ));
            }
        }
        let name = root.text("name")?.unwrap_or("").to_owned();
        let axes = root.list("axes")?.ok_or_else(|| Error::at("axes", "is missing; list at least one axis"))?;
        root.finish();
        if axes.is_empty() {
            return Err(Error::at("axes", "is empty; list at least one axis"));
        }
        let mut read: Vec<Axis> = Vec::with_capacity(axes.len());
        for (i, axis) in axes.iter().enumerate() {
            let path = format!("axes[{i}]");
            let axis = read_axis(Object::new(axis, path.clone(), &mut ignored_keys)?)?;
            if read.iter().any(|other| other.name == axis.name) {
                return Err(Error::at(format!("{path}.name"), format!("axis \"{}\" is there twice", axis.name)));
            }
            read.push(axis);
        }
        Ok(Machine { name, axes: read, ignored_keys })
    }
}

fn read_axis(mut object: Object<'_, '_>) -> Result<Axis, Error> {
    let path = object.path.clone();
    let name = object.text("name")?.unwrap_or("").to_owned();
    if !(name.len() == 1 && name.bytes().all(|b| b.is_ascii_lowercase())) {
        return Err(Error::at(
            format!("{path}.name"),
            format!("\"{name}\" is not an axis letter; write one of a to z"),
        ));
    }
    let drive = match object.text("drive")? {
        Some("ball_screw") => Drive::BallScrew { lead_mm: object.required("lead_mm", TINY, HUGE)? },
        Some("linear") => Drive::Linear,
        Some("rotary") => Drive::Rotary { ratio: object.number("ratio", TINY, HUGE)?.unwrap_or(1.0) },
        found => {
            let found = found.map_or("is missing".to_owned(), |f| format!("\"{f}\" is not known"));
            return Err(Error::at(format!("{path}.drive"), format!("{found}; write ball_screw, linear or rotary")));
        }
    };
    let linear = drive.is_linear();
    let key = |rotating, linear_key| if linear { linear_key } else { rotating };
    let base = Belief {
        inertia: object.required(key("inertia_kg_m2", "mass_kg"), TINY, HUGE)?,
        coulomb: object.number(key("coulomb_friction_nm", "coulomb_friction_n"), 0.0, HUGE)?.unwrap_or(0.0),
        viscous: object.number(key("viscous_friction_nm_s", "viscous_friction_n_s_m"), 0.0, HUGE)?.unwrap_or(0.0),
        constant: object.number(key("constant_torque_nm", "constant_force_n"), -HUGE, HUGE)?.unwrap_or(0.0),
        torque_limit: object.number(key("torque_limit_nm", "force_limit_n"), TINY, HUGE)?.unwrap_or(f64::INFINITY),
    };
    let motor_pole_pairs = object.number("motor_pole_pairs", 1.0, 1000.0)?;
    if motor_pole_pairs.is_some_and(|n| n.fract() != 0.0) {
        return Err(Error::at(format!("{path}.motor_pole_pairs"), "must be a whole number, 1 or more"));
    }
    let servo = match object.object("servo")? {
        Some(servo) => Some(read_servo(servo, linear)?),
        None => None,
    };
    let effects = match object.list("effects")? {
        Some(effects) => read_effects(effects, &format!("{path}.effects"), linear, object.ignored)?,
        None => Vec::new(),
    };
    object.finish();
    let axis = Axis { name, drive, motor_pole_pairs: motor_pole_pairs.map(|n| n as u32), base, servo, effects };
    axis.two_masses().map_err(|message| Error::at(format!("{path}.effects"), message))?;
    dip(&axis, &path)?;
    Ok(axis)
}

/// Share of a dip by which it may go beyond the friction that it is taken from: as much as a measurement may be off.
const MEASURED: f64 = 0.1;

/// A dip of friction at low speed takes away what there is, and no more: friction does not drive.
fn dip(axis: &Axis, path: &str) -> Result<(), Error> {
    let coulomb = axis.belief().coulomb;
    for (i, effect) in axis.effects.iter().enumerate() {
        let Effect::StribeckFriction { torque, .. } = *effect else { continue };
        if coulomb + torque < MEASURED * torque {
            let linear = axis.drive.is_linear();
            let key = effect.cause().row().parameters.first().map_or("", |parameter| parameter.key_for(linear));
            let message = format!(
                "{} takes more than the Coulomb friction of {} away, so that friction would drive the axis; write {} or more",
                shown(torque),
                shown(coulomb),
                shown(-coulomb)
            );
            return Err(Error::at(format!("{path}.effects[{i}].parameters.{key}"), message));
        }
    }
    Ok(())
}

fn read_servo(mut object: Object<'_, '_>, linear: bool) -> Result<Servo, Error> {
    let path = object.path.clone();
    let velocity_gain = if linear { "velocity_gain_n_s_m" } else { "velocity_gain_nm_s" };
    let servo = Servo {
        period_s: object.required("period_s", 1e-6, 1.0)?,
        position_gain_1_s: object.required("position_gain_1_s", 0.0, HUGE)?,
        velocity_gain: object.required(velocity_gain, 0.0, HUGE)?,
        velocity_integral_time_s: object.number("velocity_integral_time_s", TINY, HUGE)?,
        velocity_feedforward: object.number("velocity_feedforward", -10.0, 10.0)?.unwrap_or(0.0),
        torque_time_constant_s: object.number("torque_time_constant_s", 0.0, 10.0)?.unwrap_or(0.0),
        velocity_estimate: match object.text("velocity_estimate")? {
            None | Some("backward_difference") => VelocityEstimate::BackwardDifference,
            Some("two_sample_mean") => VelocityEstimate::TwoSampleMean,
            Some(other) => {
                let message = format!("\"{other}\" is not known; write backward_difference or two_sample_mean");
                return Err(Error::at(format!("{path}.velocity_estimate"), message));
            }
        },
    };
    object.finish();
    Ok(servo)
}

fn read_effects(list: &[Value], path: &str, linear: bool, ignored: &mut Vec<String>) -> Result<Vec<Effect>, Error> {
    let mut effects: Vec<Effect> = Vec::with_capacity(list.len());
    for (i, value) in list.iter().enumerate() {
        let path = format!("{path}[{i}]");
        let mut object = Object::new(value, path.clone(), ignored)?;
        let name = object.text("cause")?.unwrap_or("");
        let cause = Cause::from_name(name).ok_or_else(|| {
            let known: Vec<_> = CAUSES.iter().map(|row| row.name).collect();
            let found = if name.is_empty() { "is missing".into() } else { format!("\"{name}\" is not known") };
            Error::at(format!("{path}.cause"), format!("{found}; write one of {}", known.join(", ")))
        })?;
        if !cause.row().repeatable && effects.iter().any(|e| e.cause() == cause) {
            return Err(Error::at(path, format!("{cause} is there twice; keep one of them")));
        }
        let Some(parameters) = object.object("parameters")? else {
            return Err(Error::at(format!("{path}.parameters"), "is missing"));
        };
        effects.push(read_effect(cause, parameters, linear)?);
        object.finish();
    }
    Ok(effects)
}

fn read_effect(cause: Cause, mut object: Object<'_, '_>, linear: bool) -> Result<Effect, Error> {
    let mut values = Vec::new();
    for parameter in cause.row().parameters {
        let key = parameter.key_for(linear);
        let value = match object.number(key, parameter.low, parameter.high)? {
            None if linear && !parameter.linear_alias.is_empty() => {
                object.number(parameter.linear_alias, parameter.low, parameter.high)?
            }
            found => found,
        };
        match value.or(parameter.default) {
            Some(value) => values.push(value),
            None => return Err(object.missing(key, parameter.low, parameter.high)),
        }
    }
    let path = object.path.clone();
    object.finish();
    // The loop gave one value a parameter, so that this holds; an error is still kinder than a panic.
    Effect::from_values(cause, &values).ok_or_else(|| Error::at(path, "a parameter is missing"))
}

/// One JSON object while it is read: takes keys by type and range, and knows which were never taken.
struct Object<'v, 'i> {
    map: &'v Map<String, Value>,
    path: String,
    taken: Vec<&'static str>,
    ignored: &'i mut Vec<String>,
}

impl<'v, 'i> Object<'v, 'i> {
    fn new(value: &'v Value, path: String, ignored: &'i mut Vec<String>) -> Result<Object<'v, 'i>, Error> {
        match value {
            Value::Object(map) => Ok(Object { map, path, taken: Vec::new(), ignored }),
            other => Err(Error::at(path, format!("must be an object {{…}}, found {}", kind(other)))),
        }
    }

    fn path_of(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }

    /// The value of a key; `null` counts as left out.
    fn take(&mut self, key: &'static str) -> Option<&'v Value> {
        self.taken.push(key);
        self.map.get(key).filter(|value| !value.is_null())
    }

    fn wrong(&self, key: &str, found: &Value, wanted: &str) -> Error {
        Error::at(self.path_of(key), format!("must be {wanted}, found {}", kind(found)))
    }

    fn text(&mut self, key: &'static str) -> Result<Option<&'v str>, Error> {
        match self.take(key) {
            None => Ok(None),
            Some(Value::String(text)) => Ok(Some(text)),
            Some(other) => Err(self.wrong(key, other, "a text in quotes")),
        }
    }

    fn list(&mut self, key: &'static str) -> Result<Option<&'v [Value]>, Error> {
        match self.take(key) {
            None => Ok(None),
            Some(Value::Array(list)) => Ok(Some(list)),
            Some(other) => Err(self.wrong(key, other, "a list […]")),
        }
    }

    fn object(&mut self, key: &'static str) -> Result<Option<Object<'v, '_>>, Error> {
        let path = self.path_of(key);
        match self.take(key) {
            None => Ok(None),
            Some(value) => Object::new(value, path, self.ignored).map(Some),
        }
    }

    fn number(&mut self, key: &'static str, low: f64, high: f64) -> Result<Option<f64>, Error> {
        let Some(value) = self.take(key) else { return Ok(None) };
        let number = value.as_f64().ok_or_else(|| self.wrong(key, value, "a number"))?;
        if number >= low && number <= high {
            return Ok(Some(number));
        }
        Err(Error::at(self.path_of(key), format!("{} is out of range; {}", shown(number), allowed(low, high))))
    }

    fn required(&mut self, key: &'static str, low: f64, high: f64) -> Result<f64, Error> {
        self.number(key, low, high)?.ok_or_else(|| self.missing(key, low, high))
    }

    fn missing(&self, key: &str, low: f64, high: f64) -> Error {
        Error::at(self.path_of(key), format!("is missing; {}", allowed(low, high)))
    }

    /// Notes the keys nobody took.
    fn finish(self) {
        for key in self.map.keys().filter(|key| !self.taken.contains(&key.as_str())) {
            self.ignored.push(self.path_of(key));
        }
    }
}

fn allowed(low: f64, high: f64) -> String {
    match low {
        TINY => format!("write a number above 0, at most {}", shown(high)),
        0.0 => format!("write a number of 0 or more, at most {}", shown(high)),
        _ => format!("write a number from {} to {}", shown(low), shown(high)),
    }
}

/// A number of any size in a few digits.
fn shown(number: f64) -> String {
    if number == 0.0 || (1e-7..1e9).contains(&number.abs()) { number.to_string() } else { format!("{number:e}") }
}

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "true or false",
        Value::Number(_) => "a number",
        Value::String(_) => "a text",
        Value::Array(_) => "a list",
        Value::Object(_) => "an object",
    }
}
