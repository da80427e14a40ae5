//! Sets of sim-to-real cases on disk: what a case set holds, and the seal that ties it to labels kept elsewhere.

use std::collections::BTreeMap;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::results::{sha256, write_atomic};
use crate::{
    ConfigError, GapCase, GapGround, GapLabel, GapVehicle, OutputError, parse_gap_labels, write_bytes_atomic,
    write_json_atomic,
};

/// Name of the file that a sealed set holds.
const SEAL_FILE: &str = "sealed.json";

/// What a set says of labels that lie elsewhere.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct GapSeal {
    /// Number of cases.
    pub n_cases: usize,
    /// SHA-256 of the labels' file, 64 hexadecimal digits.
    pub labels_sha256: String,
}

/// Labels that do not belong to a set. Every message is one line.
#[derive(Debug, thiserror::Error)]
pub enum GapSealError {
    /// The labels, or the seal, cannot be read.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The labels are not those that the set was sealed with.
    #[error("{labels}: expected SHA-256 {expected} as sealed in {set}, found {found}")]
    OtherLabels {
        /// Labels as given.
        labels: String,
        /// Folder of the set.
        set: String,
        /// As sealed.
        expected: String,
        /// As read.
        found: String,
    },
}

#[derive(Serialize)]
struct VehicleFile<'a> {
    name: &'a str,
    reference_point: &'static str,
    wheelbase: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    max_steer: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max_speed: Option<f64>,
    noise: BTreeMap<&'static str, f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    map: Option<MapFile>,
}

#[derive(Serialize)]
struct MapFile {
    heightmap: &'static str,
    terrain_class: &'static str,
    resolution: f64,
    origin_x: f64,
    origin_y: f64,
    index: &'static str,
}

/// Writes `vehicle.toml` and, where there is ground, `heightmap.csv` and `terrain_class.csv` beside it, as
/// [`crate::read_gap_vehicle`] reads them; heights to a tenth of a millimetre.
///
/// Errors: [`OutputError::File`].
pub fn write_gap_vehicle(folder: &Path, vehicle: &GapVehicle) -> Result<(), OutputError> {
    let noise = &vehicle.noise;
    let stated = [("x", noise.x), ("y", noise.y), ("yaw", noise.yaw), ("vx", noise.vx), ("wz", noise.wz)];
    let file = VehicleFile {
        name: &vehicle.name,
        reference_point: "rear_axle",
        wheelbase: vehicle.wheelbase_m,
        max_steer: vehicle.steering_max_rad,
        max_speed: vehicle.speed_max_mps,
        noise: stated.into_iter().filter_map(|(name, value)| value.map(|value| (name, value))).collect(),
        map: vehicle.ground.as_ref().map(|ground| MapFile {
            heightmap: "heightmap.csv",
            terrain_class: "terrain_class.csv",
            resolution: ground.resolution_m,
            origin_x: ground.origin_m[0],
            origin_y: ground.origin_m[1],
            index: "row = x, column = y",
        }),
    };
    write_toml(&folder.join("vehicle.toml"), &file)?;
    if let Some(ground) = &vehicle.ground {
        write_grid(&folder.join("heightmap.csv"), ground, &ground.height_m, |height_m| {
            format!("{height_m:.4}")
        })?;
        write_grid(&folder.join("terrain_class.csv"), ground, &ground.class, u8::to_string)?;
    }
    Ok(())
}

fn write_grid<T>(
    path: &Path,
    ground: &GapGround,
    cells: &[T],
    told: impl Fn(&T) -> String,
) -> Result<(), OutputError> {
    write_atomic(path, |file| {
        let mut sink = BufWriter::new(file);
        for row in cells.chunks(ground.n_nodes[1].max(1)) {
            writeln!(sink, "{}", row.iter().map(&told).collect::<Vec<_>>().join(","))?;
        }
        sink.flush()
    })
}

#[derive(Serialize)]
struct CaseFile<'a> {
    name: &'a str,
    vehicle: &'a Path,
    sim: &'a [PathBuf],
    real: &'a [PathBuf],
    heldout: &'a [PathBuf],
}

/// Writes `case.toml` as [`crate::read_gap_case`] reads it; the case's paths are taken as relative to `folder`.
///
/// Errors: [`OutputError::File`], also for a path that is no text.
pub fn write_gap_case(folder: &Path, case: &GapCase) -> Result<(), OutputError> {
    let GapCase { name, vehicle, sim, real, heldout } = case;
    write_toml(&folder.join("case.toml"), &CaseFile { name, vehicle, sim, real, heldout })
}

fn write_toml(path: &Path, value: &impl Serialize) -> Result<(), OutputError> {
    let text = toml::to_string(value)
        .map_err(|error| OutputError::File { path: path.to_owned(), source: io::Error::other(error) })?;
    write_bytes_atomic(path, text.as_bytes())
}

/// Writes labels as JSON and gives what a set says of them. Errors: [`OutputError`].
pub fn write_gap_labels(path: &Path, labels: &BTreeMap<String, GapLabel>) -> Result<GapSeal, OutputError> {
    let mut text = serde_json::to_vec_pretty(labels)
        .map_err(|source| OutputError::NoJson { path: path.to_owned(), source })?;
    text.push(b'\n');
    write_bytes_atomic(path, &text)?;
    Ok(GapSeal { n_cases: labels.len(), labels_sha256: sha256(&text) })
}

