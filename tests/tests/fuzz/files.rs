//! Every file that is read: the documents that inputs start from, how they are broken, and who reads them.

use std::path::Path;
use std::sync::LazyLock;

use bicycle::{Column, DriveRow};
use formats::{ConfigText, DriveRecorder, PngScale};
use navigator::Config;
use png::{BitDepth, ColorType};
use rand::RngExt;
use sim_to_real::Answer;
use tempfile::TempDir;
use zip::CompressionMethod;

use crate::archive::{self, Array};
use crate::harness::{Fate, Reader, Rng};
use crate::image;
use crate::mutate::{self, once_in, one_of};
use crate::recording::{self, Told};

/// A folder that costs no disk where the system has one.
pub fn folder() -> TempDir {
    tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).unwrap()
}

/// Reads inputs as files of this name, alone in their folder.
fn file(name: &'static str, read: impl Fn(&Path) -> Fate + 'static) -> Reader {
    file_beside(name, &[], read)
}

/// Reads inputs as files of this name, beside others that are whole.
fn file_beside(
    name: &'static str,
    others: &[(&str, &str)],
    read: impl Fn(&Path) -> Fate + 'static,
) -> Reader {
    let folder = folder();
    for (other, text) in others {
        std::fs::write(folder.path().join(other), text).unwrap();
    }
    let path = folder.path().join(name);
    Box::new(move |input| {
        std::fs::write(&path, input).unwrap();
        // The folder lives as long as whoever writes into it.
        let _lives = &folder;
        read(&path)
    })
}

/// Reads inputs as text; what is none is refused by whoever opens the file.
pub fn text(read: impl Fn(&str) -> Fate + 'static) -> Reader {
    Box::new(move |input| std::str::from_utf8(input).map_or(Fate::Refused, &read))
}

const DRIVES: [&str; 4] = [
    "t,x,y,z,roll,pitch,yaw,vx,vy,wz,cmd_speed,cmd_steer\n0,0,0,0,0,0,0,1,0,0.1,1,0.1\n\
     0.02,0.02,0,0,0,0,0.002,1,0,0.1,1,0.1\n0.04,0.04,,nan,0,0,0.004,1,0,0.1,1,0.1\n",
    "run,t,vx,note\na,0,1,\"so, so\"\na,0.1,1.5,\"\"\"b\"\"\"\nb,0,2,\nb,0.1,2,x\n",
    "\u{feff} t , wheel_speed,steer_meas \r\n0,1,0\r\n1e-3,1.25,-0.5\r\n\r\n2e-3,1.5,1e-300\r\n",
    "wx,t,ax,ay,az\nq,0.5,0.1,0.2,9.81\n",
];

pub fn drive_log_csv(rng: &mut Rng) -> Vec<u8> {
    let text = one_of(rng, &DRIVES);
    mutate::text(rng, text)
}

pub fn read_drive_log_csv() -> Reader {
    file("drive.csv", |path| Fate::of(&formats::read_drive_log_csv(path)))
}

/// A recording as it is written: packed, with an index.
static RECORDED: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let folder = folder();
    let path = folder.path().join("a.mcap");
    let mut recorder = DriveRecorder::create(&path, Default::default()).unwrap();
    rows().for_each(|(at_ns, row)| recorder.drive_row(at_ns, "1", &row).unwrap());
    recorder.finish().unwrap();
    std::fs::read(&path).unwrap()
});

/// The same rows as messages.
static MESSAGES: LazyLock<Vec<Told>> = LazyLock::new(|| {
    let messages = mcap::MessageStream::new(&RECORDED).unwrap().map(Result::unwrap);
    let mut told: Vec<Told> =
        messages.map(|message| Told::new(&message.channel.topic, &message.data)).collect();
    told.push(Told::new("/pose", b"for people"));
    told
});

fn rows() -> impl Iterator<Item = (u64, DriveRow)> {
    (0..6).map(|k| {
        let row = DriveRow::new(0.02 * k as f64).with(Column::X, 0.02 * k as f64).with(Column::Vx, 1.0);
        (20_000_000 * k, row)
    })
}

