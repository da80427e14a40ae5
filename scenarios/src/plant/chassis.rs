//! The body: a rigid body in the air, and one of rapier's where it comes near the ground.

use bicycle::Vehicle;
use nalgebra::{Isometry3, Quaternion, Unit, UnitQuaternion, Vector3};
use rapier3d::prelude::{
    Array2, Collider, ColliderBuilder, ColliderHandle, IntegrationParameters, MassProperties, PhysicsWorld,
    Pose as RapierPose, RigidBodyBuilder, RigidBodyHandle, Rotation, Vector,
};

use super::GRAVITY_MPS2;
use super::ground::Ground;
use super::rest::{Rest, Stance};

/// Friction of the body's panels on the ground [-].
pub(super) const PANEL_FRICTION: f64 = 0.5;
/// Steps between checks whether a hull is near the ground.
const CHECK_STEPS: u32 = 16;
/// A hull counts as near the ground below this share of the ground clearance.
const NEAR_SHARE: f64 = 0.25;
/// Places along the vehicle at which its underside is held against the ground.
const UNDERSIDE_PLACES: f64 = 36.0;
/// Points that a row of them has at the most.
const ROW_MAX: usize = UNDERSIDE_PLACES as usize + 2;
/// Below this cosine of the body's tilt its sides may touch first: every hull then counts as near.
const TILTED_COSINE: f64 = 0.6;

/// How the body lies and moves, in map coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyMotion {
    /// Centre of the rear axle [m].
    pub origin_m: Vector3<f64>,
    /// Forward, left and up.
    pub axes: [Vector3<f64>; 3],
    /// Centre of gravity [m].
    pub cog_m: Vector3<f64>,
    /// Velocity of the centre of gravity [m/s].
    pub linear_mps: Vector3<f64>,
    /// Angular velocity [rad/s].
    pub angular_radps: Vector3<f64>,
}

/// Force and torque about the centre of gravity, in map coordinates.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Wrench {
    pub force_n: Vector3<f64>,
    pub torque_nm: Vector3<f64>,
}

/// A box of the body.
struct Hull {
    collider: ColliderHandle,
    underside: Underside,
}

/// The lattice of points at which a hull's underside is held against the ground, in the body frame.
struct Underside {
    /// Rear right corner [m].
    first_m: Vector3<f64>,
    /// To the next point ahead and to the left [m].
    spacing_m: [f64; 2],
    /// Points ahead and to the left.
    n: [usize; 2],
}

/// The rigid body.
pub(crate) struct Chassis {
    physics: PhysicsWorld,
    body: RigidBodyHandle,
    hulls: Vec<Hull>,
    near_m: f64,
    cog_m: Vector3<f64>,
    mass_kg: f64,
    inertia_kgm2: Vector3<f64>,
    rotation: UnitQuaternion<f64>,
    motion: BodyMotion,
    step_s: f64,
    steps_to_check: u32,
    /// Whether a hull is near the ground: then rapier moves the body.
    is_near: bool,
    /// What contact gave the body in the last step beside the ground [N s].
    contact_impulse_ns: Vector3<f64>,
}

impl BodyMotion {
    fn at_rest(pose: &Isometry3<f64>, local_cog_m: &Vector3<f64>) -> Self {
        let still = Vector3::zeros();
        let origin_m = pose.translation.vector;
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let mut motion = Self { origin_m, axes, cog_m: origin_m, linear_mps: still, angular_radps: still };
        motion.turn_to(&pose.rotation);
        motion.cog_m = motion.point_m(local_cog_m);
        motion
    }

    fn turn_to(&mut self, rotation: &UnitQuaternion<f64>) {
        let matrix = rotation.to_rotation_matrix();
        self.axes = std::array::from_fn(|i| matrix.matrix().column(i).into_owned());
    }

    pub(crate) fn point_m(&self, local_m: &Vector3<f64>) -> Vector3<f64> {
        self.origin_m + self.direction(local_m)
    }

    pub(crate) fn direction(&self, local: &Vector3<f64>) -> Vector3<f64> {
        self.axes[0] * local.x + self.axes[1] * local.y + self.axes[2] * local.z
    }

