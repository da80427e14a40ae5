//! Recordings come back as they were; what is none is refused with what was expected and found.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use friction::{Moment, Recording, View};

fn recording() -> Recording {
    let (n_rows, n_cols) = (6, 5);
    let values = (0..4 * n_rows * n_cols).map(|index| index as f32 / 200.0).collect();
    let view = View { resolution_m: 0.5, south_west_m: [-1.0, 2.0], n_rows, n_cols, values };
    let moment = |index: usize| Moment {
        time_s: 0.02 * index as f64,
        at_m: [0.1 * index as f64, 2.5],
        yaw_rad: 0.01,
        velocity_mps: [5.0, 0.1],
        yaw_radps: 0.2,
        edge_mps: [5.0, 5.1, 5.2, 5.3],
        steering_rad: 0.05,
        felt: [0.3, 1.0, 0.21],
    };
    Recording { view, classes: Some(vec![6; n_rows * n_cols]), moments: (0..130).map(moment).collect() }
}

#[test]
fn a_recording_comes_back_as_it_was() {
    let with = recording();
    assert_eq!(Recording::from_bytes(&with.to_bytes().unwrap()).unwrap(), with);
    let without = Recording { classes: None, ..with };
    assert_eq!(Recording::from_bytes(&without.to_bytes().unwrap()).unwrap(), without);
}

#[test]
fn what_is_no_recording_is_refused() {
    let refused = |change: &dyn Fn(&mut Recording)| {
        let mut recording = recording();
        change(&mut recording);
        recording.to_bytes().unwrap_err().to_string()
    };
    let grey = refused(&|recording| recording.view.values.truncate(30));
    assert!(grey.starts_with("view: expected 4 channels (red, green, blue, height) of 6 x 5"), "{grey}");
    let unknown = refused(&|recording| recording.classes = Some(vec![7; 30]));
    assert_eq!(unknown, "recording: classes: expected 0 to 6, found 7");
    let few = refused(&|recording| recording.classes = Some(vec![0; 29]));
    assert_eq!(few, "recording: classes: expected one for each of 30 pixels, found 29");
    let nan = refused(&|recording| recording.moments[3].felt[1] = f64::NAN);
    assert_eq!(nan, "recording: moments: expected finite numbers, found others in row 4");
    let back = refused(&|recording| recording.moments[9].time_s = 0.0);
    assert!(back.contains("equally far apart"), "{back}");
    let hole = refused(&|recording| recording.view.values[3 * 30] = f32::INFINITY);
    assert_eq!(hole, "view: height at row 0, column 0: expected a finite height, found inf");
    assert!(Recording::from_bytes(b"no safetensors at all").is_err());
    let empty =
        safetensors::serialize(Vec::<(String, safetensors::tensor::TensorView<'_>)>::new(), None).unwrap();
    let told = Recording::from_bytes(&empty).unwrap_err().to_string();
    assert_eq!(told, "recording: image: expected F32 [4, any, any], found no such tensor");
}
