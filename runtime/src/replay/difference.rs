//! Where two tellings of the same localisation differ.

use bus::message::SurfaceHeader;

/// A field, its bits, and how it is told.
type Field = (&'static str, Vec<u64>, String);

/// The first field of the localisation in which two headers differ, to the bit, with what was expected and found.
pub(super) fn first(expected: &SurfaceHeader, found: &SurfaceHeader) -> Option<String> {
    let differs = |(expected, found): &(Field, Field)| expected.1 != found.1;
    let (expected, found) = fields(expected).into_iter().zip(fields(found)).find(differs)?;
    Some(format!("expected {} {}, found {}", expected.0, expected.2, found.2))
}

fn fields(header: &SurfaceHeader) -> [Field; 12] {
    let time = |name, at_ns: u64| (name, vec![at_ns], at_ns.to_string());
    let numbers = |name, numbers: &[f64]| {
        (name, numbers.iter().map(|number| number.to_bits()).collect(), format!("{numbers:?}"))
    };
    let odometry = &header.odometry;
    [
        time("odometry_at_ns", header.odometry_at_ns),
        numbers("odometry.position_m", &odometry.position_m),
        numbers("odometry.attitude_rad", &odometry.attitude_rad),
        numbers("odometry.velocity_mps", &odometry.velocity_mps),
        numbers("odometry.yaw_rate_radps", &[odometry.yaw_rate_radps]),
        numbers("odometry.wheel_speed_mps", &[odometry.wheel_speed_mps]),
        numbers("odometry.steering_rad", &[odometry.steering_rad]),
        time("frame_at_ns", header.frame_at_ns),
        numbers("jump_m", &header.jump_m),
        numbers("jump_yaw_rad", &[header.jump_yaw_rad]),
        numbers("shift_m", &header.shift_m),
        numbers("shift_yaw_rad", &[header.shift_yaw_rad]),
    ]
}
