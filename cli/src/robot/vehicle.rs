//! The file of a vehicle: what its URDF tells in the text of the shipped vehicle that is most like it.

use std::collections::BTreeMap;

use formats::{UrdfVehicle, read_vehicle, shipped_vehicle_names, shipped_vehicle_text};

/// Sections that are of a robot; the others are of what simulates one.
const ASKED: [&str; 2] = ["geometry", "limits"];
const SIMULATED: &str = "# What follows is read by simulations alone.";

/// What each line that a URDF may leave open is.
const EXPECTED: [(&str, &str); 15] = [
    ("wheelbase_m", "from the rear to the front axle"),
    ("track_m", "from the left to the right wheels' middle"),
    ("length_m", "from end to end"),
    ("width_m", "from side to side"),
    ("rear_overhang_m", "from the rear axle to the rear end"),
    ("ground_clearance_m", "from level ground to the lowest part between the wheels"),
    ("wheel_radius_m", "of a wheel under its load"),
    ("speed_max_mps", "the greatest speed that it is to drive"),
    ("reverse_speed_max_mps", "the greatest speed backwards"),
    ("steering_max_rad", "the greatest angle of the front wheels"),
    ("steering_rate_max_radps", "how fast they turn"),
    ("acceleration_max_mps2", "how fast its speed changes"),
    ("lateral_acceleration_max_mps2", "well below what tips it over"),
    ("roll_max_rad", "the greatest roll that it may stand at"),
    ("pitch_max_rad", "the greatest pitch that it may stand at"),
];

/// A file, and the lines of it that somebody has to go through.
pub(super) struct Drafted {
    pub text: String,
    pub asked: Vec<String>,
}

/// The file of the vehicle that a URDF describes.
pub(super) fn drafted(urdf: &UrdfVehicle) -> Drafted {
    let shipped = nearest(urdf.wheelbase_m);
    let told = told(urdf);
    let mut text = format!(
        "# A vehicle out of a URDF. What it did not tell is that of {shipped}, to be gone through.\n"
    );
    text += &format!("name = {:?}\n", urdf.name);
    let (mut section, mut asked) = (String::new(), Vec::new());
    let lines = shipped_vehicle_text(shipped).unwrap_or_default().lines();
    for line in lines.skip_while(|line| !line.starts_with('[')) {
        let line = line.split('#').next().unwrap_or_default().trim_end();
        if let Some(name) = line.strip_prefix('[') {
            if section == "limits" {
                text += &format!("\n{SIMULATED}\n");
            }
            section = name.trim_end_matches(']').to_owned();
        }
        let key = line.split_once('=').map(|(key, _)| key.trim());
        let expected = key.and_then(|key| EXPECTED.iter().find(|(known, _)| *known == key));
        match (key.and_then(|key| told.get(&(section.as_str(), key))), expected) {
            (Some((value, of)), _) => text += &format!("{} = {value}  # {of}\n", key.unwrap_or_default()),
            (None, Some((key, expected))) if ASKED.contains(&section.as_str()) => {
                text += &format!("{line}  # expected: {expected}; this is {shipped}'s\n");
                asked.push(format!("{section}.{key}: expected {expected}, found {shipped}'s"));
            }
            (None, _) => text += &format!("{line}\n"),
        }
    }
    Drafted { text, asked }
}

/// The shipped vehicle of the nearest wheelbase, by its share.
fn nearest(wheelbase_m: f64) -> &'static str {
    let apart = |name: &&str| {
        let vehicle = read_vehicle(name).ok();
        vehicle.map_or(f64::INFINITY, |vehicle| (vehicle.geometry.wheelbase_m / wheelbase_m).ln().abs())
    };
    shipped_vehicle_names().min_by(|one, other| apart(one).total_cmp(&apart(other))).unwrap_or("rc_car")
}

/// Numbers by section and key, with where they come from.
fn told(urdf: &UrdfVehicle) -> BTreeMap<(&'static str, &'static str), (String, &'static str)> {
    let [least_m, greatest_m] = urdf.extent_m;
    let width_m = (2.0 * greatest_m[1].max(-least_m[1])).max(urdf.track_m);
    let length_m = (greatest_m[0] - least_m[0]).max(urdf.wheelbase_m - least_m[0].min(0.0));
    let bodies = "URDF: collision bodies";
    let numbers = [
        ("geometry", "wheelbase_m", Some(urdf.wheelbase_m), "URDF: wheels' joints"),
        ("geometry", "track_m", Some(urdf.track_m), "URDF: wheels' joints"),
        ("geometry", "length_m", Some(length_m), bodies),
        ("geometry", "width_m", Some(width_m), bodies),
        ("geometry", "rear_overhang_m", Some((-least_m[0]).max(0.0)), bodies),
        ("geometry", "ground_clearance_m", clearance_m(urdf), bodies),
        ("geometry", "wheel_radius_m", urdf.wheel_radius_m, "URDF: wheels' bodies"),
        ("limits", "speed_max_mps", urdf.speed_max_mps, "URDF: wheels' joints, at their radius"),
        ("limits", "steering_max_rad", urdf.steering_max_rad, "URDF: steering joints"),
        ("limits", "steering_rate_max_radps", urdf.steering_rate_max_radps, "URDF: steering joints"),
        ("body", "mass_kg", urdf.mass_kg, "URDF: inertias"),
        (
            "body",
            "cog_ahead_m",
            urdf.centre_of_gravity_m.map(|place_m| place_m[0].max(0.0)),
            "URDF: inertias",
        ),
        ("body", "cog_height_m", cog_height_m(urdf), "URDF: inertias"),
    ];
    let known = numbers.into_iter().filter_map(|(section, key, value, of)| {
        Some(((section, key), (format!("{:?}", rounded(value?)), of)))
    });
    known.collect()
}

fn clearance_m(urdf: &UrdfVehicle) -> Option<f64> {
    let clearance_m = urdf.lowest_m? + urdf.wheel_radius_m?;
    (clearance_m > 0.0).then_some(clearance_m)
}

fn cog_height_m(urdf: &UrdfVehicle) -> Option<f64> {
    let height_m = urdf.centre_of_gravity_m?[2] + urdf.wheel_radius_m?;
    (height_m > 0.0).then_some(height_m)
}

/// To the tenth of a millimetre: what stands behind that is the arithmetic's.
pub(super) fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4 + 0.0
}
