//! One wheel on its strut: travel, spin, and the forces it hands to the body.

use bicycle::Vehicle;
use nalgebra::{Vector2, Vector3};

use super::chassis::{BodyMotion, Wrench};
use super::drivetrain::WheelTorque;
use super::envelope::{CONTACTS, Contact, Disc, Envelope};
use super::ground::Ground;
use super::rest::Rest;
use super::strut::Strut;
use super::tyre::{Bristles, Footing, Tyre};
use super::vegetation::{Immersion, Stems, plants_above_m};
use crate::Deviation;

/// Radial damping of the tyre over critical for the wheel [-].
const TYRE_DAMPING: f64 = 0.05;

/// Hub of a wheel and the directions of strut and steering, in map coordinates.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WheelFrame {
    pub hub_m: Vector3<f64>,
    /// Rolling direction.
    forward: Vector3<f64>,
    /// Along the axle.
    left: Vector3<f64>,
    /// Along the strut.
    up: Vector3<f64>,
}

/// State of one wheel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wheel {
    /// Hub in the body frame at rest [m].
    hub_m: Vector3<f64>,
    /// Travel of the strut from rest, upwards [m].
    pub travel_m: f64,
    travel_mps: f64,
    /// Turning about the axle in space, forward positive [rad/s].
    turning_radps: f64,
    /// Turning relative to the body [rad/s].
    pub spin_radps: f64,
    /// Inertia that the wheel opposed to torques in the last step, the ground's hold on it included [kg m2].
    pub inertia_kgm2: f64,
    /// Along the axle.
    pub left: Vector3<f64>,
    touches: [Option<Touch>; CONTACTS],
    stems: Stems,
    /// How much firmer than loose the ground under it is, by what went over it before [-].
    pub firmness: f64,
    /// Normal force of the ground [N].
    pub load_n: f64,
    /// Normal and friction force of the ground in map coordinates [N].
    pub force_n: Vector3<f64>,
}

/// A place where a wheel touches the ground.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch {
    pub contact: Contact,
    bristles: Bristles,
    /// Normal and friction force of the ground in map coordinates [N].
    pub force_n: Vector3<f64>,
}

/// What acts on one wheel from the vehicle's side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WheelInput {
    pub steering_rad: f64,
    pub torque: WheelTorque,
    /// Force of the anti-roll bar between body and wheel [N].
    pub anti_roll_n: f64,
}

/// What a wheel is made of.
pub(crate) struct RunningGear {
    pub envelope: Envelope,
    tyre: Tyre,
    mass_kg: f64,
    spin_inertia_kgm2: f64,
    radius_m: f64,
    clearance_m: f64,
    rolling_resistance: f64,
    reference_load_n: f64,
    radial_n_per_m: f64,
    radial_ns_per_m: f64,
    vegetation_density: f64,
    step_s: f64,
}

/// How the tread moves over the ground.
struct Slide {
    forward: Vector3<f64>,
    left: Vector3<f64>,
    slip_mps: Vector2<f64>,
    rolling_radius_m: f64,
    load_n: f64,
    /// Of the ground [-].
    firmness: f64,
}

/// What the ground does to a wheel.
#[derive(Default)]
struct Stand {
    /// Force on the hub [N].
    force_n: Vector3<f64>,
    /// Its moment about the hub [N m].
    moment_nm: Vector3<f64>,
    /// Sum of the normal forces [N].
    load_n: f64,
    /// Friction's torque against the wheel's turning [N m].
    grip_nm: f64,
    /// Its growth with the turning within a step [N m s].
    grip_nms: f64,
    /// Rolling resistance [N m].
    resistance_nm: f64,
}

impl Wheel {
    pub(crate) fn at(hub_m: Vector3<f64>) -> Self {
        Self {
            hub_m,
            travel_m: 0.0,
            travel_mps: 0.0,
            turning_radps: 0.0,
            spin_radps: 0.0,
            inertia_kgm2: 0.0,
            left: Vector3::y(),
            touches: [None; CONTACTS],
            stems: Stems::default(),
            firmness: 1.0,
            load_n: 0.0,
            force_n: Vector3::zeros(),
        }
    }

