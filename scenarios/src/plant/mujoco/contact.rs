//! What MuJoCo's contacts do to wheels and body.

use mujoco_rs::prelude::{MjData, MjModel};
use mujoco_rs::wrappers::mj_auxiliary::MjContact;
use nalgebra::Vector3;

/// Where the ground pushes, and how.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    /// Of a wheel, if the ground pushes that and not the body.
    pub wheel: Option<usize>,
    /// In map coordinates [m].
    pub point_m: Vector3<f64>,
    /// Unit vector out of the ground.
    pub normal: Vector3<f64>,
    /// Normal force [N].
    pub load_n: f64,
    /// Force on wheel or body in map coordinates [N].
    pub force_n: Vector3<f64>,
}

/// All contacts of the last step that push. `ground` and `wheels` are numbers of geoms.
pub(super) fn touches(data: &MjData<Box<MjModel>>, ground: usize, wheels: &[usize; 4]) -> Vec<Touch> {
    let contacts = data.contact().iter().enumerate();
    contacts.filter_map(|(number, contact)| touch(data, number, contact, ground, wheels)).collect()
}

fn touch(
    data: &MjData<Box<MjModel>>,
    number: usize,
    contact: &MjContact,
    ground: usize,
    wheels: &[usize; 4],
) -> Option<Touch> {
    let force = data.try_contact_force(number).ok()?;
    // The frame's first axis points from the first geom to the second, and the force is that on the second.
    let [first, second] = contact.geom.map(|geom| geom as usize);
    let (sign, other) = if first == ground { (1.0, second) } else { (-1.0, first) };
    let axis =
        |i: usize| Vector3::new(contact.frame[3 * i], contact.frame[3 * i + 1], contact.frame[3 * i + 2]);
    let force_n = (axis(0) * force[0] + axis(1) * force[1] + axis(2) * force[2]) * sign;
    (force[0] > 0.0).then(|| Touch {
        wheel: wheels.iter().position(|wheel| *wheel == other),
        point_m: Vector3::from(contact.pos),
        normal: axis(0) * sign,
        load_n: force[0],
        force_n,
    })
}
