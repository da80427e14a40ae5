//! How a wheel touches rough ground.
//!
//! The wheel is a row of discs side by side. Under each, the ground is a chain of straight segments; every piece of
//! ground inside the disc presses towards the hub with a force per length in proportion to how deep it lies under
//! the tread. The force of a segment has a closed form and derives from a potential, so rolling over a rock and
//! down again gains nothing. A tyre wraps around a sharp edge and sinks further onto it than onto a plane.
//!
//! Pieces that follow each other press in one place. Where the ground leaves the disc between two places, or turns up
//! in a corner, and the two press from different sides, as the ground and the face of a step do, the wheel has two
//! contacts, each with a normal, a load and a friction of its own.

use nalgebra::{Vector2, Vector3};

use super::ground::Ground;

/// Widest piece of tread that one disc stands for, over the ground's cell: no grid point slips between discs [-].
const SLICE_CELLS: f64 = 1.25;
/// Longest step along the wheel from one asked height to the next, over the ground's cell [-].
const STATION_CELLS: f64 = 0.75;
/// The same over the wheel's radius [-].
const STATION_SHARE: f64 = 0.25;
/// Stations ahead of the hub at the most, and all together.
const STATIONS_AHEAD: f64 = 12.0;
const STATIONS: usize = 25;
/// Share of the radius at which the rim meets the ground: beyond, the tyre is squeezed flat.
const RIM_SHARE: f64 = 0.5;
/// Share of the radius below which the ground may not come to the hub in the closed form (it is singular there).
const CORE_SHARE: f64 = 0.25;
/// Sine of the axle's inclination beyond which a wheel lies on its side.
const LYING_SINE: f64 = 0.95;
/// Contacts that a wheel may have.
pub(crate) const CONTACTS: usize = 2;
/// Sine of the angle by which the ground turns up in a corner (30 degrees).
const CORNER_SINE: f64 = 0.5;
/// Cosine of the angle up to which places press from the same side (30 degrees).
const SAME_SIDE_COSINE: f64 = 0.866;
/// How far beside a disc the ground's slope across it is taken, over the tread that it stands for [-].
const BESIDE_SHARE: f64 = 0.25;
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
    /// How far below the hub ground between a station and the next may lie and touch the disc [m]: at the one, and at
    /// the other.
    reach_m: Vec<[f64; 2]>,
    /// Discs along the axle [m].
    slices_m: Vec<f64>,
    /// Force per length of ground and depth, all slices together [N/m2].
    stiffness_n_per_m2: f64,
}

/// Sums over the ground inside the discs; forces over stiffness [m2].
#[derive(Clone, Copy, Default)]
struct Pressure {
    force: Vector2<f64>,
    weight: f64,
    /// Weighted places of the pressed pieces, seen from the hub.
    place: Vector2<f64>,
    lateral: f64,
    /// Weighted rise of the ground per length along the axle.
    cross: f64,
}

/// A piece of ground inside a disc.
struct Piece {
    /// Force over stiffness [m2].
    force: Vector2<f64>,
    /// Its middle, seen from the hub [m].
    middle: Vector2<f64>,
    /// Direction from back to front.
    tangent: Vector2<f64>,
}

impl Pressure {
    fn add(&mut self, other: &Self) {
        self.force += other.force;
        self.weight += other.weight;
        self.place += other.place;
        self.lateral += other.lateral;
        self.cross += other.cross;
    }

    /// From the hub to the centre of pressure, against the direction of the force [m].
    fn loaded_radius_m(&self, inward: &Vector2<f64>) -> f64 {
        -self.place.dot(inward) / self.weight
    }

    /// Whether this presses from the side that `other` presses from.
    fn is_beside(&self, other: &Self) -> bool {
        self.force.dot(&other.force) > SAME_SIDE_COSINE * self.force.norm() * other.force.norm()
    }
}

