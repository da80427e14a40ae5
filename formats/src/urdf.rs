//! A vehicle's sizes and frames out of a URDF, the description that robots of ROS have of themselves.
//!
//! Joints stand at zero. Links are told in the frame of the centre of the rear axle, forward, left, up, which is where the
//! two hindmost wheels are; the description's own root has to look forward, as ROS asks for (REP 103).

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Isometry3, Point3, Translation3, Vector3};
use terrain::Pose;
use urdf_rs::{Geometry, Joint, JointType, Link, Robot};

/// Longest description that is read [bytes].
const LENGTH_MAX_BYTES: u64 = 1 << 24;
/// Frames that may follow one another.
const DEPTH_MAX: usize = 64;
/// Component of an axis along another from which on it is that one.
const ALONG: f64 = 0.9;

/// A URDF that describes no vehicle with four wheels. Every message is one line.
#[derive(Debug, thiserror::Error)]
pub enum UrdfError {
    /// The file could not be read.
    #[error("{file}: expected a readable URDF, found: {source}")]
    Unreadable {
        /// Path as given.
        file: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// It is longer than any description.
    #[error("{file}: expected at most {LENGTH_MAX_BYTES} bytes of URDF, found {found}")]
    TooLong {
        /// Path as given.
        file: String,
        /// Its length.
        found: u64,
    },
    /// It is no URDF.
    #[error("{file}: expected URDF, found: {problem}")]
    Syntax {
        /// Path as given.
        file: String,
        /// What the parser said.
        problem: String,
    },
    /// Its links are no tree.
    #[error(
        "{file}: expected a tree of at most {DEPTH_MAX} links up to the root, found more or a circle at {link:?}"
    )]
    NoTree {
        /// Path as given.
        file: String,
        /// Where.
        link: String,
    },
    /// It has another number of wheels.
    #[error("{file}: expected four wheels, continuous joints about the axis to the left, found {found}")]
    Wheels {
        /// Path as given.
        file: String,
        /// Their names.
        found: String,
    },
}

/// What a URDF tells of a vehicle.
#[derive(Clone, Debug, PartialEq)]
pub struct UrdfVehicle {
    /// Its name.
    pub name: String,
    /// From the rear to the front axle [m].
    pub wheelbase_m: f64,
    /// From the left to the right wheels [m].
    pub track_m: f64,
    /// Of a wheel that is no mesh [m].
    pub wheel_radius_m: Option<f64>,
    /// How far the front wheels turn to either side, where their joints have limits [rad].
    pub steering_max_rad: Option<f64>,
    /// How fast [rad/s].
    pub steering_rate_max_radps: Option<f64>,
    /// By what the wheels' joints are limited to [m/s].
    pub speed_max_mps: Option<f64>,
    /// Of all links but the wheels, where they say one [kg].
    pub mass_kg: Option<f64>,
    /// Where their centre of gravity lies [m].
    pub centre_of_gravity_m: Option<[f64; 3]>,
    /// The box around all collision bodies and wheels: its least and its greatest corner [m].
    pub extent_m: [[f64; 3]; 2],
    /// The lowest that hangs between the wheels [m].
    pub lowest_m: Option<f64>,
    /// Collision bodies that are meshes, whose size no description tells.
    pub n_meshes: usize,
    /// Where every link lies: place [m] and roll, pitch, yaw [rad].
    pub links: BTreeMap<String, Pose>,
}

impl UrdfVehicle {
    /// Reads a description.
    ///
    /// # Errors
    /// See [`UrdfError`].
    pub fn read(path: &Path) -> Result<Self, UrdfError> {
        let file = path.display().to_string();
        let unreadable = |source| UrdfError::Unreadable { file: file.clone(), source };
        let found = path.metadata().map_err(unreadable)?.len();
        if found > LENGTH_MAX_BYTES {
            return Err(UrdfError::TooLong { file, found });
        }
        let text = std::fs::read_to_string(path).map_err(unreadable)?;
        Self::parse(&file, &text)
    }

    /// The same of a text; `file` is the name used in messages.
    ///
    /// # Errors
    /// See [`UrdfError`].
    pub fn parse(file: &str, text: &str) -> Result<Self, UrdfError> {
        let robot = urdf_rs::read_from_string(text).map_err(|error| {
            let problem = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
            UrdfError::Syntax { file: file.to_owned(), problem }
        })?;
        let tree = Tree::new(&robot, file)?;
        let wheels = tree.wheels(file)?;
        Ok(tree.vehicle(&wheels))
    }
}

/// The links of a robot and where they lie in its root.
struct Tree<'a> {
    robot: &'a Robot,
    joint_above: BTreeMap<&'a str, &'a Joint>,
    places: BTreeMap<&'a str, Isometry3<f64>>,
}

/// A wheel: its joint, and its centre in the root [m].
struct Wheel<'a> {
    joint: &'a Joint,
    centre_m: Point3<f64>,
}