    /// Where the ground pushes.
    pub(crate) fn touches(&self) -> impl Iterator<Item = &Touch> {
        self.touches.iter().flatten()
    }

    /// Where the ground pushes most.
    pub(crate) fn heaviest(&self) -> Option<Contact> {
        let heavier = |a: &&Touch, b: &&Touch| a.contact.force_n.total_cmp(&b.contact.force_n);
        self.touches().max_by(heavier).map(|touch| touch.contact)
    }

    /// What of the ground's force lies in the ground, in map coordinates [N].
    pub(crate) fn friction_n(&self) -> Vector3<f64> {
        let in_ground_n = |touch: &Touch| {
            let normal = touch.contact.normal;
            touch.force_n - normal * touch.force_n.dot(&normal)
        };
        self.touches().map(in_ground_n).sum()
    }

    /// Takes new contacts; the tread is bent in each as it was in the one that pushed from the nearest direction.
    fn touch(&mut self, contacts: [Option<Contact>; CONTACTS]) {
        let before = self.touches;
        self.touches = contacts.map(|contact| {
            let contact = contact?;
            let along = |touch: &&Touch| touch.contact.normal.dot(&contact.normal);
            let nearest = before.iter().flatten().max_by(|a, b| along(a).total_cmp(&along(b)));
            let bristles = nearest.map_or_else(Bristles::default, |touch| touch.bristles);
            Some(Touch { contact, bristles, force_n: Vector3::zeros() })
        });
    }

    /// Turns by a torque between this wheel and others for a step, which pushes back on the body that carries both.
    pub(crate) fn couple(&mut self, torque_nm: f64, step_s: f64, wrench: &mut Wrench) {
        let change_radps = torque_nm * step_s / self.inertia_kgm2;
        self.turning_radps += change_radps;
        self.spin_radps += change_radps;
        wrench.torque_nm -= self.left * torque_nm;
    }

    /// Where the wheel is on a body that moves so.
    pub(crate) fn frame(&self, body: &BodyMotion, steering_rad: f64) -> WheelFrame {
        let [ahead, left, up] = body.axes;
        let (sin, cos) = steering_rad.sin_cos();
        WheelFrame {
            hub_m: body.point_m(&(self.hub_m + Vector3::z() * self.travel_m)),
            forward: ahead * cos + left * sin,
            left: left * cos - ahead * sin,
            up,
        }
    }
}

impl RunningGear {
    /// Of a vehicle that stands like `rest` as its description has it.
    pub(crate) fn new(vehicle: &Vehicle, rest: &Rest, cell_m: f64, step_s: f64) -> Self {
        let radial_n_per_m = vehicle.tyre.radial_stiffness_n_per_m;
        let reference_load_n = 0.25 * rest.mass_kg * super::GRAVITY_MPS2;
        let radius_m = vehicle.geometry.wheel_radius_m;
        let width_m = vehicle.wheel.width_m;
        Self {
            envelope: Envelope::new(radius_m, width_m, radial_n_per_m, reference_load_n, cell_m),
            tyre: Tyre::new(vehicle, reference_load_n),
            mass_kg: vehicle.wheel.mass_kg,
            spin_inertia_kgm2: vehicle.wheel.spin_inertia_kgm2,
            radius_m,
            clearance_m: vehicle.geometry.ground_clearance_m,
            rolling_resistance: vehicle.tyre.rolling_resistance,
            reference_load_n,
            radial_n_per_m,
            radial_ns_per_m: 2.0 * TYRE_DAMPING * (radial_n_per_m * vehicle.wheel.mass_kg).sqrt(),
            vegetation_density: 1.0,
            step_s,
        }
    }

    /// The same under wheel `index` of a machine that departs from it.
    pub(crate) fn deviating(mut self, deviations: &[Deviation], index: usize) -> Self {
        self.tyre = self.tyre.deviating(deviations, index);
        for deviation in deviations {
            if let Deviation::DenseVegetation { factor } = deviation {
                self.vegetation_density *= factor;
            }
        }
        self
    }

