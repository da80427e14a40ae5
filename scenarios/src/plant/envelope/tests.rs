//! The wheel's contacts against closed forms and sums.

use std::sync::Arc;

use terrain::GridGeometry;

use super::*;
use crate::{Patch, Stribeck, World};

const RADIUS_M: f64 = 0.4;

fn ground(height_m: impl Fn(f64, f64) -> f64) -> Ground {
    let geometry = GridGeometry::centred(0.1, 80, 80, 0.0, 0.0);
    let patch = |_: f64, _: f64| Patch::open(Stribeck::ROCK);
    Ground::new(Arc::new(World::from_fn("test", geometry, height_m, patch).unwrap()))
}

/// A tyre of 200 kN/m under 4 kN: 20 mm.
fn tyre() -> Envelope {
    Envelope::new(RADIUS_M, 0.2, 200_000.0, 4000.0, 0.1)
}

/// Upright, heading east.
fn upright(hub_m: Vector3<f64>) -> Disc {
    Disc::new(hub_m, Vector3::y()).unwrap()
}

/// The contact where there is one.
fn only(contacts: [Option<Contact>; CONTACTS]) -> Contact {
    let [Some(contact), None] = contacts else { panic!("{contacts:?}") };
    contact
}

#[test]
fn the_plane_answers_with_the_given_stiffness() {
    let tyre = tyre();
    assert!((tyre.deflection_m(4000.0) - 0.02).abs() < 1e-9);
    // Depth to the power 1.5 for small depths: half the load at 2^(-2/3) of the depth.
    assert!((tyre.deflection_m(2000.0) / (0.02 * 2f64.powf(-2.0 / 3.0)) - 1.0).abs() < 0.01);
    let hub_m = Vector3::new(0.013, 0.021, RADIUS_M - 0.02);
    for heading in [Vector3::y(), -Vector3::x(), Vector3::new(0.6, 0.8, 0.0)] {
        let contact = only(tyre.touch(&ground(|_, _| 0.0), &Disc::new(hub_m, heading).unwrap()));
        assert!((contact.force_n - 4000.0).abs() < 1e-6, "{contact:?}");
        assert!((contact.normal - Vector3::z()).norm() < 1e-9, "{contact:?}");
        assert!(
            (contact.loaded_radius_m - 0.38).abs() < 1e-9 && contact.point_m.z.abs() < 1e-9,
            "{contact:?}"
        );
    }
}

#[test]
fn a_slope_pushes_along_its_normal() {
    for slope_rad in [0.2f64, 0.5, 0.9] {
        let normal = Vector3::new(-slope_rad.sin(), 0.0, slope_rad.cos());
        let ground = ground(|x_m, _| x_m * slope_rad.tan());
        let contact = only(tyre().touch(&ground, &upright(normal * (RADIUS_M - 0.02))));
        assert!((contact.force_n / 4000.0 - 1.0).abs() < 1e-3, "{slope_rad}: {contact:?}");
        assert!((contact.normal - normal).norm() < 1e-3, "{slope_rad}: {contact:?}");
    }
}

#[test]
fn a_leaning_wheel_on_a_leaning_plane_is_an_upright_one_on_a_level_plane() {
    let slope_rad = 0.5f64;
    let normal = Vector3::new(0.0, -slope_rad.sin(), slope_rad.cos());
    let left = Vector3::new(0.0, slope_rad.cos(), slope_rad.sin());
    let ground = ground(|_, y_m| y_m * slope_rad.tan());
    let disc = Disc::new(normal * (RADIUS_M - 0.02), left).unwrap();
    let contact = only(tyre().touch(&ground, &disc));
    assert!((contact.force_n / 4000.0 - 1.0).abs() < 1e-3, "{contact:?}");
    assert!((contact.normal - normal).norm() < 1e-3, "{contact:?}");
}

#[test]
fn a_cross_slope_pushes_sideways() {
    // An upright wheel on ground that rises to its left by 0.2: the normal leans to the right.
    let ground = ground(|_, y_m| 0.2 * y_m);
    let hub_m = Vector3::new(0.0, 0.0, RADIUS_M - 0.02);
    let contact = only(tyre().touch(&ground, &upright(hub_m)));
    let expected = Vector3::new(0.0, -0.2, 1.0).normalize();
    assert!((contact.normal - expected).norm() < 1e-3, "{contact:?}");
    // And the centre of pressure moves uphill.
    assert!(contact.point_m.y > 0.005, "{contact:?}");
}