impl<'a> Tree<'a> {
    fn new(robot: &'a Robot, file: &str) -> Result<Self, UrdfError> {
        let joint_above: BTreeMap<&str, &Joint> =
            robot.joints.iter().map(|joint| (joint.child.link.as_str(), joint)).collect();
        let mut tree = Self { robot, joint_above, places: BTreeMap::new() };
        for link in &robot.links {
            let no_tree = || UrdfError::NoTree { file: file.to_owned(), link: link.name.clone() };
            let place = tree.place(&link.name).ok_or_else(no_tree)?;
            tree.places.insert(&link.name, place);
        }
        Ok(tree)
    }

    fn place(&self, link: &str) -> Option<Isometry3<f64>> {
        let (mut place, mut above) = (Isometry3::identity(), link);
        for _ in 0..DEPTH_MAX {
            let Some(joint) = self.joint_above.get(above) else { return Some(place) };
            place = motion(&joint.origin) * place;
            above = &joint.parent.link;
        }
        None
    }

    fn at(&self, link: &str) -> Isometry3<f64> {
        self.places.get(link).copied().unwrap_or_default()
    }

    /// A joint's axis in the root.
    fn axis(&self, joint: &Joint) -> Vector3<f64> {
        (self.at(&joint.child.link) * Vector3::from(joint.axis.xyz.0)).try_normalize(0.0).unwrap_or_default()
    }

