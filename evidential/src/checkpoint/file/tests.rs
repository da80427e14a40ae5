use std::sync::LazyLock;

use super::*;
use crate::{Method, training};

static CHECKPOINT: LazyLock<Checkpoint> = LazyLock::new(training::tests::checkpoint);

/// The refusal of the two files after a change of the sidecar's JSON.
fn refused(change: impl FnOnce(&mut serde_json::Value)) -> String {
    let mut sidecar: serde_json::Value =
        serde_json::from_slice(&CHECKPOINT.sidecar_bytes().unwrap()).unwrap();
    change(&mut sidecar);
    let weights = CHECKPOINT.weights_bytes().unwrap();
    Checkpoint::from_bytes(&weights, &serde_json::to_vec(&sidecar).unwrap())
        .map(|_| ())
        .unwrap_err()
        .to_string()
}

/// The refusal of weights whose hash the sidecar holds.
fn refused_weights(weights: &[u8]) -> String {
    let sidecar =
        Sidecar { weights_sha256: WeightsDigest::of(weights).hexadecimal(), ..CHECKPOINT.sidecar.clone() };
    let sidecar = serde_json::to_vec(&sidecar).unwrap();
    Checkpoint::from_bytes(weights, &sidecar).map(|_| ()).unwrap_err().to_string()
}

#[test]
fn checkpoint_survives_its_files_to_the_last_bit() {
    let (weights, sidecar) = (CHECKPOINT.weights_bytes().unwrap(), CHECKPOINT.sidecar_bytes().unwrap());
    let read = Checkpoint::from_bytes(&weights, &sidecar).unwrap();
    assert_eq!(read, *CHECKPOINT);
    assert_eq!(read.weights_bytes().unwrap(), weights);
    assert_eq!(read.sidecar_bytes().unwrap(), sidecar);
}

#[test]
fn a_sidecar_of_another_version_is_told_by_its_version_whatever_else_it_holds() {
    let older = |s: &mut serde_json::Value| {
        let fields = s.as_object_mut().unwrap();
        fields.remove("density");
        fields.insert("temperature".to_owned(), 1.5.into());
        fields.insert("format".to_owned(), 0.into());
    };
    assert_eq!(refused(older), "format: expected 1, found 0");
}

#[test]
fn other_format_bins_or_lengths_are_refused_with_expected_and_found() {
    assert_eq!(refused(|s| s["format"] = 2.into()), "format: expected 1, found 2");
    let told = refused(|s| s["traction_bins"][1] = 0.1.into());
    assert!(
        told.starts_with("traction_bins: expected [0.0, 0.05,") && told.contains("found [0.0, 0.1,"),
        "{told}"
    );
    let told = refused(|s| s["attitude_bins_rad"] = serde_json::json!([0.0, 1.0]));
    assert!(told.starts_with("attitude_bins_rad: expected") && told.ends_with("found [0.0, 1.0]"), "{told}");
    let told = refused(|s| s["layout"]["height_patch"]["n_rows"] = 13.into());
    assert_eq!(told, "architecture, n_inputs: expected 151, found 144");
    let told = refused(|s| s["standardisation"]["mean"] = serde_json::json!([0.0]));
    assert_eq!(told, "standardisation, number of means: expected 144, found 1");
    let told = refused(|s| s["standardisation"]["deviation"][7] = 0.0.into());
    assert_eq!(told, "standardisation, deviation: expected finite numbers > 0, found 0");
    let told = refused(|s| s["prior"]["evidence"] = 0.0.into());
    assert_eq!(told, "prior, evidence: expected a finite number > 0, found 0");
}

#[test]
fn sidecar_that_contradicts_its_method_is_refused() {
    let told = refused(|s| s["method"] = Method::Vanilla.name().into());
    assert_eq!(told, "flow of method vanilla: expected false, found true");
    let told = refused(|s| s["density"] = serde_json::Value::Null);
    assert_eq!(told, "density of method pietra: expected true, found false");
    assert!(refused(|s| s["unheard"] = 1.into()).contains("unknown field `unheard`"));
    assert!(refused(|s| s["method"] = "petra".into()).contains("unknown variant `petra`"));
}

