//! How a wheel touches rough ground.
//!
//! The wheel is three discs side by side. Under each, the ground is a chain of straight segments; every piece of
//! ground inside the disc presses towards the hub with a force per length in proportion to how deep it lies under
//! the tread. The force of a segment has a closed form and derives from a potential, so rolling over a rock and
//! down again gains nothing. A tyre wraps around a sharp edge and sinks further onto it than onto a plane.

use nalgebra::{Vector2, Vector3};

use super::ground::Ground;

/// Discs across the tread.
const N_SLICES: usize = 3;
/// Share of the radius at which the rim meets the ground: beyond, the tyre is squeezed flat.
const RIM_SHARE: f64 = 0.5;
/// Share of the radius below which the ground may not come to the hub in the closed form (it is singular there).
const CORE_SHARE: f64 = 0.25;
/// Steepest ground across the tread that the contact normal follows [-].
const CROSS_SLOPE_MAX: f64 = 2.0;

/// Where a wheel is: hub and the directions of its plane, in map coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WheelFrame {
    pub hub_m: Vector3<f64>,
    /// Rolling direction.
    pub forward: Vector3<f64>,
    /// Along the axle.
    pub left: Vector3<f64>,
    /// Along the strut.
    pub up: Vector3<f64>,
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
    /// From the hub to the centre of pressure [m].
    pub loaded_radius_m: f64,
}

/// Shape and elasticity of a tyre.
pub(crate) struct Envelope {
    radius_m: f64,
    width_m: f64,
    /// Places ahead of the hub at which the ground's height is asked [m].
    stations_m: Vec<f64>,
    /// Force per length of ground and depth, all slices together [N/m2].
    stiffness_n_per_m2: f64,
}

/// Sums over the ground inside the discs; forces over stiffness [m2].
#[derive(Default)]
struct Pressure {
    force: Vector2<f64>,
    weight: f64,
    radius: f64,
    lateral: f64,
}