    /// Rear wheels first.
    fn wheels(&self, file: &str) -> Result<[Wheel<'a>; 4], UrdfError> {
        let turns =
            |joint: &&Joint| joint.joint_type == JointType::Continuous && self.axis(joint).y.abs() > ALONG;
        let joints = self.robot.joints.iter().filter(turns);
        let centre = |joint: &'a Joint| Wheel {
            joint,
            centre_m: Point3::from(self.at(&joint.child.link).translation.vector),
        };
        let mut wheels: Vec<Wheel<'a>> = joints.map(centre).collect();
        wheels.sort_by(|one, other| one.centre_m.x.total_cmp(&other.centre_m.x));
        let names: Vec<&str> = wheels.iter().map(|wheel| wheel.joint.name.as_str()).collect();
        let found = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        wheels.try_into().map_err(|_| UrdfError::Wheels { file: file.to_owned(), found })
    }

    fn vehicle(&self, wheels: &[Wheel<'a>; 4]) -> UrdfVehicle {
        let [rear_left, rear_right, front_left, front_right] = wheels;
        let middle = |one: &Wheel<'_>, other: &Wheel<'_>| nalgebra::center(&one.centre_m, &other.centre_m);
        let rear = middle(rear_left, rear_right);
        let front = middle(front_left, front_right);
        let from_root = Translation3::from(-rear.coords);
        let wheel_radius_m =
            wheels.iter().filter_map(|wheel| self.radius_m(&wheel.joint.child.link)).reduce(f64::max);
        let [steering_max_rad, steering_rate_max_radps] = self.steering(&[front_left, front_right]);
        let (mass_kg, centre) =
            self.mass(wheels).map_or((None, None), |(mass, at)| (Some(mass), Some(from_root * at)));
        let mut extent = Extent::default();
        let (lowest_m, n_meshes) = self.bodies(wheels, &from_root.into(), &mut extent);
        for Wheel { centre_m, .. } in wheels {
            let reach = Vector3::new(1.0, 0.0, 1.0) * wheel_radius_m.unwrap_or(0.0);
            let centre_m = from_root * centre_m;
            extent.add(&(centre_m - reach));
            extent.add(&(centre_m + reach));
        }
        let links = self.places.iter().map(|(name, place)| ((*name).to_owned(), pose(&(from_root * place))));
        UrdfVehicle {
            name: self.robot.name.clone(),
            wheelbase_m: front.x - rear.x,
            track_m: (rear_left.centre_m.y - rear_right.centre_m.y).abs(),
            wheel_radius_m,
            steering_max_rad,
            steering_rate_max_radps,
            speed_max_mps: limit(wheels.iter().map(|wheel| wheel.joint.limit.velocity))
                .zip(wheel_radius_m)
                .map(|(rate_radps, radius_m)| rate_radps * radius_m),
            mass_kg,
            centre_of_gravity_m: centre.map(|centre| centre.into()),
            extent_m: [extent.least_m, extent.greatest_m],
            lowest_m,
            n_meshes,
            links: links.collect(),
        }
    }

    fn link(&self, name: &str) -> Option<&'a Link> {
        self.robot.links.iter().find(|link| link.name == name)
    }

    fn radius_m(&self, link: &str) -> Option<f64> {
        let link = self.link(link)?;
        let collisions = link.collision.iter().map(|body| &body.geometry);
        let shapes = collisions.chain(link.visual.iter().map(|body| &body.geometry));
        let radii = shapes.filter_map(|shape| match shape {
            Geometry::Cylinder { radius, .. } | Geometry::Sphere { radius } => Some(*radius),
            Geometry::Capsule { .. } | Geometry::Box { .. } | Geometry::Mesh { .. } => None,
        });
        radii.filter(|radius_m| *radius_m > 0.0).reduce(f64::max)
    }

    /// Angle and rate of the joints above the front wheels that turn about the axis up.
    fn steering(&self, front: &[&Wheel<'_>]) -> [Option<f64>; 2] {
        let above = |wheel: &&Wheel<'_>| self.joint_above.get(wheel.joint.parent.link.as_str()).copied();
        let turns =
            |joint: &&Joint| joint.joint_type == JointType::Revolute && self.axis(joint).z.abs() > ALONG;
        let joints: Vec<&Joint> = front.iter().filter_map(above).filter(turns).collect();
        let angle_rad = limit(joints.iter().map(|joint| joint.limit.upper.min(-joint.limit.lower)));
        [angle_rad, limit(joints.iter().map(|joint| joint.limit.velocity))]
    }

    fn mass(&self, wheels: &[Wheel<'_>; 4]) -> Option<(f64, Point3<f64>)> {
        let is_wheel = |link: &&Link| wheels.iter().any(|wheel| wheel.joint.child.link == link.name);
        let mut total = (0.0, Vector3::zeros());
        for link in self.robot.links.iter().filter(|link| !is_wheel(link)) {
            let mass_kg = link.inertial.mass.value;
            let centre = self.at(&link.name) * motion(&link.inertial.origin) * Point3::origin();
            total = (total.0 + mass_kg, total.1 + centre.coords * mass_kg);
        }
        let (mass_kg, moment) = total;
        (mass_kg > 0.0).then(|| (mass_kg, Point3::from(moment / mass_kg)))
    }

    /// Takes the collision bodies into the extent; returns the lowest of those that are no wheel, and how many are meshes.
    fn bodies(
        &self,
        wheels: &[Wheel<'_>; 4],
        from_root: &Isometry3<f64>,
        extent: &mut Extent,
    ) -> (Option<f64>, usize) {
        let (mut lowest_m, mut n_meshes): (Option<f64>, usize) = (None, 0);
        for link in &self.robot.links {
            let is_wheel = wheels.iter().any(|wheel| wheel.joint.child.link == link.name);
            for body in &link.collision {
                let Some(half_m) = half_size_m(&body.geometry) else {
                    n_meshes += 1;
                    continue;
                };
                let place = from_root * self.at(&link.name) * motion(&body.origin);
                for corner in corners(half_m) {
                    let corner = place * corner;
                    extent.add(&corner);
                    if !is_wheel {
                        lowest_m = Some(lowest_m.map_or(corner.z, |lowest_m: f64| lowest_m.min(corner.z)));
                    }
                }
            }
        }
        (lowest_m, n_meshes)
    }
}

/// A box along the axes.
struct Extent {
    least_m: [f64; 3],
    greatest_m: [f64; 3],
}

impl Default for Extent {
    fn default() -> Self {
        Self { least_m: [f64::INFINITY; 3], greatest_m: [f64::NEG_INFINITY; 3] }
    }
}

impl Extent {
    fn add(&mut self, place_m: &Point3<f64>) {
        for axis in 0..3 {
            self.least_m[axis] = self.least_m[axis].min(place_m[axis]);
            self.greatest_m[axis] = self.greatest_m[axis].max(place_m[axis]);
        }
    }
}

/// The least of some limits, where all of them are any.
fn limit(limits: impl Iterator<Item = f64>) -> Option<f64> {
    limits.reduce(f64::min).filter(|least| least.is_finite() && *least > 0.0)
}

fn motion(origin: &urdf_rs::Pose) -> Isometry3<f64> {
    let ([x_m, y_m, z_m], [roll_rad, pitch_rad, yaw_rad]) = (origin.xyz.0, origin.rpy.0);
    Pose { x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad }.isometry()
}

fn pose(place: &Isometry3<f64>) -> Pose {
    let [x_m, y_m, z_m] = place.translation.vector.into();
    let (roll_rad, pitch_rad, yaw_rad) = place.rotation.euler_angles();
    Pose { x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad }
}

fn half_size_m(shape: &Geometry) -> Option<Vector3<f64>> {
    match *shape {
        Geometry::Box { size } => Some(0.5 * Vector3::from(size.0)),
        Geometry::Cylinder { radius, length } => Some(Vector3::new(radius, radius, 0.5 * length)),
        Geometry::Capsule { radius, length } => Some(Vector3::new(radius, radius, 0.5 * length + radius)),
        Geometry::Sphere { radius } => Some(Vector3::repeat(radius)),
        Geometry::Mesh { .. } => None,
    }
}

fn corners(half_m: Vector3<f64>) -> impl Iterator<Item = Point3<f64>> {
    let signs =
        (0..8).map(|corner: u8| [0, 1, 2].map(|axis| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 }));
    signs.map(move |signs| Point3::from(half_m.component_mul(&Vector3::from(signs))))
}

#[cfg(test)]
mod tests;
