//! Values with a shape of their own: how a word of the command line becomes one, and what to say if it does not.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::NavigationGround;

/// Where the ground comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WorldSource {
    /// Generated rock field.
    Rocks,
    /// A map of the navigation benchmark, and a start with its goal on it, both from 0.
    Navigation {
        /// What lies on it.
        ground: NavigationGround,
        /// Map, from 0.
        map: u32,
        /// Start and goal on it, from 0.
        pair: u32,
    },
    /// PIETRA's hall of 9.6 x 8 m with a ramp and bushes.
    Arena,
    /// Elevation file: `.npz`, GeoTIFF or 16-bit PNG.
    File(PathBuf),
}

impl FromStr for WorldSource {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        match word {
            "rocks" => return Ok(Self::Rocks),
            "arena" => return Ok(Self::Arena),
            _ => {}
        }
        for (name, ground) in [("navigation", NavigationGround::Rocks), ("fast", NavigationGround::Fast)] {
            let place = word.strip_prefix(name).and_then(|place| place.strip_prefix(':'));
            if let Some(place) = place {
                let [map, pair] = place_of_benchmark(place).ok_or_else(|| {
                    format!("expected {name}:MAP,PAIR, both from 1 to 1000, found {word:?}")
                })?;
                return Ok(Self::Navigation { ground, map, pair });
            }
        }
        let extension = Path::new(word).extension().and_then(|extension| extension.to_str());
        match extension.map(str::to_ascii_lowercase).as_deref() {
            Some("npz" | "tif" | "tiff" | "png") => Ok(Self::File(PathBuf::from(word))),
            _ => Err(format!(
                "expected rocks, arena, navigation:MAP,PAIR, fast:MAP,PAIR or a file ending in .npz, .tif or .png, \
                 found {word:?}"
            )),
        }
    }
}

/// Map and pair of the navigation benchmark, told from 1, from 0.
fn place_of_benchmark(word: &str) -> Option<[u32; 2]> {
    let (map, pair) = word.split_once(',')?;
    let from_zero =
        |number: &str| number.trim().parse::<u32>().ok()?.checked_sub(1).filter(|&index| index < 1000);
    Some([from_zero(map)?, from_zero(pair)?])
}

/// Where the vehicle starts: its rear axle's centre in the map frame.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct StartPose {
    /// East [m].
    pub x_m: f64,
    /// North [m].
    pub y_m: f64,
    /// Counter-clockwise from east [rad].
    pub yaw_rad: f64,
}

impl FromStr for StartPose {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let [x_m, y_m, yaw_rad] = numbers(word, "X,Y,YAW: metres, metres, radians")?;
        Ok(Self { x_m, y_m, yaw_rad })
    }
}

/// Where the vehicle shall go, in the map frame.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Goal {
    /// East [m].
    pub x_m: f64,
    /// North [m].
    pub y_m: f64,
}

impl FromStr for Goal {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let [x_m, y_m] = numbers(word, "X,Y: metres, metres")?;
        Ok(Self { x_m, y_m })
    }
}

/// A word such as -3,4 with a blank before it, so that it is read as a place and not as an option; any other as it is.
pub fn place_with_minus(word: OsString) -> OsString {
    let is_place = |word: &str| {
        let number = |part: &str| part.trim().parse::<f64>().is_ok();
        word.starts_with('-') && word.contains(',') && word.split(',').next().is_some_and(number)
    };
    if word.to_str().is_some_and(is_place) { [" ".into(), word].into_iter().collect() } else { word }
}

fn numbers<const N: usize>(word: &str, shape: &str) -> Result<[f64; N], String> {
    let refuse = || format!("expected {N} finite numbers {shape}, found {word:?}");
    let parsed: Vec<f64> = word
        .split(',')
        .map(|part| part.trim().parse().ok().filter(|value: &f64| value.is_finite()))
        .collect::<Option<_>>()
        .ok_or_else(refuse)?;
    parsed.try_into().map_err(|_| refuse())
}

/// A CVaR level in (0, 1].
pub(super) fn cvar_level(word: &str) -> Result<f64, String> {
    number_where(word, "a number above 0 and at most 1", |value| value > 0.0 && value <= 1.0)
}

/// A duration [s].
pub(super) fn duration_s(word: &str) -> Result<f64, String> {
    number_where(word, "a finite number of seconds above 0", |value| value > 0.0 && value.is_finite())
}

/// How long one answer may take [s].
pub(super) fn timeout_s(word: &str) -> Result<f64, String> {
    number_where(word, "a number of seconds above 0 and up to 86400", |value| value > 0.0 && value <= 86400.0)
}

/// What may at most be.
pub(super) fn limit(word: &str) -> Result<f64, String> {
    number_where(word, "a finite number above 0", |value| value > 0.0 && value.is_finite())
}