/// Adds a place to the contact on its side, or to a new one, or, when there are enough, to the nearer one.
fn gather(place: &Pressure, contacts: &mut [Pressure; CONTACTS]) {
    let alike = contacts.iter().position(|contact| contact.weight <= 0.0 || contact.is_beside(place));
    let nearer = || {
        let [first, second] = contacts.map(|contact| contact.force.normalize().dot(&place.force));
        usize::from(second > first)
    };
    contacts[alike.unwrap_or_else(nearer)].add(place);
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
        let n = (radius_m / (STATION_CELLS * cell_m).min(STATION_SHARE * radius_m)).ceil().min(STATIONS_AHEAD)
            as i32;
        let stations_m: Vec<_> = (-n..=n).map(|i| f64::from(i) * radius_m / f64::from(n)).collect();
        let reach_m = stations_m.array_windows().map(|ends_m| reach_m(radius_m, ends_m)).collect();
        let slices_m = slices_m(width_m, cell_m);
        let mut envelope = Self { radius_m, width_m, stations_m, reach_m, slices_m, stiffness_n_per_m2: 1.0 };
        envelope.stiffness_n_per_m2 = load_n / envelope.force_on_plane_n(load_n / stiffness_n_per_m);
        envelope
    }

    /// Radius of the unloaded wheel [m].
    pub(crate) fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// Distance between the places at which a disc asks for the ground [m]: no contact is known better.
    pub(crate) fn spacing_m(&self) -> f64 {
        2.0 * self.radius_m / (self.stations_m.len() - 1) as f64
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
        self.segment(ends[0], ends[1]).map_or(0.0, |piece| piece.force.y * self.stiffness_n_per_m2)
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

    /// Contacts of the wheel with the ground, none in the air.
    pub(crate) fn touch(&self, ground: &Ground, disc: &Disc) -> [Option<Contact>; CONTACTS] {
        let mut contacts = [Pressure::default(); CONTACTS];
        for &left_m in &self.slices_m {
            self.press_slice(ground, disc, left_m, &mut contacts);
        }
        contacts.map(|pressure| (pressure.weight > 0.0).then(|| self.contact(disc, &pressure)))
    }

    fn contact(&self, disc: &Disc, pressure: &Pressure) -> Contact {
        let inward = pressure.force.normalize();
        let loaded_radius_m = pressure.loaded_radius_m(&inward);
        let point_m = disc.hub_m + disc.left * (pressure.lateral / pressure.weight)
            - (disc.ahead * inward.x + disc.up * inward.y) * loaded_radius_m;
        let cross_slope = pressure.cross / pressure.weight;
        let force = disc.ahead * pressure.force.x + (disc.up - disc.left * cross_slope) * pressure.force.y;
        let magnitude = force.norm();
        let force_n = magnitude * self.stiffness_n_per_m2 / self.slices_m.len() as f64;
        Contact { point_m, normal: force / magnitude, force_n, loaded_radius_m }
    }

    fn press_slice(&self, ground: &Ground, disc: &Disc, left_m: f64, contacts: &mut [Pressure; CONTACTS]) {
        let mut place = Pressure::default();
        let mut tangent = Vector2::zeros();
        let points = self.ground_points(ground, disc, left_m);
        for (ends, reach_m) in points[..self.stations_m.len()].array_windows().zip(&self.reach_m) {
            let [start, end] = *ends;
            // Most pieces lie far below the disc.
            let is_far = start.y < -reach_m[0] && end.y < -reach_m[1];
            let piece = if is_far { None } else { self.segment(start, end) };
            let is_corner = piece.as_ref().is_none_or(|piece| tangent.perp(&piece.tangent) > CORNER_SINE);
            if is_corner && place.weight > 0.0 {
                self.leave(ground, disc, left_m, &mut place, contacts);
            }
            let Some(piece) = piece else { continue };
            let weight = piece.force.norm();
            place.force += piece.force;
            place.weight += weight;
            place.place += piece.middle * weight;
            place.lateral += weight * left_m;
            tangent = piece.tangent;
        }
        if place.weight > 0.0 {
            self.leave(ground, disc, left_m, &mut place, contacts);
        }
    }

    /// The ground under a disc at all stations, in the wheel's plane and seen from the hub [m].
    #[inline]
    fn ground_points(&self, ground: &Ground, disc: &Disc, left_m: f64) -> [Vector2<f64>; STATIONS] {
        let foot = disc.hub_m + disc.left * left_m - disc.up * self.radius_m;
        let mut heights_m = [0.0; STATIONS];
        let n = self.stations_m.len();
        let first = foot + disc.ahead * self.stations_m[0];
        let step = disc.ahead * self.spacing_m();
        ground.run_m([first.x, first.y], [step.x, step.y], &mut heights_m[..n]);
        let mut points = [Vector2::zeros(); STATIONS];
        for i in 0..n {
            let ahead_m = self.stations_m[i];
            points[i] = Vector2::new(ahead_m, (heights_m[i] - foot.z) * disc.up.z - self.radius_m);
        }
        points
    }

    /// Ends a place under a disc.
    fn leave(
        &self,
        ground: &Ground,
        disc: &Disc,
        left_m: f64,
        place: &mut Pressure,
        contacts: &mut [Pressure; CONTACTS],
    ) {
        place.cross = place.weight * self.cross_slope(ground, disc, left_m, place);
        gather(&std::mem::take(place), contacts);
    }

    /// Force of a straight piece of ground, from back to front, on a disc: the integral of (r - rho) times the direction
    /// to the hub over the part inside.
    #[inline]
    fn segment(&self, start: Vector2<f64>, end: Vector2<f64>) -> Option<Piece> {
        let r = self.radius_m;
        let run = end - start;
        let squares = [start.norm_squared(), end.norm_squared()];
        // Pieces that lie outside are told without roots and divisions.
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
        let force = normal * (inward + rim) + tangent * along;
        Some(Piece { force, middle: tangent * (0.5 * (a + b)) - normal * d, tangent })
    }

    /// Rise per length along the axle of the ground that a place under a disc stands on, seen in the wheel's frame [-]:
    /// taken close beside the disc, so that a tread half on a step is not pushed off as if by a slope.
    fn cross_slope(&self, ground: &Ground, disc: &Disc, left_m: f64, place: &Pressure) -> f64 {
        let inward = place.force.normalize();
        let radius_m = place.loaded_radius_m(&inward);
        let point_m =
            disc.hub_m + disc.left * left_m - (disc.ahead * inward.x + disc.up * inward.y) * radius_m;
        let beside_m = BESIDE_SHARE * self.width_m / self.slices_m.len() as f64;
        let above_m = |side: f64| {
            let place = point_m + disc.left * (side * beside_m);
            ground.height_m(place.x, place.y) - place.z
        };
        let rise_m = above_m(1.0) - above_m(-1.0);
        let run_m = (2.0 * beside_m + rise_m * disc.left.z).max(0.2 * beside_m);
        (rise_m * disc.up.z / run_m).clamp(-CROSS_SLOPE_MAX, CROSS_SLOPE_MAX)
    }
}

