//! How a wheel touches rough ground.
//!
//! The wheel is a row of discs side by side. Under each, the ground is a chain of straight segments; every piece of
//! ground inside the disc presses towards the hub with a force per length in proportion to how deep it lies under
//! the tread. The force of a segment has a closed form and derives from a potential, so rolling over a rock and
//! down again gains nothing. A tyre wraps around a sharp edge and sinks further onto it than onto a plane.

use nalgebra::{Vector2, Vector3};

use super::ground::Ground;

/// Widest piece of tread that one disc stands for, over the ground's cell: no grid point slips between discs [-].
const SLICE_CELLS: f64 = 1.25;
/// Longest step along the wheel from one asked height to the next, over the ground's cell [-].
const STATION_CELLS: f64 = 0.75;
/// The same over the wheel's radius [-].
const STATION_SHARE: f64 = 0.25;
/// Share of the radius at which the rim meets the ground: beyond, the tyre is squeezed flat.
const RIM_SHARE: f64 = 0.5;
/// Share of the radius below which the ground may not come to the hub in the closed form (it is singular there).
const CORE_SHARE: f64 = 0.25;
/// Sine of the axle's inclination beyond which a wheel lies on its side.
const LYING_SINE: f64 = 0.95;
/// Steepest ground across the tread that the contact normal follows [-].
const CROSS_SLOPE_MAX: f64 = 2.0;

/// Where a wheel is, in map coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Disc {
    pub hub_m: Vector3<f64>,
    /// Along the axle.
    pub left: Vector3<f64>,
    /// In the wheel's plane, level.
    ahead: Vector3<f64>,
    /// In the wheel's plane, upwards.
    up: Vector3<f64>,
}

/// The ground's answer to a wheel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    /// Centre of pressure in map coordinates [m].
    pub point_m: Vector3<f64>,
    /// Unit vector out of the ground.
    pub normal: Vector3<f64>,
    /// Elastic force along the normal [N].
    pub force_n: f64,
    /// From the hub to the centre of pressure, against the normal [m].
    pub loaded_radius_m: f64,
}

/// Shape and elasticity of a tyre.
pub(crate) struct Envelope {
    radius_m: f64,
    width_m: f64,
    /// Places ahead of the hub at which the ground's height is asked [m].
    stations_m: Vec<f64>,
    /// Discs along the axle [m].
    slices_m: Vec<f64>,
    /// Force per length of ground and depth, all slices together [N/m2].
    stiffness_n_per_m2: f64,
}

/// Sums over the ground inside the discs; forces over stiffness [m2].
#[derive(Default)]
struct Pressure {
    force: Vector2<f64>,
    weight: f64,
    /// Weighted places of the pressed pieces, seen from the hub.
    place: Vector2<f64>,
    lateral: f64,
}

impl Disc {
    /// `None` for a wheel that lies on its side: there the body touches first.
    pub(crate) fn new(hub_m: Vector3<f64>, left: Vector3<f64>) -> Option<Self> {
        if left.z.abs() > LYING_SINE {
            return None;
        }
        let ahead = Vector3::new(left.y, -left.x, 0.0).normalize();
        Some(Self { hub_m, left, ahead, up: ahead.cross(&left) })
    }
}

impl Envelope {
    /// A tyre of secant stiffness `stiffness_n_per_m` under `load_n` on a plane, on ground of `cell_m` cells.
    pub(crate) fn new(radius_m: f64, width_m: f64, stiffness_n_per_m: f64, load_n: f64, cell_m: f64) -> Self {
        let n = (radius_m / (STATION_CELLS * cell_m).min(STATION_SHARE * radius_m)).ceil().min(12.0) as i32;
        let stations_m = (-n..=n).map(|i| f64::from(i) * radius_m / f64::from(n)).collect();
        let slices_m = slices_m(width_m, cell_m);
        let mut envelope = Self { radius_m, width_m, stations_m, slices_m, stiffness_n_per_m2: 1.0 };
        envelope.stiffness_n_per_m2 = load_n / envelope.force_on_plane_n(load_n / stiffness_n_per_m);
        envelope
    }

    /// Radius of the unloaded wheel [m].
    pub(crate) fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// Distance rolled per turn, over two pi [m]: that of a radial tyre lies a third of the deflection below the
    /// unloaded radius.
    pub(crate) fn rolling_radius_m(&self, loaded_radius_m: f64) -> f64 {
        self.radius_m - (self.radius_m - loaded_radius_m) / 3.0
    }

