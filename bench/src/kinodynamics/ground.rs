//! What each surface does to the curvature: how much of a commanded one is driven, slowly and fast.

use kinodynamics::{Example, Recording};
use serde::Serialize;

/// Commanded curvatures that are looked at, from gentle to what the turns ask for [1/m].
const CURVATURES_PER_M: [f32; 2] = [0.3, 1.0];
/// Slow and fast commands [m/s].
const SPEEDS_MPS: [[f32; 2]; 2] = [[1.2, 1.8], [2.0, 2.6]];

/// One surface.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GroundReport {
    /// Name.
    pub name: String,
    /// Commands given on it.
    pub n: usize,
    /// Driven over commanded curvature from 1.2 to 1.8 m/s and from 2.0 to 2.6 m/s, at 0.3 to 1.0 1/m: the line through zero
    /// of least squares; none without examples [-].
    pub driven_over_commanded: [Option<f64>; 2],
}

/// All surfaces of a recording, of examples that no filter took any away of.
pub(super) fn grounds(recording: &Recording, examples: &[Example]) -> Vec<GroundReport> {
    let report = |(index, name): (usize, &String)| {
        let on_it = || examples.iter().filter(|example| example.ground == Some(index as u32));
        let ratio = |[low, high]: [f32; 2]| {
            let (mut product, mut square) = (0.0, 0.0);
            let asked = on_it().filter(|example| {
                let [curvature, speed] = example.commanded;
                (CURVATURES_PER_M[0]..CURVATURES_PER_M[1]).contains(&curvature.abs())
                    && (low..high).contains(&speed)
            });
            for example in asked {
                product += f64::from(example.driven[1] * example.commanded[0]);
                square += f64::from(example.commanded[0] * example.commanded[0]);
            }
            (square > 0.0).then(|| product / square)
        };
        GroundReport { name: name.clone(), n: on_it().count(), driven_over_commanded: SPEEDS_MPS.map(ratio) }
    };
    recording.grounds.iter().enumerate().map(report).collect()
}
