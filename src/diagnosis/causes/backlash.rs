//! Dead zone between motor and table. While the motor crosses it after a reversal it carries neither the table's inertia
//! nor its friction; then the flanks meet. In table − encoder it is a step of the full width at every reversal.

use super::table_side::{self, Shares};
use super::*;

/// Parameters: full width in µm, shares of inertia and friction on the table's side. The trace has no coefficient.
pub static LAW: Law = Law {
    cause: Cause::Backlash,
    scales: &[Scale::Log(0.1, 2000.0), Scale::Linear(0.05, 0.9, 0.02), Scale::Linear(0.02, 0.98, 0.02)],
    starts: |frame, _| {
        let least = (3.0 * frame.grid).max(1e-3) * 1e3;
        let widths = log_spaced(least, (10.0 * least).max(300.0), 10);
        widths.flat_map(|w| [vec![w, 0.45, 0.5], vec![w, 0.45, 0.8]]).collect()
    },
    starts_from_rest: false,
    term: |frame, shape| {
        let effect =
            Effect::Backlash { width_um: shape[0], table_inertia_share: shape[1], table_friction_share: shape[2] };
        table_side::term(frame, effect, Shares { width: true })
    },
    effect: |_, shape, _| {
        let [width_um, table_inertia_share, table_friction_share] = shape.try_into().ok()?;
        Some(Effect::Backlash { width_um, table_inertia_share, table_friction_share })
    },
    confused_with: &[Cause::PreslidingFriction, Cause::DriveCompliance],
    sentence: |effect, axis| match effect {
        Effect::Backlash { width_um, .. } => format!(
            "At each reversal the motor turns through {} {} of clearance before the table follows: nut, coupling or gearing has play.",
            say(*width_um),
            micro(axis)
        ),
        _ => String::new(),
    },
};