/// Puts the seal into a set's folder: the last file to be written, so that a set with a seal is whole.
/// Errors: [`OutputError`].
pub fn write_gap_seal(set: &Path, seal: &GapSeal) -> Result<(), OutputError> {
    write_json_atomic(&set.join(SEAL_FILE), seal)
}

/// Labels of a set. A set that is sealed takes no others than its own.
///
/// Errors: labels or seal that cannot be read, labels with another hash than the sealed one.
pub fn read_sealed_labels(set: &Path, labels: &Path) -> Result<BTreeMap<String, GapLabel>, GapSealError> {
    let file = labels.display().to_string();
    let text = std::fs::read_to_string(labels)
        .map_err(|source| ConfigError::Unreadable { file: file.clone(), source })?;
    if let Some(GapSeal { labels_sha256: expected, .. }) = read_seal(set)? {
        let found = sha256(text.as_bytes());
        if found != expected {
            let set = set.display().to_string();
            return Err(GapSealError::OtherLabels { labels: file, set, expected, found });
        }
    }
    Ok(parse_gap_labels(&file, &text)?)
}

/// `None` for a set without a seal.
fn read_seal(set: &Path) -> Result<Option<GapSeal>, ConfigError> {
    let path = set.join(SEAL_FILE);
    let file = path.display().to_string();
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(ConfigError::Unreadable { file, source }),
    };
    serde_json::from_str(&text).map(Some).map_err(|error| ConfigError::Field {
        file,
        line: error.line(),
        field: "seal".to_owned(),
        expected: "n_cases and labels_sha256".to_owned(),
        found: error.to_string(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{GapKind, GapNoise, read_gap_case, read_gap_vehicle};

    #[test]
    fn a_vehicle_comes_back_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        let ground = GapGround {
            origin_m: [-1.5, 2.0],
            resolution_m: 0.25,
            n_nodes: [2, 3],
            height_m: vec![0.0, 0.5, -0.25, 1.0, 2.5, 0.125],
            class: vec![0, 1, 2, 2, 1, 0],
        };
        let vehicle = GapVehicle {
            name: "v".to_owned(),
            wheelbase_m: 0.31,
            steering_max_rad: Some(0.42),
            speed_max_mps: None,
            noise: GapNoise { x: Some(0.01), yaw: Some(0.003), ..GapNoise::default() },
            ground: Some(ground),
        };
        write_gap_vehicle(folder.path(), &vehicle).unwrap();
        assert_eq!(read_gap_vehicle(&folder.path().join("vehicle.toml")).unwrap(), vehicle);
    }

    #[test]
    fn a_case_comes_back_with_its_folder_before_its_paths() {
        let folder = tempfile::tempdir().unwrap();
        let case = GapCase {
            name: "c".to_owned(),
            vehicle: "../v/vehicle.toml".into(),
            sim: vec!["../v/s.csv".into()],
            real: vec!["a.csv".into(), "b.csv".into()],
            heldout: vec![],
        };
        write_gap_case(folder.path(), &case).unwrap();
        let read = read_gap_case(folder.path()).unwrap();
        assert_eq!((read.name.as_str(), read.sim.len(), read.heldout.len()), ("c", 1, 0));
        assert_eq!(read.real[1], folder.path().join("b.csv"));
    }

    #[test]
    fn a_sealed_set_takes_its_own_labels_and_no_others() {
        let [set, other] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let label = GapLabel {
            vehicle: "v".to_owned(),
            plant: "p".to_owned(),
            kind: GapKind::Single,
            effects: vec!["mass".to_owned()],
            magnitude: "s".to_owned(),
            style: "rich".to_owned(),
            injection: BTreeMap::from([("mass".to_owned(), 1.4.into())]),
        };
        let path = other.path().join("labels.json");
        let mut labels = BTreeMap::from([("case_001".to_owned(), label)]);
        let seal = write_gap_labels(&path, &labels).unwrap();
        assert_eq!((seal.n_cases, seal.labels_sha256.len()), (1, 64));
        assert_eq!(read_sealed_labels(set.path(), &path).unwrap(), labels);
        write_gap_seal(set.path(), &seal).unwrap();
        assert_eq!(read_sealed_labels(set.path(), &path).unwrap(), labels);
        labels.remove("case_001");
        write_gap_labels(&path, &labels).unwrap();
        let told = read_sealed_labels(set.path(), &path).unwrap_err().to_string();
        assert!(
            told.contains(&seal.labels_sha256) && told.contains("labels.json: expected SHA-256"),
            "{told}"
        );
        std::fs::write(set.path().join(SEAL_FILE), "{}").unwrap();
        let told = read_sealed_labels(set.path(), &path).unwrap_err().to_string();
        assert!(told.contains("sealed.json:1: seal: expected n_cases"), "{told}");
    }

    #[test]
    fn the_hash_is_the_standard_one() {
        // FIPS 180-2, appendix B.1.
        assert_eq!(sha256(b"abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    }
}