pub fn drive_recording(rng: &mut Rng) -> Vec<u8> {
    if once_in(rng, 4) {
        let mut bytes = RECORDED.clone();
        mutate::bytes(rng, &mut bytes);
        return bytes;
    }
    recording::broken(rng, &MESSAGES, |rng, told| mutate::bytes(rng, &mut told.data))
}

pub fn read_drive_recording() -> Reader {
    file("drive.mcap", |path| Fate::of(&formats::read_drive_log_mcap(path)))
}

static ELEVATION: LazyLock<Vec<Array>> = LazyLock::new(|| {
    let layer = |name, height: f32| Array::f32(name, &[4, 5], (0..20).map(|k| height * k as f32));
    vec![
        Array::f32("cell", &[], [0.5]),
        layer("elevation", 0.1),
        layer("canopy_height", 0.2),
        layer("low_veg_fraction", 0.02),
        layer("water", 0.0),
        layer("ground_gap", 0.3),
    ]
});

/// Archives that unpack to two hundred times what they are, or claim to.
static SWOLLEN: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let cell = Array::f32("cell", &[], [0.5]);
    let flat = |descriptor, n_bytes| {
        vec![cell.clone(), Array::zeros("elevation", descriptor, &[2048, 2048], n_bytes)]
    };
    let points = vec![Array::zeros("xyz", "<f4", &[1 << 20, 3], 3 << 22)];
    let bins = vec![cell.clone(), Array::zeros("bin_values", "|u1", &[1 << 21], 1 << 21)];
    [flat("<f4", 1 << 24), flat("|u1", 1 << 22), points, bins]
        .iter()
        .map(|arrays| archive::archive(arrays, CompressionMethod::Deflated))
        .collect()
});

fn archive_of(rng: &mut Rng, arrays: &[Array]) -> Vec<u8> {
    if once_in(rng, 1000) {
        return SWOLLEN[rng.random_range(0..SWOLLEN.len())].clone();
    }
    archive::broken(rng, arrays)
}

pub fn elevation_npz(rng: &mut Rng) -> Vec<u8> {
    archive_of(rng, &ELEVATION)
}

pub fn read_elevation_npz() -> Reader {
    file("hill.npz", |path| Fate::of(&formats::read_elevation(path)))
}

pub fn elevation_geotiff(rng: &mut Rng) -> Vec<u8> {
    image::broken_tiff(rng)
}

pub fn read_elevation_geotiff() -> Reader {
    file("hill.tif", |path| Fate::of(&formats::read_elevation(path)))
}

/// A flat PNG of 3 million pixels in a few thousand bytes.
static FLAT_PNG: LazyLock<Vec<u8>> = LazyLock::new(|| {
    image::png(2048, 1536, (ColorType::Grayscale, BitDepth::Sixteen), &vec![0; 2 * 2048 * 1536])
});

pub fn elevation_png(rng: &mut Rng) -> Vec<u8> {
    if once_in(rng, 1000) { FLAT_PNG.clone() } else { image::broken_png(rng) }
}

const SCALE: &str = "height_min_m = -2.0\nheight_max_m = 8\ncell_m = 0.5\nno_data = 0\n";

pub fn read_elevation_png() -> Reader {
    file_beside("hill.png", &[("hill.png.toml", SCALE)], |path| Fate::of(&formats::read_elevation(path)))
}

pub fn png_scale(rng: &mut Rng) -> Vec<u8> {
    mutate::text(rng, SCALE)
}

pub fn read_png_scale() -> Reader {
    file("hill.png.toml", |path| Fate::of(&PngScale::beside(&path.with_extension(""))))
}