/// How far below the hub straight ground between two stations may lie at their places and touch the disc [m]: the rim's
/// depth, and as much as the rim hangs below its own chord.
fn reach_m(radius_m: f64, [start_m, end_m]: &[f64; 2]) -> [f64; 2] {
    let rim_m = |ahead_m: f64| (radius_m * radius_m - ahead_m * ahead_m).max(0.0).sqrt();
    let [start_rim_m, end_rim_m] = [rim_m(*start_m), rim_m(*end_m)];
    let slope = (end_rim_m - start_rim_m) / (end_m - start_m);
    // The rim hangs lowest below its chord where it runs along it.
    let lowest_rim_m = radius_m / slope.hypot(1.0);
    let chord_m = start_rim_m + slope * (-slope * lowest_rim_m - start_m);
    let sag_m = lowest_rim_m - chord_m;
    [start_rim_m + sag_m, end_rim_m + sag_m]
}

/// Places of discs along the axle that resist rolling over like the whole tread does: the second moment of
/// n evenly spread discs falls short of the tread's by 1 - 1/n^2.
fn slices_m(width_m: f64, cell_m: f64) -> Vec<f64> {
    let n = (width_m / (SLICE_CELLS * cell_m)).ceil().clamp(2.0, 5.0);
    let spread_m = width_m / (1.0 - 1.0 / (n * n)).sqrt();
    (0..n as i32).map(|i| ((f64::from(i) + 0.5) / n - 0.5) * spread_m).collect()
}

#[cfg(test)]
mod tests;
