//! Column names: `<channel>.<signal>_<unit>`, for example `x.position_mm`. The unit is part of the name, so a recording in
//! radians or newtons needs no conversion by hand.

/// What a column measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Signal {
    /// What the interpolator asked for.
    PositionCommand,
    /// Motor encoder, in load units.
    Position,
    /// Load-side scale.
    TablePosition,
    /// What the drive says the motor delivers (current × constant), rotary motor.
    Torque,
    /// The same for a linear motor.
    Force,
    /// Spindle speed.
    Speed,
    /// Torque asked of the spindle drive.
    TorqueCommand,
    /// Motor current.
    Current,
    /// Spindle load.
    Load,
    /// Spindle encoder.
    Angle,
    /// Accelerometer.
    Accel,
    /// Temperature of whatever the channel is.
    Temperature,
}

/// A unit a column name may end in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs)] // the names are the units
pub enum Unit {
    Mm,
    Um,
    M,
    Deg,
    Rad,
    Nm,
    N,
    Rpm,
    RadS,
    A,
    Percent,
    MS2,
    G,
    C,
}

const POSITION_UNITS: &[Unit] = &[Unit::Mm, Unit::Um, Unit::M, Unit::Deg, Unit::Rad];

impl Signal {
    /// Every signal of the format.
    pub const ALL: [Signal; 12] = [
        Signal::PositionCommand,
        Signal::Position,
        Signal::TablePosition,
        Signal::Torque,
        Signal::Force,
        Signal::Speed,
        Signal::TorqueCommand,
        Signal::Current,
        Signal::Load,
        Signal::Angle,
        Signal::Accel,
        Signal::Temperature,
    ];

    /// The name as it stands in a header.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Signal::PositionCommand => "position_command",
            Signal::Position => "position",
            Signal::TablePosition => "table_position",
            Signal::Torque => "torque",
            Signal::Force => "force",
            Signal::Speed => "speed",
            Signal::TorqueCommand => "torque_command",
            Signal::Current => "current",
            Signal::Load => "load",
            Signal::Angle => "angle",
            Signal::Accel => "accel",
            Signal::Temperature => "temperature",
        }
    }

    /// The units the signal may come in.
    #[must_use]
    pub const fn units(self) -> &'static [Unit] {
        match self {
            Signal::PositionCommand | Signal::Position | Signal::TablePosition => POSITION_UNITS,
            Signal::Torque | Signal::TorqueCommand => &[Unit::Nm],
            Signal::Force => &[Unit::N],
            Signal::Speed => &[Unit::Rpm, Unit::RadS],
            Signal::Current => &[Unit::A],
            Signal::Load => &[Unit::Percent],
            Signal::Angle => &[Unit::Deg, Unit::Rad],
            Signal::Accel => &[Unit::MS2, Unit::G],
            Signal::Temperature => &[Unit::C],
        }
    }

    /// True for encoders and scales: they show a mass, which cannot jump.
    #[must_use]
    pub const fn is_measured_position(self) -> bool {
        matches!(self, Signal::Position | Signal::TablePosition | Signal::Angle)
    }
}

impl Unit {
    /// Every unit of the format.
    pub const ALL: [Unit; 14] = [
        Unit::Mm,
        Unit::Um,
        Unit::M,
        Unit::Deg,
        Unit::Rad,
        Unit::Nm,
        Unit::N,
        Unit::Rpm,
        Unit::RadS,
        Unit::A,
        Unit::Percent,
        Unit::MS2,
        Unit::G,
        Unit::C,
    ];

    /// The suffix as it stands in a header.
    #[must_use]
    pub const fn suffix(self) -> &'static str {
        match self {
            Unit::Mm => "mm",
            Unit::Um => "um",
            Unit::M => "m",
            Unit::Deg => "deg",
            Unit::Rad => "rad",
            Unit::Nm => "nm",
            Unit::N => "n",
            Unit::Rpm => "rpm",
            Unit::RadS => "rad_s",
            Unit::A => "a",
            Unit::Percent => "percent",
            Unit::MS2 => "m_s2",
            Unit::G => "g",
            Unit::C => "c",
        }
    }

    /// The unit as people write it.
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        match self {
            Unit::Mm => "mm",
            Unit::Um => "µm",
            Unit::M => "m",
            Unit::Deg => "°",
            Unit::Rad => "rad",
            Unit::Nm => "N·m",
            Unit::N => "N",
            Unit::Rpm => "rpm",
            Unit::RadS => "rad/s",
            Unit::A => "A",
            Unit::Percent => "%",
            Unit::MS2 => "m/s²",
            Unit::G => "g",
            Unit::C => "°C",
        }
    }

    /// The unit gib computes this quantity in: mm, deg, N·m, N, rpm, A, %, m/s², °C. Lengths and angles stay apart.
    #[must_use]
    pub const fn house(self) -> Unit {
        match self {
            Unit::Mm | Unit::Um | Unit::M => Unit::Mm,
            Unit::Deg | Unit::Rad => Unit::Deg,
            Unit::Rpm | Unit::RadS => Unit::Rpm,
            Unit::MS2 | Unit::G => Unit::MS2,
            other => other,
        }
    }

    /// How many of [`Unit::house`] one of this unit is.
    #[must_use]
    pub const fn in_house(self) -> f64 {
        match self {
            Unit::Um => 1e-3,
            Unit::M => 1e3,
            Unit::Rad => 180.0 / std::f64::consts::PI,
            Unit::RadS => 60.0 / std::f64::consts::TAU,
            Unit::G => 9.806_65,
            _ => 1.0,
        }
    }

    /// The factor from this unit to `to`; `None` when they are units of different quantities.
    #[must_use]
    pub fn factor_to(self, to: Unit) -> Option<f64> {
        if self == to {
            return Some(1.0);
        }
        (self.house() == to.house()).then(|| self.in_house() / to.in_house())
    }

    /// True for degrees and radians.
    #[must_use]
    pub const fn is_angle(self) -> bool {
        matches!(self, Unit::Deg | Unit::Rad)
    }
}