    /// Advances a wheel by a step and adds its forces on the body to `wrench`.
    pub(crate) fn step(
        &self,
        (wheel, strut): (&mut Wheel, &Strut),
        input: &WheelInput,
        body: &BodyMotion,
        ground: &Ground,
        wrench: &mut Wrench,
    ) {
        let frame = wheel.frame(body, input.steering_rad);
        wheel.left = frame.left;
        let hub_mps = body.velocity_at_mps(&frame.hub_m) + frame.up * wheel.travel_mps;
        let body_radps = body.angular_radps.dot(&frame.left);
        let disc = Disc::new(frame.hub_m, frame.left);
        wheel.touch(disc.map_or([None; CONTACTS], |disc| self.envelope.touch(ground, &disc)));
        let stand = self.stand(wheel, &frame, &hub_mps, body, ground);
        wheel.force_n = stand.force_n;
        wheel.load_n = stand.load_n;
        let shaft_nm = self.turn(wheel, &stand, &input.torque, body_radps);
        // About its own axle the wheel turns freely: there the body feels the shaft and nothing else.
        wrench.torque_nm += stand.moment_nm - frame.left * (stand.moment_nm.dot(&frame.left) + shaft_nm);
        // Along the strut the body feels the spring and nothing else.
        let along_n = stand.force_n.dot(&frame.up);
        let strut_n = self.stroke(wheel, strut, along_n - input.anti_roll_n) + input.anti_roll_n;
        let stems_n = self.stems_n(wheel, &frame, &hub_mps, ground);
        wrench.add_at(stand.force_n + frame.up * (strut_n - along_n) + stems_n, &frame.hub_m, body);
    }

    fn slide(
        &self,
        wheel: &Wheel,
        contact: &Contact,
        frame: &WheelFrame,
        hub_mps: &Vector3<f64>,
        body: &BodyMotion,
    ) -> Slide {
        let forward = frame.left.cross(&contact.normal).normalize();
        let left = contact.normal.cross(&forward);
        // All of the body's turning but that about the axle, which is the wheel's own.
        let carrier_radps = body.angular_radps - frame.left * body.angular_radps.dot(&frame.left);
        let carried_mps = hub_mps + carrier_radps.cross(&(contact.point_m - frame.hub_m));
        let rolling_radius_m = self.envelope.rolling_radius_m(contact.loaded_radius_m);
        let tread_mps = wheel.turning_radps * rolling_radius_m;
        let slip_mps = Vector2::new(carried_mps.dot(&forward) - tread_mps, carried_mps.dot(&left));
        let damping_ns_per_m = self.radial_ns_per_m * (contact.force_n / self.reference_load_n).min(1.0);
        let load_n = (contact.force_n - damping_ns_per_m * hub_mps.dot(&contact.normal)).max(0.0);
        Slide { forward, left, slip_mps, rolling_radius_m, load_n, firmness: wheel.firmness }
    }

    /// What the ground does in all places.
    fn stand(
        &self,
        wheel: &mut Wheel,
        frame: &WheelFrame,
        hub_mps: &Vector3<f64>,
        body: &BodyMotion,
        ground: &Ground,
    ) -> Stand {
        let mut touches = wheel.touches;
        let mut stand = Stand::default();
        for touch in touches.iter_mut().flatten() {
            let slide = self.slide(wheel, &touch.contact, frame, hub_mps, body);
            self.stand_in(touch, wheel.spin_radps, &slide, ground, &mut stand);
            stand.moment_nm += (touch.contact.point_m - frame.hub_m).cross(&touch.force_n);
        }
        wheel.touches = touches;
        stand
    }

    /// Adds what the ground does in one of them.
    fn stand_in(
        &self,
        touch: &mut Touch,
        spin_radps: f64,
        slide: &Slide,
        ground: &Ground,
        stand: &mut Stand,
    ) {
        let contact = &touch.contact;
        let soil = ground.patch(contact.point_m.x, contact.point_m.y);
        let footing = Footing {
            slip_mps: slide.slip_mps,
            rolling_mps: spin_radps * slide.rolling_radius_m,
            load_n: slide.load_n,
            friction: soil.friction,
            shear_deformation_m: f64::from(soil.shear_deformation_m) / slide.firmness,
        };
        let grip = self.tyre.grip(&mut touch.bristles, &footing, self.step_s);
        touch.force_n =
            contact.normal * slide.load_n + slide.forward * grip.force_n.x + slide.left * grip.force_n.y;
        let resistance = self.rolling_resistance + f64::from(soil.rolling_resistance);
        stand.force_n += touch.force_n;
        stand.load_n += slide.load_n;
        stand.grip_nm += grip.force_n.x * slide.rolling_radius_m;
        stand.grip_nms += grip.stiffness_ns_per_m * slide.rolling_radius_m * slide.rolling_radius_m;
        stand.resistance_nm += resistance * slide.load_n * slide.rolling_radius_m;
    }

