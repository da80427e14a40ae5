use super::*;

/// A car whose root lies in the middle of its floor, 0.02 m above the axles: wheels at 0.5 and -0.3 m, a body, a lidar that
/// hangs upside down from an arm, and a camera that is a mesh.
const CAR: &str = include_str!("../../../examples/ros/car.urdf");

fn car() -> UrdfVehicle {
    UrdfVehicle::parse("car.urdf", CAR).unwrap()
}

fn close(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-9, "{found} {expected}");
}

#[test]
fn sizes_and_limits_are_those_of_wheels_and_joints() {
    let car = car();
    assert_eq!(car.name, "car");
    close(car.wheelbase_m, 0.5);
    close(car.track_m, 0.4);
    close(car.wheel_radius_m.unwrap(), 0.1);
    // The right wheel's joint is limited to less than the left one's.
    close(car.steering_max_rad.unwrap(), 0.45);
    close(car.steering_rate_max_radps.unwrap(), 3.0);
    // 20 rad/s on 0.1 m.
    close(car.speed_max_mps.unwrap(), 2.0);
}

#[test]
fn links_lie_where_they_are_from_the_rear_axle() {
    let car = car();
    let lidar = car.links["lidar"];
    [lidar.x_m, lidar.y_m, lidar.z_m].into_iter().zip([0.4, 0.0, 0.5]).for_each(|(a, b)| close(a, b));
    close(lidar.roll_rad.abs(), std::f64::consts::PI);
    let axle = car.links["rear_axle"];
    [axle.x_m, axle.y_m, axle.z_m, axle.yaw_rad].into_iter().for_each(|number| close(number, 0.0));
    close(car.links["base_link"].x_m, 0.25);
}

#[test]
fn bodies_and_masses_are_added_up() {
    let car = car();
    let [least, greatest] = car.extent_m;
    // The floor is 0.8 m long and 0.3 m wide about x = 0.25; wheels stand 0.05 m wide at 0.2 m.
    [least[0], greatest[0]].into_iter().zip([-0.15, 0.65]).for_each(|(a, b)| close(a, b));
    [least[1], greatest[1]].into_iter().zip([-0.225, 0.225]).for_each(|(a, b)| close(a, b));
    close(least[2], -0.1);
    close(car.lowest_m.unwrap(), -0.03);
    close(car.mass_kg.unwrap(), 8.0);
    let [x_m, _, z_m] = car.centre_of_gravity_m.unwrap();
    // Of the floor, 0.02 m above the axles in the middle: wheels count for themselves.
    close(x_m, 0.25);
    close(z_m, 0.02);
    assert_eq!(car.n_meshes, 1);
}

#[test]
fn what_is_not_told_is_left_open() {
    let without = |from: &str, to: &str| {
        assert!(CAR.contains(from), "{from}");
        UrdfVehicle::parse("car.urdf", &CAR.replace(from, to)).unwrap()
    };
    let meshes = without("<cylinder radius=\"0.1\" length=\"0.05\"/>", "<mesh filename=\"wheel.stl\"/>");
    assert_eq!((meshes.wheel_radius_m, meshes.speed_max_mps, meshes.n_meshes), (None, None, 5));
    let fixed = without("type=\"revolute\"", "type=\"fixed\"");
    assert_eq!((fixed.steering_max_rad, fixed.steering_rate_max_radps), (None, None));
}

#[test]
fn what_is_no_vehicle_is_refused() {
    let told = |text: &str| UrdfVehicle::parse("car.urdf", text).unwrap_err().to_string();
    let three = CAR.replacen("type=\"continuous\"", "type=\"fixed\"", 1);
    let told_of = told(&three);
    assert!(told_of.starts_with("car.urdf: expected four wheels, continuous joints"), "{told_of}");
    assert!(
        told_of.ends_with("found rear_right_wheel_joint, front_left_wheel_joint, front_right_wheel_joint"),
        "{told_of}"
    );
    assert!(told("<robot name='a'><link name='b'/></robot>").ends_with("found none"));
    let torn = told(&CAR[..CAR.len() / 2]);
    assert!(torn.starts_with("car.urdf: expected URDF, found: ") && !torn.contains('\n'), "{torn}");
    let circle = "<robot name='a'><link name='b'/><link name='c'/>\
        <joint name='d' type='fixed'><parent link='b'/><child link='c'/></joint>\
        <joint name='e' type='fixed'><parent link='c'/><child link='b'/></joint></robot>";
    assert!(told(circle).contains("found more or a circle at \"b\""), "{}", told(circle));
}