    /// Force of level ground `deflection_m` above the unloaded tread [N].
    pub(crate) fn force_on_plane_n(&self, deflection_m: f64) -> f64 {
        let depth_m = deflection_m - self.radius_m;
        let ends = [-self.radius_m, self.radius_m].map(|along_m| Vector2::new(along_m, depth_m));
        self.segment(ends[0], ends[1]).map_or(0.0, |(force, _)| force.y * self.stiffness_n_per_m2)
    }

    /// Deflection under a load on level ground [m].
    pub(crate) fn deflection_m(&self, load_n: f64) -> f64 {
        let (mut low_m, mut high_m) = (0.0, self.radius_m);
        for _ in 0..60 {
            let middle_m = 0.5 * (low_m + high_m);
            if self.force_on_plane_n(middle_m) < load_n { low_m = middle_m } else { high_m = middle_m }
        }
        0.5 * (low_m + high_m)
    }

    /// How far the ground reaches above the unloaded tread, negative when the wheel is in the air [m].
    pub(crate) fn depth_m(&self, ground: &Ground, disc: &Disc) -> f64 {
        let mut deepest_m = f64::NEG_INFINITY;
        for &left_m in &self.slices_m {
            let centre = disc.hub_m + disc.left * left_m;
            for &ahead_m in &self.stations_m {
                let rim_m = (self.radius_m * self.radius_m - ahead_m * ahead_m).max(0.0).sqrt();
                let rim = centre + disc.ahead * ahead_m - disc.up * rim_m;
                deepest_m = deepest_m.max(ground.height_m(rim.x, rim.y) - rim.z);
            }
        }
        deepest_m
    }

    /// Contact of the wheel with the ground, `None` in the air.
    pub(crate) fn touch(&self, ground: &Ground, disc: &Disc) -> Option<Contact> {
        let mut pressure = Pressure::default();
        for &left_m in &self.slices_m {
            self.press_slice(ground, disc, left_m, &mut pressure);
        }
        if pressure.weight <= 0.0 {
            return None;
        }
        let inward = pressure.force.normalize();
        let loaded_radius_m = -pressure.place.dot(&inward) / pressure.weight;
        let point_m = disc.hub_m + disc.left * (pressure.lateral / pressure.weight)
            - (disc.ahead * inward.x + disc.up * inward.y) * loaded_radius_m;
        let cross_slope = self.cross_slope(ground, disc, &point_m);
        let force = disc.ahead * pressure.force.x + (disc.up - disc.left * cross_slope) * pressure.force.y;
        let magnitude = force.norm();
        let force_n = magnitude * self.stiffness_n_per_m2 / self.slices_m.len() as f64;
        Some(Contact { point_m, normal: force / magnitude, force_n, loaded_radius_m })
    }

    fn press_slice(&self, ground: &Ground, disc: &Disc, left_m: f64, pressure: &mut Pressure) {
        let foot = disc.hub_m + disc.left * left_m - disc.up * self.radius_m;
        let mut previous = None;
        for &ahead_m in &self.stations_m {
            let place = foot + disc.ahead * ahead_m;
            let above_m = ground.height_m(place.x, place.y) - place.z;
            // The ground point in the wheel's plane, seen from the hub.
            let point = Vector2::new(ahead_m, above_m * disc.up.z - self.radius_m);
            if let Some(before) = previous
                && let Some((force, middle)) = self.segment(before, point)
            {
                let weight = force.norm();
                pressure.force += force;
                pressure.weight += weight;
                pressure.place += middle * weight;
                pressure.lateral += weight * left_m;
            }
            previous = Some(point);
        }
    }

    /// Force of a straight piece of ground, from back to front, on a disc over its stiffness [m2], and the middle of the
    /// pressed part seen from the hub [m]: the integral of (r - rho) times the direction to the hub over the part
    /// inside.
    #[inline]
    fn segment(&self, start: Vector2<f64>, end: Vector2<f64>) -> Option<(Vector2<f64>, Vector2<f64>)> {
        let r = self.radius_m;
        let run = end - start;
        let squares = [start.norm_squared(), end.norm_squared()];
        // Most pieces lie outside: told without roots and divisions.
        let beside = start.dot(&run) * end.dot(&run) >= 0.0;
        if beside && squares[0] >= r * r && squares[1] >= r * r {
            return None;
        }
        let tangent = run / run.norm();
        let normal = Vector2::new(-tangent.y, tangent.x);
        let mut d = -start.dot(&normal);
        let [mut a, mut b] = [start.dot(&tangent), end.dot(&tangent)];
        if squares[0].max(squares[1]) > r * r {
            let half = (r * r - d * d).max(0.0).sqrt();
            [a, b] = [a.max(-half), b.min(half)];
            if a >= b {
                return None;
            }
        }
        let rho = |along: f64, d: f64| (d * d + along * along).sqrt();
        let [mut rho_a, mut rho_b] = [rho(a, d), rho(b, d)];
        let nearest = if a < 0.0 && b > 0.0 { d } else { rho_a.min(rho_b) };
        // With the hub in or almost in the ground the direction to it says nothing.
        if nearest < CORE_SHARE * r {
            d = CORE_SHARE * r;
            [rho_a, rho_b] = [rho(a, d), rho(b, d)];
        }
        // asinh(b/d) - asinh(a/d), written so that a line through the hub does no harm.
        let ratio = if b <= 0.0 { (rho_a - a) / (rho_b - b) } else { (b + rho_b) / (a + rho_a) };
        let inward = d * (r * ratio.ln() - (b - a));
        let along = -(r * (rho_b - rho_a) - 0.5 * (rho_b * rho_b - rho_a * rho_a));
        let rim = r * (RIM_SHARE * r - nearest).max(0.0) * (b - a) / (2.0 * r);
        Some((normal * (inward + rim) + tangent * along, tangent * (0.5 * (a + b)) - normal * d))
    }

