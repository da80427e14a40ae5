//! Loose ground that a wheel has gone over: it is firmer for the wheels that follow.
//!
//! The multi-pass effect: front wheels shear and compact what rear wheels then stand on, so that on loose ground the front
//! axle slips more than the rear one and the vehicle understeers. Where wheels follow in a rut of their own making, as the
//! same wheel on its next step, nothing changes.

use nalgebra::Vector3;

use super::ground::Ground;
use super::wheel::Wheel;

/// Shear deformation modulus of loose over that of compacted ground: sand has 25 mm loose and 10 mm firm (Wong, Theory of
/// Ground Vehicles, section 2.5) [-].
const FIRMER: f64 = 2.5;
/// Places across the tread at which it is asked what went there before, over the tread's width.
const PLACES: [f64; 5] = [-0.4, -0.2, 0.0, 0.2, 0.4];
/// What a cell holds that two wheels have gone over.
const COMPACTED: u8 = u8::MAX;

/// Which cells of the ground wheels have gone over.
pub(crate) struct Ruts {
    /// Zero where none has, the wheel's number from 1 where it was alone.
    cells: Vec<u8>,
    tread_m: f64,
}

impl Ruts {
    /// None where no ground gives way.
    pub(crate) fn new(ground: &Ground, tread_m: f64) -> Option<Self> {
        let [n_rows, n_cols] = ground.size();
        ground.gives_way().then(|| Self { cells: vec![0; n_rows * n_cols], tread_m })
    }

    /// Tells every wheel how firm its ground is, and presses that down.
    pub(crate) fn press(&mut self, wheels: &mut [Wheel; 4], ground: &Ground) {
        for (number, wheel) in (1..).zip(wheels) {
            if let Some(contact) = wheel.heaviest() {
                wheel.firmness = self.firmness(number, &contact.point_m, &wheel.left, ground);
            }
        }
    }

    /// How much firmer the ground is under a wheel than where nothing went. Strips side by side add up their stiffnesses.
    fn firmness(&mut self, wheel: u8, point_m: &Vector3<f64>, left: &Vector3<f64>, ground: &Ground) -> f64 {
        let mut compacted = 0.0;
        for place in PLACES {
            let at_m = point_m + left * (place * self.tread_m);
            let cell = &mut self.cells[ground.cell(at_m.x, at_m.y)];
            if *cell == 0 {
                *cell = wheel;
            } else if *cell != wheel {
                *cell = COMPACTED;
                compacted += 1.0 / PLACES.len() as f64;
            }
        }
        1.0 + compacted * (FIRMER - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use terrain::GridGeometry;

    use super::*;
    use crate::{Patch, Stribeck, World};

    fn ground(shear_deformation_m: f32) -> Ground {
        let geometry = GridGeometry { resolution_m: 0.01, origin: [0, 0], n_rows: 100, n_cols: 100 };
        let patch = Patch { shear_deformation_m, ..Patch::open(Stribeck::DIRT) };
        Ground::new(Arc::new(World::from_fn("level", geometry, |_, _| 0.0, |_, _| patch).unwrap()))
    }

    #[test]
    fn who_follows_finds_firmer_ground_and_who_goes_first_or_beside_does_not() {
        let ground = ground(0.005);
        let mut ruts = Ruts::new(&ground, 0.1).unwrap();
        let mut pass = |wheel: u8, x_m: f64| {
            ruts.firmness(wheel, &Vector3::new(x_m, 0.505, 0.0), &Vector3::x(), &ground)
        };
        assert_eq!([pass(1, 0.305), pass(1, 0.305)], [1.0; 2], "its own rut");
        assert_eq!(pass(3, 0.505), 1.0, "beside it");
        // Three of five places lie in the rut: 1 + 3 / 5 of 1.5.
        assert!((pass(3, 0.345) - 1.9).abs() < 1e-12);
        assert!((pass(3, 0.305) - 2.5).abs() < 1e-12);
        assert!((pass(1, 0.305) - 2.5).abs() < 1e-12, "both have been here");
    }

    #[test]
    fn firm_ground_remembers_nothing() {
        assert!(Ruts::new(&ground(0.0), 0.1).is_none());
    }
}
