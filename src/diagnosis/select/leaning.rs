//! A load that joins a set with a clearance may lean its table on one flank for good: with more friction on the table than the numbers say
//! that were found without the load, it would still cross. So the table is looked for anew where the load as it joins spoils it.

use super::*;

/// Squares over those with the table as it was, from which on it is spoilt.
const SPOILT: f64 = 2.0;

/// A set whose last cause has joined beside a table as it was, with the one of the table's valleys that leaves least under all of its
/// causes where the table as it was is spoilt by them.
#[must_use]
pub fn table_anew(bench: &Bench, fit: Fit) -> Fit {
    let Some(at) = fit.table() else { return fit };
    let there = bench.at_one(fit.clone());
    if there.squares() <= SPOILT * fit.squares() {
        return there;
    }
    let table = &fit.parts[at];
    let (shapes, resistance) = ((table.law.manner.valleys)(&table.shape), bench.resistance_of(&fit));
    let with = |own: Part| {
        let parts = fit.parts.iter().enumerate().map(|(i, part)| if i == at { own.clone() } else { part.clone() });
        bench.fit(parts.collect())
    };
    let tables = bench.parts_under(table.law, shapes, &resistance).into_iter().map(with);
    tables.chain([there]).min_by(|a, b| a.squares().total_cmp(&b.squares())).unwrap_or(fit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::by_loop::tests::{clearance, rig};
    use crate::diagnosis::causes::law;
    use crate::diagnosis::excerpt::Excerpt;
    use crate::diagnosis::frame::Frame;
    use crate::diagnosis::known::Known;
    use crate::machine::Effect;
    use crate::plant::moves::{Moves, Reach};
    use crate::plant::simulate::{Sensors, Setup, simulate};
    use crate::recording::{Column, Recording};

    #[test]
    fn a_load_joins_a_clearance_whose_table_was_found_without_it() {
        let reach = Reach { start: 20.0, stroke: 200.0, speed: 250.0, acceleration: 2500.0 };
        let mut command = Moves::built_in("test", &reach).unwrap().command(1e-3);
        command.truncate(20_000);
        let sensors = Sensors { grid_um: 0.1, torque_noise: 0.03, ..Sensors::default() };
        let truth = rig().with_effects(vec![clearance(20.0), Effect::ConstantTorque { torque: 0.4 }]);
        let trace = simulate(&truth, &command, &Setup { seed: 1, sensors, ..Setup::default() }).unwrap();
        let columns = vec![
            Column::new("x.position_command_mm", trace.command),
            Column::new("x.position_mm", trace.position),
            Column::new("x.table_position_mm", trace.table_position),
            Column::new("x.torque_nm", trace.torque),
        ];
        let excerpt = Excerpt::of(&Recording::from_columns("simulated", trace.time_s, columns).unwrap(), &rig());
        let (columns, axis) = (excerpt.columns.as_ref().unwrap().clone().thinned(), rig());
        let frame = Frame::new(&axis, &columns, None);
        let bench = Bench::new(&frame, &Known::of(&axis, &frame));
        // With a fifth of the friction on the table the load leans it on one flank for good.
        let alone = bench.fit(bench.parts(law(Cause::Backlash), vec![vec![20.3, 0.24, 0.22, 1300.0]]));
        let load = bench.parts(law(Cause::ConstantTorque), vec![vec![]]).swap_remove(0);
        let fit = refined(&bench, &alone, load, alone.squares());
        let found = fit.coefficients[1][0];
        assert!((found - 0.4).abs() < 0.02, "{found}");
        assert!(fit.squares() < 0.05 * alone.squares(), "{} of {}", fit.squares(), alone.squares());
    }
}