    pub(crate) fn in_body(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        Vector3::from(self.axes.map(|axis| axis.dot(vector)))
    }

    pub(crate) fn velocity_at_mps(&self, point_m: &Vector3<f64>) -> Vector3<f64> {
        self.linear_mps + self.angular_radps.cross(&(point_m - self.cog_m))
    }
}

impl Wrench {
    pub(crate) fn add_at(&mut self, force_n: Vector3<f64>, point_m: &Vector3<f64>, body: &BodyMotion) {
        self.force_n += force_n;
        self.torque_nm += (point_m - body.cog_m).cross(&force_n);
    }
}

impl Chassis {
    pub(crate) fn new(
        vehicle: &Vehicle,
        rest: &Rest,
        stance: &Stance,
        ground: &Ground,
        pose: &Isometry3<f64>,
        step_s: f64,
    ) -> Self {
        let mut physics = PhysicsWorld::new();
        physics.gravity = Vector::new(0.0, 0.0, -GRAVITY_MPS2);
        physics.integration_parameters = IntegrationParameters {
            dt: step_s,
            num_solver_iterations: 1,
            length_unit: vehicle.geometry.length_m / 3.0,
            ..IntegrationParameters::default()
        };
        physics.insert_collider(heightfield(ground), None);
        let mass = MassProperties::new(glam(&stance.cog_m), rest.mass_kg, glam(&rest.inertia_kgm2));
        let builder = RigidBodyBuilder::dynamic()
            .pose(rapier_pose(pose))
            .additional_mass_properties(mass)
            .can_sleep(false);
        let body = physics.insert_body(builder);
        let spacing_m = (vehicle.geometry.length_m / UNDERSIDE_PLACES).max(0.5 * ground.resolution_m());
        let hulls = boxes(vehicle, stance)
            .into_iter()
            .map(|[low_m, high_m]| Hull {
                collider: physics.insert_collider(panel(&low_m, &high_m), Some(body)),
                underside: Underside::of(&low_m, &high_m, spacing_m),
            })
            .collect();
        let motion = BodyMotion::at_rest(pose, &stance.cog_m);
        Self {
            physics,
            body,
            hulls,
            near_m: NEAR_SHARE * vehicle.geometry.ground_clearance_m,
            cog_m: stance.cog_m,
            mass_kg: rest.mass_kg,
            inertia_kgm2: rest.inertia_kgm2,
            rotation: pose.rotation,
            motion,
            step_s,
            steps_to_check: 0,
            is_near: false,
            contact_impulse_ns: Vector3::zeros(),
        }
    }

    /// How the body lies and moves now.
    pub(crate) fn motion(&self) -> BodyMotion {
        self.motion
    }

    /// Moves the body by a step under gravity, the wheels' forces and contact with the ground.
    pub(crate) fn step(&mut self, wrench: &Wrench, ground: &Ground) {
        if self.steps_to_check == 0 {
            self.steps_to_check = CHECK_STEPS;
            self.wake_near_hulls(ground);
        }
        self.steps_to_check -= 1;
        if self.is_near {
            self.step_beside_ground(wrench);
        } else {
            self.step_in_air(wrench);
        }
    }

    /// Newton's and Euler's equations, velocities before positions.
    fn step_in_air(&mut self, wrench: &Wrench) {
        let free_mps2 = self.free_mps2(wrench);
        let motion = &mut self.motion;
        motion.linear_mps += free_mps2 * self.step_s;
        let rate_radps = motion.in_body(&motion.angular_radps);
        let momentum = self.inertia_kgm2.component_mul(&rate_radps);
        let torque_nm = motion.in_body(&wrench.torque_nm) - rate_radps.cross(&momentum);
        let after_radps = (momentum + torque_nm * self.step_s).component_div(&self.inertia_kgm2);
        motion.angular_radps = motion.direction(&after_radps);
        let half_rad = motion.angular_radps * (0.5 * self.step_s);
        let turn = Quaternion::from_parts(1.0, half_rad);
        self.rotation = Unit::new_normalize(turn * self.rotation.into_inner());
        let cog_m = motion.cog_m + motion.linear_mps * self.step_s;
        motion.turn_to(&self.rotation);
        motion.cog_m = cog_m;
        motion.origin_m = cog_m - motion.direction(&self.cog_m);
    }