static TRACTION: LazyLock<Vec<Array>> = LazyLock::new(|| {
    let pmf = |name| Array::f32(name, &[12, 2, 3], (0..72).map(|_| 1.0 / 12.0));
    vec![
        Array::f32("cell", &[], [0.5]),
        Array::f32("bin_values", &[12], traversability::Bins::TRACTION.values().iter().copied()),
        Array::u8("unknown", "|b1", &[2, 3], &[0, 0, 1, 0, 0, 0]),
        Array::f32("elevation", &[2, 3], (0..6).map(|k| 0.1 * k as f32)),
        Array::u8("semantic_id", "|u1", &[2, 3], &[0, 1, 255, 3, 4, 5]),
        pmf("measured_linear_pmf"),
        pmf("measured_angular_pmf"),
        pmf("predicted_linear_pmf"),
        pmf("predicted_angular_pmf"),
        Array::f32("predicted_normalised_density", &[2, 3], (0..6).map(|k| 0.2 * k as f32)),
    ]
});

pub fn traction_map(rng: &mut Rng) -> Vec<u8> {
    archive_of(rng, &TRACTION)
}

pub fn read_traction_map() -> Reader {
    Box::new(|input| Fate::of(&formats::parse_traction_map("map.npz", input)))
}

static SCAN: LazyLock<Vec<Array>> =
    LazyLock::new(|| vec![Array::f32("xyz", &[8, 3], (0..24).map(|k| 0.3 * k as f32))]);

pub fn scan_points(rng: &mut Rng) -> Vec<u8> {
    archive_of(rng, &SCAN)
}

pub fn read_scan_points() -> Reader {
    Box::new(|input| Fate::of(&formats::parse_scan_points("scan.npz", input)))
}

pub fn vehicle(rng: &mut Rng) -> Vec<u8> {
    let name = one_of(rng, &["rc_car", "sedan"]);
    mutate::text(rng, formats::shipped_vehicle_text(name).unwrap())
}

pub fn read_vehicle() -> Reader {
    text(|input| Fate::of(&formats::parse_vehicle(&ConfigText::new("v.toml", input))))
}

pub fn robot(rng: &mut Rng) -> Vec<u8> {
    mutate::text(rng, include_str!("../../../examples/robot.toml"))
}

/// What is taken moves scans and judges places.
pub fn read_robot() -> Reader {
    text(|input| {
        let robot = formats::parse_robot(&ConfigText::new("r.toml", input));
        for sensor in robot.iter().flat_map(|robot| &robot.sensors) {
            sensor.mount.in_body_frame(&terrain::Scan::default());
        }
        Fate::of(&robot)
    })
}

/// A model with two effects, one of them twice.
static MODEL: LazyLock<String> = LazyLock::new(|| {
    let mut model = bicycle::Model::of(&formats::read_vehicle("rc_car").unwrap());
    let effect = |id, value| bicycle::Effect::from_values(id, [value, 0.0, 0.0, 0.0]).unwrap();
    model.effects = vec![effect("steer_lag", 0.1), effect("speed_scale", 0.9), effect("steer_lag", 0.05)];
    formats::model_text(&model).unwrap()
});

pub fn model(rng: &mut Rng) -> Vec<u8> {
    mutate::text(rng, &MODEL)
}

pub fn read_model() -> Reader {
    text(|input| Fate::of(&formats::parse_model(&ConfigText::new("m.toml", input))))
}

static SETTINGS: LazyLock<String> = LazyLock::new(|| toml::to_string(&settings_of("rc_car")).unwrap());

fn settings_of(vehicle: &str) -> Config {
    Config::for_vehicle(&formats::read_vehicle(vehicle).unwrap())
}

pub fn settings(rng: &mut Rng) -> Vec<u8> {
    mutate::text(rng, &SETTINGS)
}

pub fn read_settings() -> Reader {
    let defaults = settings_of("rc_car");
    text(move |input| Fate::of(&formats::overlay(&ConfigText::new("s.toml", input), &defaults)))
}

const CASE: &str = "name = \"c\"\nvehicle = \"vehicle.toml\"\nsim = [\"s.csv\", \"../s/t.mcap\"]\nreal = [\"r.csv\"]\n\
                    heldout = [\"h.csv\"]\n";

pub fn gap_case(rng: &mut Rng) -> Vec<u8> {
    mutate::text(rng, CASE)
}

pub fn read_gap_case() -> Reader {
    file("case.toml", |path| Fate::of(&formats::read_gap_case(path)))
}