    /// Force of obstacles on a wheel in map coordinates [N].
    pub(crate) fn obstacle_force_n(&self, wheel: &Wheel, ground: &Ground) -> Vector3<f64> {
        let of_obstacles = wheel.touches().filter(|touch| {
            // The face that pushes may begin as far behind the contact as the ground is asked for.
            let place_m = touch.contact.point_m - touch.contact.normal * self.envelope.spacing_m();
            ground.is_obstacle(place_m.x, place_m.y)
        });
        of_obstacles.map(|touch| touch.force_n).sum()
    }

    /// Turns the wheel by a step, implicitly in the slip, and gives the torque of the shaft on the wheel [N m].
    fn turn(&self, wheel: &mut Wheel, stand: &Stand, torque: &WheelTorque, body_radps: f64) -> f64 {
        let inertia_kgm2 = self.spin_inertia_kgm2 + self.step_s * stand.grip_nms;
        wheel.inertia_kgm2 = inertia_kgm2;
        let free_radps = wheel.turning_radps + self.step_s * (torque.drive_nm - stand.grip_nm) / inertia_kgm2;
        // Brake and rolling resistance stop the wheel at most; they do not turn it back.
        let most_nm = torque.brake_nm + stand.resistance_nm;
        let stopping_nm = -inertia_kgm2 * (free_radps - body_radps) / self.step_s;
        let retarding_nm = stopping_nm.clamp(-most_nm, most_nm);
        wheel.turning_radps = free_radps + self.step_s * retarding_nm / inertia_kgm2;
        wheel.spin_radps = if retarding_nm == stopping_nm { 0.0 } else { wheel.turning_radps - body_radps };
        let braking_nm = if most_nm > 0.0 { retarding_nm * torque.brake_nm / most_nm } else { 0.0 };
        torque.drive_nm + braking_nm
    }

    /// Moves the strut by a step, implicitly in its own and the tyre's stiffness, and gives its force [N].
    fn stroke(&self, wheel: &mut Wheel, strut: &Strut, load_n: f64) -> f64 {
        let [force_n, stiffness_n_per_m, damping_ns_per_m] = strut.law(wheel.travel_m);
        let touches = wheel.touches().next().is_some();
        let tyre_n_per_m = if touches { self.radial_n_per_m } else { 0.0 };
        let inertia_kg = self.mass_kg
            + self.step_s * (damping_ns_per_m + self.step_s * (stiffness_n_per_m + tyre_n_per_m));
        wheel.travel_mps = (self.mass_kg * wheel.travel_mps + self.step_s * (load_n - force_n)) / inertia_kg;
        wheel.travel_m += self.step_s * wheel.travel_mps;
        force_n + (self.step_s * stiffness_n_per_m + damping_ns_per_m) * wheel.travel_mps
    }

    fn stems_n(
        &self,
        wheel: &mut Wheel,
        frame: &WheelFrame,
        hub_mps: &Vector3<f64>,
        ground: &Ground,
    ) -> Vector3<f64> {
        // Plants are met at the leading edge of the wheel.
        let ahead_m = self.radius_m.copysign(hub_mps.dot(&frame.forward));
        let edge_m = frame.hub_m + frame.forward * ahead_m;
        let immersion = Immersion {
            height_m: plants_above_m(ground, edge_m.xy(), frame.hub_m.z - self.radius_m),
            diameter_m: 2.0 * self.radius_m,
            clearance_m: self.clearance_m,
            density: self.vegetation_density,
        };
        let force_n = wheel.stems.push_n(&immersion, hub_mps.xy(), self.reference_load_n, self.step_s);
        Vector3::new(force_n.x, force_n.y, 0.0)
    }
}