#[test]
fn rough_ground_presses_as_the_sum_over_its_points() {
    // Kinks at the cell centres only, every other of a finer tyre's stations: the chain is the ground itself.
    let tyre = Envelope::new(RADIUS_M, 0.2, 200_000.0, 4000.0, 0.2 / 3.0);
    let heights_m = |x_m: f64| 0.05 * (9.0 * x_m).sin() + 0.03 * (23.0 * x_m).cos();
    let ground = ground(|x_m, _| heights_m(x_m));
    for step in 0..20 {
        let hub_m = Vector3::new(0.05 + 0.1 * f64::from(step), 0.05, heights_m(0.1 * f64::from(step)) + 0.37);
        let found = tyre.touch(&ground, &upright(hub_m));
        let mut sum = Vector3::zeros();
        let n = 80_000;
        let dx_m = 2.0 * RADIUS_M / f64::from(n);
        for i in 0..n {
            let x_m = hub_m.x - RADIUS_M + (f64::from(i) + 0.5) * dx_m;
            let height_m = |x_m: f64| ground.height_m(x_m, 0.05);
            let rise = (height_m(x_m + 0.5 * dx_m) - height_m(x_m - 0.5 * dx_m)) / dx_m;
            let towards = hub_m - Vector3::new(x_m, hub_m.y, height_m(x_m));
            let depth_m = (RADIUS_M - towards.norm()).max(0.0);
            sum += towards.normalize() * (depth_m * dx_m * (1.0 + rise * rise).sqrt());
        }
        let expected_n = sum * tyre.stiffness_n_per_m2;
        let found_n: Vector3<f64> =
            found.iter().flatten().map(|contact| contact.normal * contact.force_n).sum();
        assert!((found_n - expected_n).norm() < 1.0 + 2e-3 * expected_n.norm(), "{found_n} {expected_n}");
    }
}

#[test]
fn a_wheel_in_the_air_touches_nothing() {
    let hub_m = Vector3::new(0.0, 0.0, RADIUS_M + 1e-6);
    assert!(tyre().touch(&ground(|_, _| 0.0), &upright(hub_m)).iter().all(Option::is_none));
}

#[test]
fn before_a_step_the_wheel_has_the_ground_below_and_the_edge_before_it() {
    // A step of 0.2 m; the hub stands 0.38 m high, 20 mm less than the radius, and 0.32 m before it. The ground is
    // asked every 33 mm, so that the edge is met 0.333 m ahead and 0.18 m below the hub: 21 mm inside the tyre.
    let tyre = Envelope::new(RADIUS_M, 0.2, 200_000.0, 4000.0, 0.005);
    let geometry = GridGeometry::centred(0.005, 40, 400, 0.0, 0.0);
    let step = |x_m: f64, _: f64| if x_m > 0.0 { 0.2 } else { 0.0 };
    let patch = |_: f64, _: f64| Patch::open(Stribeck::ROCK);
    let ground = Ground::new(Arc::new(World::from_fn("step", geometry, step, patch).unwrap()));
    let found = tyre.touch(&ground, &upright(Vector3::new(-0.32, 0.0, 0.38)));
    let [below, before] = found.map(Option::unwrap);
    // Level ground pushes upwards with the load of 20 mm.
    assert!((below.normal - Vector3::z()).norm() < 1e-6, "{below:?}");
    assert!((below.force_n / 4000.0 - 1.0).abs() < 1e-6 && below.point_m.z.abs() < 0.03, "{below:?}");
    // The edge pushes towards the hub.
    let towards = Vector3::new(-0.333, 0.0, 0.18).normalize();
    assert!((before.normal - towards).norm() < 0.15, "{before:?} {towards}");
    assert!(before.point_m.z > 0.1, "{before:?}");
    // Their mean, which a single contact would have, is neither.
    let mean = (below.normal * below.force_n + before.normal * before.force_n).normalize();
    assert!((mean - below.normal).norm() > 0.1 && (mean - before.normal).norm() > 0.1);
}

#[test]
fn a_tread_half_on_a_step_is_pushed_up_and_not_aside() {
    // The left half of the tread on a kerb of 0.1 m along the way, the right half in the air.
    let tyre = Envelope::new(RADIUS_M, 0.2, 200_000.0, 4000.0, 0.02);
    let geometry = GridGeometry::centred(0.02, 100, 100, 0.0, 0.0);
    let kerb = |_: f64, y_m: f64| if y_m > 0.0 { 0.1 } else { 0.0 };
    let patch = |_: f64, _: f64| Patch::open(Stribeck::ROCK);
    let ground = Ground::new(Arc::new(World::from_fn("kerb", geometry, kerb, patch).unwrap()));
    let contact = only(tyre.touch(&ground, &upright(Vector3::new(0.0, 0.0, 0.48))));
    assert!((contact.normal - Vector3::z()).norm() < 0.02, "{contact:?}");
    assert!(contact.point_m.y > 0.02, "{contact:?}");
}
