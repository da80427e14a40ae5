//! What a diagnosis without nominal drives could not show, in sentences.

use super::selection::Selection;
use crate::drive::Drive;
use bicycle::effect::CATALOGUE;

/// Contradictions between sensors, or between them and any motion: no machine in order shows them.
const OF_SENSORS: [&str; 4] = ["pose_latency", "odom_scale", "gyro_bias", "yaw_misalign"];

/// More effects than this that do the work of one are counted and not named.
const MOST_NAMED: usize = 4;

pub(crate) fn notes(drives: &[&Drive], selection: &Selection, errors: [f64; 2]) -> Vec<String> {
    let ids = selection.explanation.ids();
    let (of_sensors, of_machine): (Vec<&str>, Vec<&str>) = ids.iter().partition(|id| OF_SENSORS.contains(id));
    let mut notes = vec![
        "no nominal drives: the simulator is the kinematic bicycle, of which the wheelbase alone is known"
            .to_owned(),
    ];
    if !of_machine.is_empty() {
        notes.push(format!(
            "whether {} {} a fault or the machine's ordinary physics, only drives of one in order can tell; the \
             repaired model holds either way",
            of_machine.join(", "),
            if of_machine.len() == 1 { "is" } else { "are" }
        ));
    }
    if !of_sensors.is_empty() {
        notes.push(format!(
            "{}: the sensors contradict one another, whatever the machine does",
            of_sensors.join(", ")
        ));
    }
    for (id, others) in selection.alternatives.iter().filter(|(_, others)| !others.is_empty()) {
        notes.push(match others.len() {
            ..=MOST_NAMED => {
                format!("{id} cannot be told from {}: either explains these drives", others.join(", "))
            }
            n => format!("{id} brings little that {n} other effects would not bring as well"),
        });
    }
    notes.push(format!(
        "{:.0} % of the error is left; whether that is noise, ordinary or unknown cannot be told without nominal \
         drives",
        100.0 * errors[1] / errors[0]
    ));
    notes.extend(of_evidence(drives));
    notes
}

/// What is missing in the drives, each sentence once, and which effects that leaves unjudged.
pub(crate) fn of_evidence(drives: &[&Drive]) -> Vec<String> {
    let mut notes: Vec<String> = Vec::new();
    for note in drives.iter().flat_map(|drive| drive.evidence.notes()) {
        if notes.iter().all(|known| known != note) {
            notes.push(note.to_owned());
        }
    }
    let is_judged = |id: &str| drives.iter().all(|drive| drive.evidence.judges(id));
    let unjudged: Vec<&str> =
        CATALOGUE.iter().map(|description| description.id).filter(|id| !is_judged(id)).collect();
    if !unjudged.is_empty() {
        notes.push(format!("not judged: {}", unjudged.join(", ")));
    }
    notes
}
