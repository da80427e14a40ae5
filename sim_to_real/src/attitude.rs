//! What roll and pitch tell of the forces on a body.
//!
//! A sprung body leans against its tyres: nose up by as much as they push it along, outwards by as much as they push it
//! across. Nominal drives over known ground tell by how much, per acceleration of the body and per slope of the ground.
//! What else pushes a body has to be balanced by the tyres, and so it leans without an acceleration: here a drag or a wind
//! shows that the speed alone hardly tells from a scale of the speed. A body without springs says nothing, and neither does
//! one whose ground is not known.

mod axis;
mod block;
mod evidence;

pub(crate) use block::{Block, Rows, blocks};
pub(crate) use evidence::AttitudeEvidence;

use crate::drive::Drive;
use axis::Axis;
use block::{PITCH, ROLL};
use evidence::Gram;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// Standard gravity [m/s2].
const GRAVITY_MPS2: f64 = 9.80665;
/// Drives of fewer seconds do not count.
const LEAST_BLOCKS: usize = 6;

/// How the body of a machine stands on its springs, by its nominal drives.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct AttitudeModel {
    /// Pitch (nose down), roll (left side up).
    axes: [Axis; 2],
}

impl AttitudeModel {
    /// `None` where fewer than two drives tell the attitude over known ground.
    pub(crate) fn of(drives: &[&Drive]) -> Option<Self> {
        let told = told(drives);
        (told.len() > 1).then(|| Self { axes: [PITCH, ROLL].map(|axis| Axis::of(&told, axis)) })
    }

    /// What other drives say of forces.
    pub(crate) fn evidence(&self, drives: &[&Drive]) -> AttitudeEvidence {
        AttitudeEvidence::of(told(drives).into_iter().map(|blocks| self.gram(blocks)).collect())
    }

    /// Products of the columns of [`Self::columns`] on one drive, its errors made independent and 1.
    fn gram(&self, blocks: &[Block]) -> Gram {
        let columns: Vec<_> = blocks.iter().map(|own| self.columns(own)).collect();
        let of_axis = |axis: usize| {
            let own = DMatrix::from_fn(blocks.len(), evidence::N_COLUMNS, |row, k| columns[row][k][axis]);
            let products = own.transpose() * self.axes[axis].weighed(blocks, axis, &own);
            Gram::from_iterator(products.iter().copied())
        };
        of_axis(PITCH) + of_axis(ROLL)
    }

    /// Pitch and roll that are left of a second, an offset of each, and what a unit of each of [`evidence::CAUSES`] adds.
    fn columns(&self, own: &Block) -> [[f64; 2]; evidence::N_COLUMNS] {
        let [of_ground, of_acceleration] = [1, 2].map(|k| self.axes.map(|axis| axis.coefficients[k]));
        let left = [PITCH, ROLL].map(|axis| self.axes[axis].left(own, axis));
        let pushed = |ahead: f64, left: f64| [-of_acceleration[PITCH] * ahead, -of_acceleration[ROLL] * left];
        let [cosine, sine] = own.heading;
        let [pitch, roll] = own.ground;
        let [ahead, across] = own.acceleration_mps2;
        [
            left,
            [1.0, 0.0],
            [0.0, 1.0],
            pushed(-own.direction, 0.0),
            pushed(-own.speed_squared_m2ps2, 0.0),
            pushed(-own.in_vegetation, 0.0),
            pushed(cosine, -sine),
            pushed(sine, cosine),
            pushed(0.0, -GRAVITY_MPS2 * roll),
            // The same springs carry more.
            pushed(GRAVITY_MPS2 * pitch - ahead, -GRAVITY_MPS2 * roll - across),
            // The body was foretold from an acceleration, or on a slope, that was none.
            pushed(ahead, across),
            pushed(0.0, own.speed_mps),
            [of_ground[PITCH] * roll, -of_ground[ROLL] * pitch],
        ]
    }
}

/// What drives tell that do so for long enough.
fn told<'a>(drives: &[&'a Drive]) -> Vec<&'a [Block]> {
    let all = drives.iter().map(|drive| &drive.attitude[..]);
    all.filter(|blocks| blocks.len() >= LEAST_BLOCKS).collect()
}

#[cfg(test)]
pub(crate) mod tests;