    fn step_beside_ground(&mut self, wrench: &Wrench) {
        let free_mps = self.motion.linear_mps + self.free_mps2(wrench) * self.step_s;
        let body = &mut self.physics.bodies[self.body];
        body.reset_forces(false);
        body.reset_torques(false);
        body.add_force(glam(&wrench.force_n), false);
        body.add_torque(glam(&wrench.torque_nm), false);
        self.physics.step();
        let body = &self.physics.bodies[self.body];
        let pose = body.position();
        let [x, y, z, w] = pose.rotation.to_array();
        self.rotation = Unit::new_unchecked(Quaternion::new(w, x, y, z));
        let motion = &mut self.motion;
        motion.turn_to(&self.rotation);
        motion.origin_m = nalgebra(pose.translation);
        motion.cog_m = motion.point_m(&self.cog_m);
        motion.linear_mps = nalgebra(body.linvel());
        motion.angular_radps = nalgebra(body.angvel());
        self.contact_impulse_ns = (motion.linear_mps - free_mps) * self.mass_kg;
    }

    /// Acceleration of the body if nothing but the wheels touched it [m/s2].
    fn free_mps2(&self, wrench: &Wrench) -> Vector3<f64> {
        wrench.force_n / self.mass_kg - Vector3::z() * GRAVITY_MPS2
    }

    /// Impulse of contact on the body in the last step, in map coordinates, if an obstacle touched it [N s]: what is
    /// left of the change of momentum. The engine's own numbers keep what points gave that have parted since.
    pub(crate) fn obstacle_impulse_ns(&self, ground: &Ground) -> Vector3<f64> {
        if self.is_near && self.hulls.iter().any(|hull| self.is_at_obstacle(hull, ground)) {
            self.contact_impulse_ns
        } else {
            Vector3::zeros()
        }
    }

    fn is_at_obstacle(&self, hull: &Hull, ground: &Ground) -> bool {
        let touching =
            self.physics.contact_pairs_with(hull.collider).filter(|pair| pair.has_any_active_contact());
        let mut places_m = touching.flat_map(|pair| {
            let first = *self.physics.colliders[pair.collider1].position();
            let points = pair.solver_manifolds().iter().flat_map(|manifold| &manifold.points);
            points.filter(|point| point.data.impulse > 0.0).map(move |point| first * point.local_p1)
        });
        places_m.any(|place_m| ground.is_obstacle(place_m.x, place_m.y))
    }

    /// Contact with the ground costs more than all the rest: hulls take part only near it, and rapier only with them.
    fn wake_near_hulls(&mut self, ground: &Ground) {
        let motion = &self.motion;
        let until_check_m = motion.linear_mps.norm() * self.step_s * f64::from(CHECK_STEPS);
        let margin_m = self.near_m + until_check_m;
        let tilted = motion.axes[2].z < TILTED_COSINE;
        let was_near = std::mem::replace(&mut self.is_near, false);
        for hull in &self.hulls {
            let near = tilted || hull.underside.is_near(motion, ground, margin_m);
            self.physics.colliders[hull.collider].set_enabled(near);
            self.is_near |= near;
        }
        if self.is_near && !was_near {
            let pose = Isometry3::from_parts(motion.origin_m.into(), self.rotation);
            let body = &mut self.physics.bodies[self.body];
            body.set_position(rapier_pose(&pose), false);
            body.set_linvel(glam(&motion.linear_mps), false);
            body.set_angvel(glam(&motion.angular_radps), false);
        }
    }
}