/// A command with its arguments.
pub(super) fn command(word: &str) -> Result<String, String> {
    let is_empty = word.trim().is_empty();
    if is_empty { Err("expected a command, found none".to_owned()) } else { Ok(word.to_owned()) }
}

/// A distance that counts as there [m].
pub(super) fn tolerance_m(word: &str) -> Result<f64, String> {
    number_where(word, "a distance above 0 and up to 100 metres", |value| value > 0.0 && value <= 100.0)
}

/// How long something is looked on at [s].
pub(super) fn watch_s(word: &str) -> Result<f64, String> {
    number_where(word, "seconds from 0.5 to 3600", |value| (0.5..=3600.0).contains(&value))
}

/// A speed along a path [m/s].
pub(super) fn speed_mps(word: &str) -> Result<f64, String> {
    number_where(word, "a speed above 0 and up to 50 m/s", |value| value > 0.0 && value <= 50.0)
}

/// A height above the ground [m].
pub(super) fn height_m(word: &str) -> Result<f64, String> {
    number_where(word, "a height from 0 to 2 metres", |value| (0.0..=2.0).contains(&value))
}

pub(super) fn number_where(word: &str, expected: &str, allowed: impl Fn(f64) -> bool) -> Result<f64, String> {
    word.trim()
        .parse()
        .ok()
        .filter(|&value| allowed(value))
        .ok_or_else(|| format!("expected {expected}, found {word:?}"))
}

/// A number of threads.
pub(super) fn thread_count(word: &str) -> Result<usize, String> {
    count(word, 256, "threads")
}

/// A number of simulators side by side.
pub(super) fn simulator_count(word: &str) -> Result<usize, String> {
    count(word, 256, "simulators")
}

/// A number of repetitions.
pub(super) fn update_count(word: &str) -> Result<usize, String> {
    count(word, 10_000_000, "updates")
}

/// A number of seeds.
pub(super) fn seed_count(word: &str) -> Result<u64, String> {
    count(word, 1000, "seeds").map(|n| n as u64)
}

/// A number of worlds.
pub(super) fn map_count(word: &str) -> Result<u32, String> {
    count(word, 1000, "maps").map(|n| n as u32)
}

/// A number of trials.
pub(super) fn trial_count(word: &str) -> Result<u32, String> {
    count(word, 1000, "trials").map(|n| n as u32)
}

/// A factor on heights.
pub(super) fn height_scale(word: &str) -> Result<f64, String> {
    number_where(word, "a factor from 0.1 to 10", |value| (0.1..=10.0).contains(&value))
}

pub(super) fn count(word: &str, most: usize, of: &str) -> Result<usize, String> {
    word.trim()
        .parse()
        .ok()
        .filter(|count| (1..=most).contains(count))
        .ok_or_else(|| format!("expected a number of {of} from 1 to {most}, found {word:?}"))
}

/// As many threads as the machine runs at once; one if it will not say.
pub(super) fn machine_threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Anything random, repeatably.
pub(super) fn seed(word: &str) -> Result<u64, String> {
    word.trim().parse().map_err(|_| format!("expected a whole number from 0 to {}, found {word:?}", u64::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn start_takes_three_finite_numbers() {
        let start: StartPose = "-3, 4.5,0.7".parse().unwrap();
        assert_eq!(start, StartPose { x_m: -3.0, y_m: 4.5, yaw_rad: 0.7 });
        for bad in ["", "1,2", "1,2,3,4", "1,2,nan", "1,inf,0", "1;2;3", "1,,3"] {
            let message = bad.parse::<StartPose>().unwrap_err();
            assert!(message.contains("X,Y,YAW") && message.contains(bad), "{message}");
        }
    }

    #[test]
    fn a_place_in_the_south_west_is_no_option() {
        let read = |word: &str| place_with_minus(word.into()).into_string().unwrap();
        assert_eq!(read("-3,4").parse(), Ok(Goal { x_m: -3.0, y_m: 4.0 }));
        assert_eq!(["-3,4", "-.5,-1", "-1,2,-0.5"].map(read), [" -3,4", " -.5,-1", " -1,2,-0.5"]);
        for other in ["--run", "-h", "-3", "3,-4", "-x,4", ""] {
            assert_eq!(read(other), other);
        }
    }

    #[test]
    fn cvar_level_is_above_zero_and_at_most_one() {
        assert_eq!(cvar_level("1"), Ok(1.0));
        assert_eq!(cvar_level("1e-3"), Ok(0.001));
        for bad in ["0", "-0.1", "1.0001", "2", "NaN", "inf", "half", ""] {
            assert!(cvar_level(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn world_is_a_name_or_an_elevation_file() {
        assert_eq!("arena".parse(), Ok(WorldSource::Arena));
        assert_eq!("a/b.TIF".parse(), Ok(WorldSource::File("a/b.TIF".into())));
        assert!("Rocks".parse::<WorldSource>().is_err());
        assert!("world.csv".parse::<WorldSource>().unwrap_err().contains(".npz"));
    }
}