const GAP_VEHICLE: &str = "name = \"v\"\nreference_point = \"rear_axle\"\nwheelbase = 0.31\nmax_steer = 0.42\n\
     max_speed = 2\n[noise]\nx = 0.01\ny = 0.01\nyaw = 0.003\nvx = 0.02\nwz = 0.01\n[map]\n\
     heightmap = \"heights.csv\"\nterrain_class = \"classes.csv\"\nresolution = 0.25\norigin_x = -1.5\norigin_y = 2.0\n\
     index = \"row = x, column = y\"\n";
const HEIGHTS: &str = "0,0.5,-0.25\n1.0,2.5,0.125\n";
const CLASSES: &str = "0,1,2\n2,1,255\n";

pub fn gap_vehicle(rng: &mut Rng) -> Vec<u8> {
    mutate::text(rng, GAP_VEHICLE)
}

pub fn read_gap_vehicle() -> Reader {
    let grids = [("heights.csv", HEIGHTS), ("classes.csv", CLASSES)];
    file_beside("vehicle.toml", &grids, |path| Fate::of(&formats::read_gap_vehicle(path)))
}

pub fn gap_grid(rng: &mut Rng) -> Vec<u8> {
    mutate::text(rng, HEIGHTS)
}

pub fn read_gap_grid() -> Reader {
    let others = [("vehicle.toml", GAP_VEHICLE), ("classes.csv", CLASSES)];
    file_beside("heights.csv", &others, |path| {
        Fate::of(&formats::read_gap_vehicle(&path.with_file_name("vehicle.toml")))
    })
}

const LABELS: &str = r#"{ "a": { "vehicle": "v", "plant": "p", "kind": "pair", "effects": ["wind", "mass"],
  "magnitude": "l", "style": "rich", "injection": { "wind": [1, 2.5e3], "on": true, "deep": { "x": null } } },
  "b": { "vehicle": "v", "plant": "q", "kind": "none", "effects": [], "magnitude": "-", "style": "poor" } }"#;

pub fn gap_labels(rng: &mut Rng) -> Vec<u8> {
    mutate::text(rng, LABELS)
}

pub fn read_gap_labels() -> Reader {
    text(|input| Fate::of(&formats::parse_gap_labels("labels.json", input)))
}

/// The labels as the program writes them, and the seal that a set of them holds.
static SEALED: LazyLock<(String, String)> = LazyLock::new(|| {
    let folder = folder();
    let path = folder.path().join("labels.json");
    let seal = formats::write_gap_labels(&path, &formats::parse_gap_labels("l", LABELS).unwrap()).unwrap();
    (std::fs::read_to_string(&path).unwrap(), serde_json::to_string_pretty(&seal).unwrap())
});

pub fn gap_seal(rng: &mut Rng) -> Vec<u8> {
    mutate::text(rng, &SEALED.1)
}

pub fn read_gap_seal() -> Reader {
    file_beside("sealed.json", &[("labels.json", &SEALED.0)], |path| {
        let set = path.parent().unwrap();
        Fate::of(&formats::read_sealed_labels(set, &set.join("labels.json")))
    })
}

const ANSWER: &str = r#"{ "case": "c", "steering": "angle", "verdict": "effects",
  "effects": [{ "id": "steer_lag", "form": "steer_delay", "parameters":
    { "time_constant_s": { "value": 0.2, "low": 0.1, "high": 0.3 } } }],
  "ranking": [{ "id": "steer_lag", "score": 0.9 }], "credible_set": ["steer_lag"],
  "where": [{ "condition": "steering_change", "share": 0.4 }],
  "shrink": { "metric": "m", "before": 2.0, "after": 1.1, "floor": 1.0, "closed": 0.9, "closed_low": 0.8,
    "closed_high": 1.0, "predicted_closed": null, "learned_bound_closed": 0.95,
    "position_error_2s_m": { "before": 0.5, "after": 0.1 } },
  "advice": ["Drive on."] }"#;

pub fn answer(rng: &mut Rng) -> Vec<u8> {
    mutate::text(rng, ANSWER)
}

pub fn read_answer() -> Reader {
    Box::new(|input| Fate::of(&serde_json::from_slice::<Answer>(input)))
}