#[test]
fn shapes_that_contradict_the_architecture_are_refused() {
    let told = refused(|s| s["architecture"]["head_hidden"] = 33.into());
    assert_eq!(told, "shape of heads.0.0.bias: expected [33], found [32]");
    let told = refused(|s| s["architecture"]["encoder_hidden"] = serde_json::json!([32, 32]));
    assert!(told.starts_with("names of the weights: expected [\"encoder.0.bias\""), "{told}");
    let told = refused(|s| s["layout"]["height_patch"]["n_rows"] = u64::from(u32::MAX).into());
    assert_eq!(told, "layout, height patch: expected at most 1024 rows and columns, found 4294967295 x 7");
}

#[test]
fn weights_of_another_training_are_refused() {
    let told = refused(|s| s["weights_sha256"] = "00".into());
    assert!(told.starts_with("SHA-256 of the weights: expected \"00\", found \""), "{told}");
    let mut weights = CHECKPOINT.weights_bytes().unwrap();
    *weights.last_mut().unwrap() ^= 1;
    let sidecar = CHECKPOINT.sidecar_bytes().unwrap();
    let told = Checkpoint::from_bytes(&weights, &sidecar).map(|_| ()).unwrap_err().to_string();
    assert!(told.starts_with("SHA-256 of the weights: expected"), "{told}");
}

#[test]
fn truncated_and_hostile_weights_are_refused() {
    let weights = CHECKPOINT.weights_bytes().unwrap();
    for length in [0, 4, 8, 100, weights.len() - 1] {
        let told = refused_weights(&weights[..length]);
        assert!(told.starts_with("weights: expected safetensors, found: "), "{length}: {told}");
    }
    // A header as long as the address space, and one just as long as the file.
    for length in [u64::MAX, weights.len() as u64] {
        let mut hostile = weights.clone();
        hostile[..8].copy_from_slice(&length.to_le_bytes());
        assert!(refused_weights(&hostile).starts_with("weights: expected safetensors, found: "));
    }
    let header =
        br#"{"encoder.0.bias":{"dtype":"F32","shape":[4611686018427387904,4],"data_offsets":[0,4]}}"#;
    let mut hostile = (header.len() as u64).to_le_bytes().to_vec();
    hostile.extend(header);
    hostile.extend([0; 4]);
    assert!(refused_weights(&hostile).starts_with("weights: expected safetensors, found: "));
    assert!(refused_weights(b"\x02\0\0\0\0\0\0\0{}").starts_with("names of the weights: expected"));
}

#[test]
fn weights_that_are_no_numbers_are_refused() {
    for found in [f32::NAN, f32::NEG_INFINITY] {
        let mut tensors = CHECKPOINT.tensors.clone();
        tensors.get_mut("heads.2.1.bias").unwrap().values[3] = found;
        let told = Checkpoint::new(CHECKPOINT.sidecar.clone(), tensors).map(|_| ()).unwrap_err().to_string();
        assert_eq!(told, format!("heads.2.1.bias, value 3: expected a finite number, found {found}"));
    }
    let mut tensors = CHECKPOINT.tensors.clone();
    tensors.get_mut("flow.alpha").unwrap().values.pop();
    let told = Checkpoint::new(CHECKPOINT.sidecar.clone(), tensors).map(|_| ()).unwrap_err().to_string();
    assert_eq!(told, "number of values of flow.alpha: expected 8, found 7");
}

#[test]
fn other_vehicle_layout_or_prior_is_refused() {
    let Sidecar { vehicle, layout, prior, .. } = CHECKPOINT.sidecar.clone();
    assert!(CHECKPOINT.require_vehicle(&vehicle).is_ok());
    assert!(CHECKPOINT.require_layout(&layout).is_ok());
    assert!(CHECKPOINT.require_prior(&prior).is_ok());
    let told = CHECKPOINT.require_vehicle("tank").unwrap_err().to_string();
    assert_eq!(told, "vehicle of the weights: expected \"tank\", found \"test\"");
    let other = FeatureLayout { height_scale_m: 0.7, ..layout };
    let told = CHECKPOINT.require_layout(&other).unwrap_err().to_string();
    assert!(told.starts_with("layout of the weights: expected FeatureLayout"), "{told}");
    let other = physics_prior::PriorConfig { evidence: 3.0, ..prior };
    assert!(
        CHECKPOINT.require_prior(&other).unwrap_err().to_string().starts_with("physics prior of the weights")
    );
}