    /// Rise of the ground per length along the axle, seen in the wheel's frame [-].
    fn cross_slope(&self, ground: &Ground, disc: &Disc, point_m: &Vector3<f64>) -> f64 {
        let above_m = |side: f64| {
            let place = point_m + disc.left * (0.5 * side * self.width_m);
            ground.height_m(place.x, place.y) - place.z
        };
        let rise_m = above_m(1.0) - above_m(-1.0);
        let run_m = (self.width_m + rise_m * disc.left.z).max(0.1 * self.width_m);
        (rise_m * disc.up.z / run_m).clamp(-CROSS_SLOPE_MAX, CROSS_SLOPE_MAX)
    }
}

/// Places of discs along the axle that resist rolling over like the whole tread does: the second moment of
/// n evenly spread discs falls short of the tread's by 1 - 1/n^2.
fn slices_m(width_m: f64, cell_m: f64) -> Vec<f64> {
    let n = (width_m / (SLICE_CELLS * cell_m)).ceil().clamp(2.0, 5.0);
    let spread_m = width_m / (1.0 - 1.0 / (n * n)).sqrt();
    (0..n as i32).map(|i| ((f64::from(i) + 0.5) / n - 0.5) * spread_m).collect()
}

#[cfg(test)]
mod tests {
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

    #[test]
    fn the_plane_answers_with_the_given_stiffness() {
        let tyre = tyre();
        assert!((tyre.deflection_m(4000.0) - 0.02).abs() < 1e-9);
        // Depth to the power 1.5 for small depths: half the load at 2^(-2/3) of the depth.
        assert!((tyre.deflection_m(2000.0) / (0.02 * 2f64.powf(-2.0 / 3.0)) - 1.0).abs() < 0.01);
        let hub_m = Vector3::new(0.013, 0.021, RADIUS_M - 0.02);
        for heading in [Vector3::y(), -Vector3::x(), Vector3::new(0.6, 0.8, 0.0)] {
            let contact = tyre.touch(&ground(|_, _| 0.0), &Disc::new(hub_m, heading).unwrap()).unwrap();
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
            let contact = tyre().touch(&ground, &upright(normal * (RADIUS_M - 0.02))).unwrap();
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
        let contact = tyre().touch(&ground, &disc).unwrap();
        assert!((contact.force_n / 4000.0 - 1.0).abs() < 1e-3, "{contact:?}");
        assert!((contact.normal - normal).norm() < 1e-3, "{contact:?}");
    }

    #[test]
    fn a_cross_slope_pushes_sideways() {
        // An upright wheel on ground that rises to its left by 0.2: the normal leans to the right.
        let ground = ground(|_, y_m| 0.2 * y_m);
        let hub_m = Vector3::new(0.0, 0.0, RADIUS_M - 0.02);
        let contact = tyre().touch(&ground, &upright(hub_m)).unwrap();
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
            let hub_m =
                Vector3::new(0.05 + 0.1 * f64::from(step), 0.05, heights_m(0.1 * f64::from(step)) + 0.37);
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
            let found_n = found.map_or(Vector3::zeros(), |contact| contact.normal * contact.force_n);
            assert!((found_n - expected_n).norm() < 1.0 + 2e-3 * expected_n.norm(), "{found_n} {expected_n}");
        }
    }

    #[test]
    fn a_wheel_in_the_air_touches_nothing() {
        let hub_m = Vector3::new(0.0, 0.0, RADIUS_M + 1e-6);
        assert!(tyre().touch(&ground(|_, _| 0.0), &upright(hub_m)).is_none());
    }
}