/// Corners of the boxes in the body frame: the belly between the axles, and what hangs over front and rear, which
/// ends at hub height so that wheels meet steep ground before bumpers do.
pub(super) fn boxes(vehicle: &Vehicle, stance: &Stance) -> [[Vector3<f64>; 2]; 3] {
    let geometry = &vehicle.geometry;
    let belly_m = geometry.ground_clearance_m - stance.axle_height_m;
    let bumper_m = belly_m.max(0.0);
    let top_m = (belly_m + 0.5 * geometry.ground_clearance_m)
        .max(2.0 * vehicle.body.cog_height_m - stance.axle_height_m)
        .max(bumper_m + 0.25 * geometry.wheel_radius_m);
    let span = |from_m: f64, to_m: f64, bottom_m: f64| {
        [
            Vector3::new(from_m, -0.5 * geometry.width_m, bottom_m),
            Vector3::new(to_m, 0.5 * geometry.width_m, top_m),
        ]
    };
    let front_m = geometry.length_m - geometry.rear_overhang_m;
    [
        span(-geometry.rear_overhang_m, 0.0, bumper_m),
        span(0.0, geometry.wheelbase_m, belly_m),
        span(geometry.wheelbase_m, front_m.max(geometry.wheelbase_m), bumper_m),
    ]
}

fn panel(low_m: &Vector3<f64>, high_m: &Vector3<f64>) -> Collider {
    let half_m = (high_m - low_m) * 0.5;
    let middle_m = (high_m + low_m) * 0.5;
    ColliderBuilder::cuboid(half_m.x, half_m.y, half_m.z)
        .translation(glam(&middle_m))
        .friction(PANEL_FRICTION)
        .density(0.0)
        .build()
}

impl Underside {
    fn of(low_m: &Vector3<f64>, high_m: &Vector3<f64>, spacing_m: f64) -> Self {
        let sides_m = [high_m.x - low_m.x, high_m.y - low_m.y];
        let steps = sides_m.map(|side_m| (side_m / spacing_m).ceil().max(1.0));
        Self {
            first_m: *low_m,
            spacing_m: [sides_m[0] / steps[0], sides_m[1] / steps[1]],
            n: steps.map(|steps| steps as usize + 1),
        }
    }

    /// Whether a point of it is less than `margin_m` above the ground.
    fn is_near(&self, motion: &BodyMotion, ground: &Ground, margin_m: f64) -> bool {
        let step_m = motion.axes[0] * self.spacing_m[0];
        let mut heights_m = [0.0; ROW_MAX];
        let heights_m = &mut heights_m[..self.n[0].min(ROW_MAX)];
        (0..self.n[1]).any(|row| {
            let left_m = Vector3::y() * (row as f64 * self.spacing_m[1]);
            let first_m = motion.point_m(&(self.first_m + left_m));
            ground.run_m([first_m.x, first_m.y], [step_m.x, step_m.y], heights_m);
            let mut above_m =
                heights_m.iter().enumerate().map(|(k, height_m)| first_m.z + k as f64 * step_m.z - height_m);
            above_m.any(|above_m| above_m < margin_m)
        })
    }
}

/// The ground as rapier's heightfield. That one is y-up, its rows along z and columns along x; turned by a right
/// angle about x, its rows run south and its diagonals from south-west to north-east, as the world's do.
fn heightfield(ground: &Ground) -> Collider {
    let [n_rows, n_cols] = ground.size();
    let [low_m, high_m] = ground.extent_m();
    let height = |index: usize| {
        let (row, col) = (n_rows - 1 - index % n_rows, index / n_rows);
        f64::from(ground.surface_m()[row * n_cols + col])
    };
    let heights = Array2::new(n_rows, n_cols, (0..n_rows * n_cols).map(height).collect());
    let scale = Vector::new(high_m[0] - low_m[0], 1.0, high_m[1] - low_m[1]);
    let middle = Vector::new(0.5 * (low_m[0] + high_m[0]), 0.5 * (low_m[1] + high_m[1]), 0.0);
    ColliderBuilder::heightfield(heights, scale)
        .rotation(Vector::X * std::f64::consts::FRAC_PI_2)
        .translation(middle)
        .friction(PANEL_FRICTION)
        .build()
}

fn rapier_pose(pose: &Isometry3<f64>) -> RapierPose {
    let q = pose.rotation.coords;
    RapierPose::from_parts(glam(&pose.translation.vector), Rotation::from_xyzw(q.x, q.y, q.z, q.w))
}

fn glam(vector: &Vector3<f64>) -> Vector {
    Vector::new(vector.x, vector.y, vector.z)
}

fn nalgebra(vector: Vector) -> Vector3<f64> {
    Vector3::new(vector.x, vector.y, vector.z)
}