/// A column name that belongs to the format, taken apart.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Label {
    /// Axis letter (`x`), `spindle`, `base`, `work`.
    pub channel: String,
    /// What is measured.
    pub signal: Signal,
    /// In which unit the values stand.
    pub unit: Unit,
}

/// How a column name reads.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Name {
    /// A column of the format.
    Known(Label),
    /// A signal of the format in a unit it cannot have.
    WrongUnit {
        /// The signal that was recognised.
        signal: Signal,
        /// What stands where its unit should; empty when nothing does.
        unit: String,
    },
    /// Anything else: kept, and ignored by the analyses.
    Unknown,
}

impl Name {
    /// Takes a header name apart.
    #[must_use]
    pub fn parse(name: &str) -> Name {
        let Some((channel, rest)) = name.split_once('.') else { return Name::Unknown };
        if channel.is_empty() {
            return Name::Unknown;
        }
        // The longest signal name wins, so that torque_command_nm is not read as torque in "command_nm".
        let found = Signal::ALL.into_iter().filter_map(|signal| {
            let unit = rest.strip_prefix(signal.name())?;
            if unit.is_empty() { Some((signal, "")) } else { unit.strip_prefix('_').map(|unit| (signal, unit)) }
        });
        let Some((signal, suffix)) = found.max_by_key(|(signal, _)| signal.name().len()) else { return Name::Unknown };
        match signal.units().iter().copied().find(|unit| unit.suffix() == suffix) {
            Some(unit) => Name::Known(Label { channel: channel.to_owned(), signal, unit }),
            // `x.position_error_mm` is a column of its own, not a position in "error_mm".
            None if Unit::ALL.iter().any(|u| suffix.len() > u.suffix().len() && ends_in_unit(suffix, *u)) => {
                Name::Unknown
            }
            None => Name::WrongUnit { signal, unit: suffix.to_owned() },
        }
    }
}

fn ends_in_unit(text: &str, unit: Unit) -> bool {
    text.strip_suffix(unit.suffix()).is_some_and(|head| head.ends_with('_'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_signal_reads_back_in_every_unit_it_may_have() {
        for signal in Signal::ALL {
            for &unit in signal.units() {
                let name = format!("x.{}_{}", signal.name(), unit.suffix());
                assert_eq!(Name::parse(&name), Name::Known(Label { channel: "x".into(), signal, unit }), "{name}");
            }
        }
    }

    #[test]
    fn a_wrong_unit_is_told_from_a_foreign_column() {
        assert!(matches!(Name::parse("x.position_inch"), Name::WrongUnit { signal: Signal::Position, .. }));
        assert!(matches!(Name::parse("x.torque_n"), Name::WrongUnit { signal: Signal::Torque, .. }));
        assert!(matches!(Name::parse("x.position"), Name::WrongUnit { signal: Signal::Position, .. }));
        assert_eq!(Name::parse("x.position_error_mm"), Name::Unknown);
        assert_eq!(Name::parse("x.predicted_torque_nm"), Name::Unknown);
        assert_eq!(Name::parse("note"), Name::Unknown);
        assert_eq!(Name::parse(".position_mm"), Name::Unknown);
    }

    #[test]
    fn conversions_go_there_and_back_and_never_across_quantities() {
        for a in Unit::ALL {
            for b in Unit::ALL {
                match (a.factor_to(b), b.factor_to(a)) {
                    (Some(ab), Some(ba)) => assert!((ab * ba - 1.0).abs() < 1e-12),
                    (None, None) => assert_ne!(a.house(), b.house()),
                    other => panic!("{a:?} {b:?} {other:?}"),
                }
            }
        }
        assert_eq!(Unit::M.factor_to(Unit::Um), Some(1e6));
        assert!((Unit::Rad.factor_to(Unit::Deg).unwrap() - 57.295_779_513).abs() < 1e-9);
        assert_eq!(Unit::Mm.factor_to(Unit::Deg), None);
    }
}