impl Envelope {
    /// A tyre of secant stiffness `stiffness_n_per_m` under `load_n` on a plane, on ground of `cell_m` cells.
    pub(crate) fn new(radius_m: f64, width_m: f64, stiffness_n_per_m: f64, load_n: f64, cell_m: f64) -> Self {
        let n = (radius_m / (0.5 * cell_m).min(0.25 * radius_m)).ceil().min(12.0) as i32;
        let spacing_m = radius_m / f64::from(n);
        let stations_m = (-n..=n).map(|i| f64::from(i) * spacing_m).collect();
        let mut envelope = Self { radius_m, width_m, stations_m, stiffness_n_per_m2: 1.0 };
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
    pub(crate) fn depth_m(&self, ground: &Ground, frame: &WheelFrame) -> f64 {
        let mut deepest_m = f64::NEG_INFINITY;
        for left_m in self.slices_m() {
            let centre = frame.hub_m + frame.left * left_m;
            for &ahead_m in &self.stations_m {
                let rim_m = (self.radius_m * self.radius_m - ahead_m * ahead_m).max(0.0).sqrt();
                let rim = centre + frame.forward * ahead_m - frame.up * rim_m;
                deepest_m = deepest_m.max(ground.height_m(rim.x, rim.y) - rim.z);
            }
        }
        deepest_m
    }

    /// Contact of the wheel with the ground, `None` in the air.
    pub(crate) fn touch(&self, ground: &Ground, frame: &WheelFrame) -> Option<Contact> {
        let mut pressure = Pressure::default();
        for left_m in self.slices_m() {
            self.press_slice(ground, frame, left_m, &mut pressure);
        }
        if pressure.weight <= 0.0 {
            return None;
        }
        let loaded_radius_m = pressure.radius / pressure.weight;
        let inward = pressure.force.normalize();
        let point_m = frame.hub_m + frame.left * (pressure.lateral / pressure.weight)
            - (frame.forward * inward.x + frame.up * inward.y) * loaded_radius_m;
        let cross_slope = self.cross_slope(ground, frame, &point_m);
        let force =
            frame.forward * pressure.force.x + (frame.up - frame.left * cross_slope) * pressure.force.y;
        let magnitude = force.norm();
        let force_n = magnitude * self.stiffness_n_per_m2 / N_SLICES as f64;
        Some(Contact { point_m, normal: force / magnitude, force_n, loaded_radius_m })
    }

    fn slices_m(&self) -> [f64; N_SLICES] {
        [-self.width_m / 3.0, 0.0, self.width_m / 3.0]
    }

    fn press_slice(&self, ground: &Ground, frame: &WheelFrame, left_m: f64, pressure: &mut Pressure) {
        let foot = frame.hub_m + frame.left * left_m - frame.up * self.radius_m;
        let mut previous = None;
        for &ahead_m in &self.stations_m {
            let place = foot + frame.forward * ahead_m;
            let above_m = ground.height_m(place.x, place.y) - place.z;
            // The ground point in the wheel's plane, seen from the hub.
            let point =
                Vector2::new(ahead_m + above_m * frame.forward.z, above_m * frame.up.z - self.radius_m);
            if let Some(before) = previous
                && let Some((force, radius_m)) = self.segment(before, point)
            {
                let weight = force.norm();
                pressure.force += force;
                pressure.weight += weight;
                pressure.radius += weight * radius_m;
                pressure.lateral += weight * left_m;
            }
            previous = Some(point);
        }
    }

    /// Force of a straight piece of ground on a disc over its stiffness [m2], and the distance of the pressed
    /// part from the hub [m]: the integral of (r - rho) times the direction to the hub over the part inside.
    #[inline]
    fn segment(&self, start: Vector2<f64>, end: Vector2<f64>) -> Option<(Vector2<f64>, f64)> {
        let r = self.radius_m;
        let run = end - start;
        // Most pieces lie outside: told without roots and divisions.
        let outside = |point: &Vector2<f64>| point.norm_squared() >= r * r;
        let beside = start.dot(&run) * end.dot(&run) >= 0.0;
        if beside && outside(&start) && outside(&end) {
            return None;
        }
        let length = run.norm();
        let tangent = run / length;
        // Towards the hub when the chain runs forward.
        let normal = Vector2::new(-tangent.y, tangent.x);
        let distance = -start.dot(&normal);
        // Ground that runs backward is the far side of an edge: it pushes only what lies before it.
        if distance >= r || (distance < 0.0 && run.x <= 0.0) {
            return None;
        }
        let d = distance.max(CORE_SHARE * r);
        let half = (r * r - d * d).sqrt();
        let a = start.dot(&tangent).max(-half);
        let b = end.dot(&tangent).min(half);
        if a >= b || length < 1e-9 {
            return None;
        }
        let (rho_a, rho_b) = ((d * d + a * a).sqrt(), (d * d + b * b).sqrt());
        let inward = d * (r * ((b + rho_b) / (a + rho_a)).ln() - (b - a));
        let along = -(r * (rho_b - rho_a) - 0.5 * (rho_b * rho_b - rho_a * rho_a));
        let rim = r * (RIM_SHARE * r - distance).max(0.0) * (b - a) / (2.0 * half);
        let middle = 0.5 * (a + b);
        Some((normal * (inward + rim) + tangent * along, (d * d + middle * middle).sqrt()))
    }

    /// Rise of the ground per length along the axle, seen in the wheel's frame [-].
    fn cross_slope(&self, ground: &Ground, frame: &WheelFrame, point_m: &Vector3<f64>) -> f64 {
        let above_m = |side: f64| {
            let place = point_m + frame.left * (0.5 * side * self.width_m);
            ground.height_m(place.x, place.y) - place.z
        };
        let rise_m = above_m(1.0) - above_m(-1.0);
        let run_m = (self.width_m + rise_m * frame.left.z).max(0.1 * self.width_m);
        (rise_m * frame.up.z / run_m).clamp(-CROSS_SLOPE_MAX, CROSS_SLOPE_MAX)
    }
}
