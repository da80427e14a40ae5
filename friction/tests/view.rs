//! Pictures that friction cannot be seen in, weights that are none, and slopes of smoothed heights.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use friction::{CHANNELS, Network, View};

fn view() -> View {
    let (n_rows, n_cols) = (20, 24);
    let rise = (0..n_rows * n_cols).map(|pixel| 0.02 * (pixel % n_cols) as f32);
    let values = vec![0.5; 3 * n_rows * n_cols].into_iter().chain(rise).collect();
    View { resolution_m: 0.5, south_west_m: [-5.0, 10.0], n_rows, n_cols, values }
}

#[test]
fn a_picture_without_colour_or_with_other_pixels_or_holes_is_refused() {
    let network = Network::new(0.5, 1).unwrap();
    let refused = |change: &dyn Fn(&mut View)| {
        let mut view = view();
        change(&mut view);
        network.see(&view).unwrap_err().to_string()
    };
    let n = 20 * 24;
    let grey = refused(&|view| {
        view.values.drain(..3 * n);
    });
    assert_eq!(
        grey,
        "view: expected 4 channels (red, green, blue, height) of 20 x 24 pixels, found 480 numbers"
    );
    let coarse = refused(&|view| view.resolution_m = 1.0);
    assert_eq!(coarse, "view: expected pixels of 0.5 m, found 1 m");
    let hole = refused(&|view| view.values[3 * n + 24 + 2] = f32::NAN);
    assert_eq!(hole, "view: height at row 1, column 2: expected a finite height, found NaN");
    let bright = refused(&|view| view.values[n] = 255.0);
    assert_eq!(bright, "view: green at row 0, column 0: expected 0 to 1, found 255");
    let endless = refused(&|view| view.resolution_m = f64::NAN);
    assert!(endless.starts_with("view: expected pixels of"), "{endless}");
}

#[test]
fn every_pixel_gets_coefficients_within_bounds_whatever_the_size_of_the_picture() {
    let seen = Network::new(0.5, 1).unwrap().see(&view()).unwrap();
    assert_eq!(seen.len(), 20 * 24);
    for [statics, sliding, viscous, speed] in seen {
        assert!((0.02..=1.3).contains(&statics) && (0.02..=1.1).contains(&sliding));
        assert!((0.0..=0.04).contains(&viscous) && (0.2..=10.0).contains(&speed));
    }
    assert_eq!(CHANNELS, 4);
}

/// 0.02 m a pixel of 0.5 m is a rise of 0.04.
#[test]
fn slopes_are_those_of_a_plane() {
    let view = view();
    let [east, north] = view.slopes().at(&view, [1.0, 15.0]);
    assert!((east - 0.04).abs() < 0.002 && north.abs() < 1e-6, "{east} {north}");
    assert_eq!(view.pixel([-4.9, 10.6]), [1, 0]);
    assert_eq!(view.pixel([1e9, -1e9]), [0, 23]);
}

#[test]
fn weights_come_back_as_they_were_and_others_are_refused() {
    let network = Network::new(0.5, 7).unwrap();
    let again = Network::from_bytes(&network.to_bytes().unwrap()).unwrap();
    assert_eq!(network.see(&view()).unwrap(), again.see(&view()).unwrap());
    assert_ne!(network.see(&view()).unwrap(), Network::new(0.5, 8).unwrap().see(&view()).unwrap());
    assert!(Network::from_bytes(b"nothing").is_err());
    let empty =
        safetensors::serialize(Vec::<(String, safetensors::tensor::TensorView<'_>)>::new(), None).unwrap();
    let told = Network::from_bytes(&empty).err().unwrap().to_string();
    assert_eq!(told, "weights: resolution_m: expected a number of metres, found None");
}
