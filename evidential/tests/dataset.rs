//! Datasets: what is refused, and that bytes bring back every bit.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use bicycle::Geometry;
use bicycle::lanes::Instructions;
use evidential::{
    Dataset, DatasetError, DatasetFileError, DatasetOrigin, Example, FeatureLayout, Label, Surveyor,
};
use physics_prior::PriorConfig;
use proptest::prelude::*;
use terrain::{GridGeometry, GridMap, SurfaceCell, TerrainClass};
use traversability::{Bins, Pmf};

/// 3.4 m by 1.8 m.
const GEOMETRY: Geometry = Geometry {
    wheelbase_m: 2.5,
    track_m: 1.55,
    length_m: 3.4,
    width_m: 1.8,
    rear_overhang_m: 0.45,
    ground_clearance_m: 0.42,
    wheel_radius_m: 0.45,
};

fn layout() -> FeatureLayout {
    FeatureLayout::for_vehicle(&GEOMETRY)
}

/// Two drives of four examples, different in every number.
fn dataset() -> Dataset {
    let example = |k: u16| {
        let share = f32::from(k) / 10.0;
        let prior = Pmf::interpolated(&Bins::TRACTION, share).unwrap();
        Example {
            features: (0..layout().n_features()).map(|i| i as f32 * 0.1 - share).collect(),
            measured: [
                share,
                if k.is_multiple_of(2) { f32::NAN } else { 1.0 - share },
                0.5 * share,
                0.3 * share,
            ],
            prior: [*prior.probabilities(); 4],
            unevenness_m: 0.01 * f32::from(k + 1),
            drive: u32::from(k) / 4,
            pose: [f64::from(k), -0.1 * f64::from(k), 1e-9 * f64::from(k)],
        }
    };
    let origin = DatasetOrigin {
        vehicle: "crawler".to_owned(),
        layout: layout(),
        prior: PriorConfig::for_vehicle(&GEOMETRY),
        drives: vec!["first".to_owned(), "second".to_owned()],
        provenance: "made by hand".to_owned(),
    };
    Dataset { origin, examples: (0..8).map(example).collect() }
}

/// Equal bit by bit, NaN included.
fn assert_same(a: &Dataset, b: &Dataset) {
    assert_eq!(a.origin, b.origin);
    assert_eq!(a.examples.len(), b.examples.len());
    for (a, b) in a.examples.iter().zip(&b.examples) {
        let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&a.features), bits(&b.features));
        assert_eq!(bits(&a.measured), bits(&b.measured));
        assert_eq!((a.prior, a.unevenness_m, a.drive, a.pose), (b.prior, b.unevenness_m, b.drive, b.pose));
    }
}

#[test]
fn bytes_bring_back_every_bit_and_are_the_same_every_time() {
    let dataset = dataset();
    let bytes = dataset.to_bytes().unwrap();
    assert_same(&Dataset::from_bytes(&bytes).unwrap(), &dataset);
    assert_eq!(dataset.to_bytes().unwrap(), bytes);
    assert_eq!(dataset.validate_for_training(), Ok(()));
    assert_eq!(dataset.n_measured(), [8, 4, 8, 8]);
}

#[test]
fn every_truncation_is_refused() {
    let bytes = dataset().to_bytes().unwrap();
    for n in (0..bytes.len()).step_by(97).chain([bytes.len() - 1]) {
        let error = Dataset::from_bytes(&bytes[..n]).unwrap_err();
        assert!(matches!(error, DatasetFileError::Container { n_bytes, .. } if n_bytes == n), "{n}: {error}");
    }
    let message = Dataset::from_bytes(&bytes[..40]).unwrap_err().to_string();
    assert!(
        message.starts_with("dataset: expected safetensors of 40 bytes that fit their header, found: "),
        "{message}"
    );
}

proptest! {
    #[test]
    fn bytes_of_any_kind_never_panic(garbage in prop::collection::vec(any::<u8>(), 0..400), at in 0.0..1.0_f64) {
        prop_assert!(Dataset::from_bytes(&garbage).is_err());
        // The same inside a real file: whatever is still read is a dataset.
        let mut bytes = dataset().to_bytes().unwrap();
        let start = (at * (bytes.len() - garbage.len()) as f64) as usize;
        bytes[start..start + garbage.len()].copy_from_slice(&garbage);
        if let Ok(read) = Dataset::from_bytes(&bytes) {
            prop_assert_eq!(read.validate(), Ok(()));
        }
    }
}

/// The file of a dataset with a text of its header replaced by one of the same length.
fn with_header(from: &str, to: &str) -> String {
    assert_eq!(from.len(), to.len());
    let bytes = dataset().to_bytes().unwrap();
    let at = bytes.windows(from.len()).position(|window| window == from.as_bytes()).unwrap();
    let mut changed = bytes;
    changed[at..at + to.len()].copy_from_slice(to.as_bytes());
    Dataset::from_bytes(&changed).unwrap_err().to_string()
}

