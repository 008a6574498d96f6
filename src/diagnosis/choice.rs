//! Which axis is diagnosed.

use crate::machine::Machine;
use crate::recording::Recording;

/// Number of the wanted axis in the machine; without a wish, of the first that the recording has too.
///
/// # Errors
/// A sentence with the axes that there are.
pub fn axis_of(machine: &Machine, recording: &Recording, wanted: Option<&str>) -> Result<usize, String> {
    let channels = recording.channels();
    let is_wanted = |name: &str| wanted.map_or_else(|| channels.contains(&name), |wanted| wanted == name);
    machine.axes.iter().position(|axis| is_wanted(&axis.name)).ok_or_else(|| {
        let known: Vec<&str> = machine.axes.iter().map(|axis| axis.name.as_str()).collect();
        format!(
            "no axis to diagnose: the machine file has {}, the recording {}{}",
            known.join(", "),
            channels.join(", "),
            wanted.map_or(String::new(), |wanted| format!("; asked for is {wanted}"))
        )
    })
}