#[test]
fn files_that_are_something_else_are_told_what_is_missing() {
    let told = with_header(r#""surefoot""#, r#""sureties""#);
    assert_eq!(told, "dataset, header: expected an entry 'surefoot', found none");
    let told = with_header(r#"dataset_format\":1"#, r#"dataset_format\":2"#);
    assert_eq!(told, "dataset, header, dataset_format: expected 1, found 2");
    let told = with_header(r#""measured":"#, r#""measurid":"#);
    assert_eq!(told, "dataset, measured: expected F32 [8, 4], found no such tensor");
    let told = with_header(r#"\"provenance\""#, r#"\"provenants\""#);
    assert!(told.starts_with("dataset, header, origin: expected the origin of a dataset, found "), "{told}");
    // Another number of samples than the tensor has.
    let told = with_header(r#"\"n_rows\":12,\"n_cols\":7"#, r#"\"n_rows\":12,\"n_cols\":6"#);
    assert_eq!(told, "dataset, features: expected F32 [8, 132], found F32 [8, 144]");
}

/// What validation says of a dataset after a change.
fn refused(change: impl Fn(&mut Dataset)) -> DatasetError {
    let mut dataset = dataset();
    change(&mut dataset);
    let error = dataset.validate().unwrap_err();
    assert!(matches!(dataset.to_bytes(), Err(DatasetFileError::Examples(_))));
    error
}

#[test]
fn examples_that_are_none_are_refused_with_their_number() {
    assert_eq!(refused(|dataset| dataset.examples.clear()), DatasetError::Empty);
    let told = refused(|dataset| dataset.examples[3].features[7] = f32::NAN).to_string();
    assert_eq!(told, "example 3, features: expected a finite number, found NaN");
    let told = refused(|dataset| dataset.examples[2].measured[1] = f32::INFINITY).to_string();
    assert_eq!(told, "example 2, measured: expected a finite number, found inf");
    let told = refused(|dataset| dataset.examples[1].unevenness_m = f32::NAN).to_string();
    assert_eq!(told, "example 1, unevenness: expected a finite number, found NaN");
    let told = refused(|dataset| dataset.examples[5].pose[2] = f64::NEG_INFINITY).to_string();
    assert_eq!(told, "example 5, pose: expected a finite number, found -inf");
    let told = refused(|dataset| dataset.examples[0].features.truncate(143)).to_string();
    assert_eq!(told, "example 0, features: expected 144 numbers, found 143");
    let told = refused(|dataset| dataset.examples[4].prior[3][0] += 0.5).to_string();
    assert!(told.starts_with("example 4, prior of pitch: sum of 12 probabilities: expected 1"), "{told}");
    let told = refused(|dataset| dataset.examples[4].prior[0][2] = f32::NAN).to_string();
    assert!(told.starts_with("example 4, prior of linear traction: probability of bin 2"), "{told}");
    let told = refused(|dataset| dataset.examples[6].drive = 2).to_string();
    assert_eq!(told, "example 6, drive: expected a number below 2, the drives named, found 2");
}

#[test]
fn what_teaches_nothing_is_refused_for_training_alone() {
    let mut alike = dataset();
    for example in &mut alike.examples {
        example.measured[2] = 0.02;
    }
    assert_eq!(alike.validate(), Ok(()));
    let told = alike.validate_for_training().unwrap_err().to_string();
    let bin = 2.5_f32.to_radians();
    assert_eq!(
        told,
        format!("roll: expected measurements in at least two bins, found all 8 in the bin of {bin}")
    );
    let mut silent = dataset();
    for example in &mut silent.examples {
        example.measured[1] = f32::NAN;
    }
    let error = silent.validate_for_training().unwrap_err();
    assert_eq!(error, DatasetError::NothingMeasured { parameter: "angular traction" });
}

#[test]
fn quantiles_of_unevenness_are_order_statistics() {
    let dataset = dataset();
    let at = |share: f64| dataset.unevenness_quantile_m(share);
    assert_eq!((at(0.0), at(1.0)), (0.01, 0.08));
    assert_eq!(at(3.0 / 7.0), 0.04);
    assert!(Dataset { examples: Vec::new(), ..dataset }.unevenness_quantile_m(0.5).is_nan());
}

const GROUND: GridGeometry = GridGeometry { resolution_m: 0.2, origin: [-40, -40], n_rows: 80, n_cols: 80 };

fn surface(height_m: impl Fn(f64, f64) -> f64) -> GridMap<SurfaceCell> {
    let mut surface = GridMap::filled(GROUND, SurfaceCell::UNKNOWN);
    for index in 0..GROUND.n_cells() {
        let [x_m, y_m] = GROUND.centre_m(GROUND.cell(index));
        surface.values_mut()[index] =
            SurfaceCell::certain(height_m(x_m, y_m) as f32, TerrainClass::Open, 0.0);
    }
    surface
}

fn surveyor() -> Surveyor {
    Surveyor::new(&GEOMETRY, layout(), PriorConfig::for_vehicle(&GEOMETRY), GROUND.resolution_m).unwrap()
}

fn label(pose: [f64; 3]) -> Label {
    Label { time_s: 3.0, pose, measured: [0.9, f32::NAN, 0.1, 0.2] }
}

#[test]
fn an_example_holds_what_the_ground_shows_at_the_pose() {
    // A slope of 10 % eastward; the vehicle heads uphill.
    let surface = surface(|x_m, _| 0.1 * x_m);
    let pose = [0.3, -0.7, 0.0];
    let example = surveyor().example(&surface, &label(pose), 7).unwrap().unwrap();
    assert_eq!((example.drive, example.pose), (7, pose));
    assert_eq!(example.measured[0], 0.9);
    assert_eq!(example.features, layout().features(&surface, pose).unwrap());
    // 3.4 m of a slope of 0.1: 0.34 / sqrt(12).
    assert!((f64::from(example.unevenness_m) - 0.34 / 12f64.sqrt()).abs() < 3e-3, "{}", example.unevenness_m);
    // The prior's pitch: 5.7 degrees in the middle of its triangle; roll: none.
    let mean_deg = |k: usize| {
        let pmf = Pmf::new(example.prior[k]).unwrap();
        pmf.mean(&Bins::ATTITUDE).to_degrees()
    };
    assert!(
        (4.0..9.0).contains(&mean_deg(3)) && mean_deg(2) < mean_deg(3),
        "{} {}",
        mean_deg(2),
        mean_deg(3)
    );
    assert!(Pmf::new(example.prior[0]).is_ok() && Pmf::new(example.prior[1]).is_ok());
}

#[test]
fn the_prior_is_that_of_the_pose_in_any_heading_and_place_of_its_cell() {
    let surface = surface(|x_m, y_m| 0.12 * (0.9 * x_m).sin() + 0.1 * (0.7 * y_m).cos());
    let mut surveyor = surveyor();
    let assumption = physics_prior::Assumption::Physics {
        prior: PriorConfig::for_vehicle(&GEOMETRY),
        level: traversability::CvarLevel::MEAN,
    };
    let mut whole = physics_prior::PriorMap::new(
        &GEOMETRY,
        &assumption,
        GROUND.resolution_m,
        GROUND,
        16,
        Instructions::widest(),
    )
    .unwrap();
    whole.update_all(&surface).unwrap();
    for k in 0..40 {
        let k = f64::from(k);
        let pose = [3.0 * (1.7 * k).sin(), 3.0 * (2.3 * k).cos(), 0.61 * k];
        let example = surveyor.example(&surface, &label(pose), 0).unwrap().unwrap();
        let belief = whole.belief(pose[0], pose[1], pose[2]).unwrap();
        let expected = [belief.linear, belief.angular, belief.roll, belief.pitch];
        assert_eq!(example.prior, expected.map(|pmf| *pmf.probabilities()), "{pose:?}");
    }
}

#[test]
fn ground_that_is_not_there_gives_no_example() {
    let whole = surface(|_, _| 0.0);
    let mut surveyor = surveyor();
    let mut of = |surface: &GridMap<SurfaceCell>, pose| surveyor.example(surface, &label(pose), 0).unwrap();
    assert!(of(&whole, [0.0, 0.0, 0.0]).is_some());
    // The nose over the edge; far outside.
    assert!(of(&whole, [6.0, 0.0, 0.0]).is_none());
    assert!(of(&whole, [100.0, 0.0, 0.0]).is_none());
    let nothing = GridMap::filled(GROUND, SurfaceCell::UNKNOWN);
    assert!(of(&nothing, [0.0, 0.0, 0.0]).is_none());
}

#[test]
fn a_surface_of_another_resolution_is_refused() {
    let other = GridGeometry { resolution_m: 0.25, ..GROUND };
    let surface = GridMap::filled(other, SurfaceCell::certain(0.0, TerrainClass::Open, 0.0));
    let told = surveyor().example(&surface, &label([0.0; 3]), 0).unwrap_err().to_string();
    assert_eq!(told, "resolution of the surface: expected 0.2 m, found 0.25 m");
}

#[test]
fn drives_of_joined_datasets_stay_apart() {
    let (one, mut other) = (dataset(), dataset());
    other.origin.provenance = "made again".to_owned();
    let joined = one.clone().joined(other.clone()).unwrap();
    assert_eq!(joined.validate(), Ok(()));
    assert_eq!(joined.examples.len(), 16);
    assert_eq!(joined.origin.drives, ["first", "second", "first", "second"]);
    let drives: Vec<u32> = joined.examples.iter().map(|example| example.drive).collect();
    assert_eq!(drives, [0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3]);
    assert_eq!(joined.origin.provenance, "made by hand; made again");

    other.origin.vehicle = "another".to_owned();
    let refused = one.clone().joined(other).unwrap_err().to_string();
    assert_eq!(refused, "vehicle: expected crawler, as in the first dataset, found another");
    let mut other = dataset();
    other.origin.layout.wheels.track_m += 0.1;
    assert!(matches!(one.clone().joined(other), Err(DatasetError::Mismatch { what: "layout", .. })));
    let mut other = dataset();
    other.origin.prior.obstacle_margin_m += 0.1;
    assert!(matches!(one.joined(other), Err(DatasetError::Mismatch { what: "prior", .. })));
}
