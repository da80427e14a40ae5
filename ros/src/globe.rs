//! Where the map lies on the globe, from fixes of satellite receivers, and places in degrees as places of the map.

use std::collections::VecDeque;

use nalgebra::{Rotation2, Rotation3, Vector2, Vector3};

use crate::message::{GeoPoint, NavSatFix};

/// Semi-major axis of the ellipsoid of WGS 84 [m].
const SEMI_MAJOR_M: f64 = 6_378_137.0;
/// Its flattening.
const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// How far the map reaches as a plane that touches the ellipsoid [m]: 50 km away it is 0.5 m too short.
const PLANE_M: f64 = 50_000.0;
/// How far the vehicle drives between two fixes that are kept [m]: what receivers err by wanders slowly.
const SPACING_M: f64 = 5.0;
/// Fixes that are kept, those of the last 1.3 km.
const KEPT: usize = 256;
/// Standard deviation of a fix that does not say how sure it is [m].
const UNSTATED_DEVIATION_M: f64 = 5.0;
/// No fix is taken for surer than this [m].
const DEVIATION_MIN_M: f64 = 0.02;
/// A fix less sure than this tells nothing [m].
const DEVIATION_MAX_M: f64 = 50.0;
/// The localisation has jumped when map and fixes disagree on a way by more than this [m] and so many deviations.
const JUMP_M: f64 = 1.0;
const JUMP_DEVIATIONS: f64 = 6.0;
/// The map's heading is taken from fixes once its standard deviation is below this [rad].
const TURN_DEVIATION_RAD: f64 = 0.05;

/// Why a place on the globe is none of the map. Every message is one line.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum GlobeError {
    /// Degrees that are none.
    #[error(
        "latitude and longitude: expected -90 to 90 and -180 to 180 degrees, found {latitude} and {longitude}"
    )]
    NoPlace {
        /// [deg].
        latitude: f64,
        /// [deg].
        longitude: f64,
    },
    /// The receiver does not know where it is.
    #[error("status: expected a fix, found that the receiver has none")]
    NoFix,
    /// It hardly knows.
    #[error(
        "position_covariance: expected a standard deviation of at most {DEVIATION_MAX_M} m, found {found_m:.1} m"
    )]
    Unsure {
        /// What it is [m].
        found_m: f64,
    },
    /// Nobody knows where the vehicle was in the map.
    #[error("stamp: expected odometry within {within_s:.1} s of it, found none")]
    NoOdometry {
        /// How far it may be away [s].
        within_s: f64,
    },
    /// There was no fix that says where the map lies.
    #[error("latitude and longitude: expected a fix before, which tells where the map lies, found none")]
    Unanchored,
    /// It lies where the map is no plane any more.
    #[error("latitude and longitude: expected a place within {PLANE_M} m, found one {found_m:.0} m away")]
    TooFar {
        /// How far [m].
        found_m: f64,
    },
}

/// A place on the ellipsoid of WGS 84.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Geodetic {
    latitude_rad: f64,
    longitude_rad: f64,
    altitude_m: f64,
}

impl Geodetic {
    fn new(latitude: f64, longitude: f64, altitude_m: f64) -> Result<Self, GlobeError> {
        // What is no number is within no range.
        if !((-90.0..=90.0).contains(&latitude) && (-180.0..=180.0).contains(&longitude)) {
            return Err(GlobeError::NoPlace { latitude, longitude });
        }
        let [latitude_rad, longitude_rad] = [latitude, longitude].map(f64::to_radians);
        Ok(Self { latitude_rad, longitude_rad, altitude_m })
    }

    /// From the Earth's centre: to Greenwich on the equator, to 90 degrees east on it, to the north pole [m].
    fn geocentric_m(&self) -> Vector3<f64> {
        let eccentricity_2 = FLATTENING * (2.0 - FLATTENING);
        let ((sine, cosine), (east, greenwich)) = (self.latitude_rad.sin_cos(), self.longitude_rad.sin_cos());
        let normal_m = SEMI_MAJOR_M / (1.0 - eccentricity_2 * sine * sine).sqrt();
        let across_m = (normal_m + self.altitude_m) * cosine;
        let up_m = (normal_m * (1.0 - eccentricity_2) + self.altitude_m) * sine;
        Vector3::new(across_m * greenwich, across_m * east, up_m)
    }

    /// Takes geocentric directions to east, north and up here.
    fn to_local(self) -> Rotation3<f64> {
        let ((sine, cosine), (east, greenwich)) = (self.latitude_rad.sin_cos(), self.longitude_rad.sin_cos());
        let rows = [
            [-east, greenwich, 0.0],
            [-sine * greenwich, -sine * east, cosine],
            [cosine * greenwich, cosine * east, sine],
        ];
        Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_fn(|row, col| rows[row][col]))
    }

    /// East and north of this place, on the plane that touches the ellipsoid here [m].
    fn plane_m(&self, place: &Self) -> Vector2<f64> {
        (self.to_local() * (place.geocentric_m() - self.geocentric_m())).xy()
    }
}

/// Where the antenna was, told by both.
#[derive(Clone, Copy, Debug)]
struct Pair {
    map_m: Vector2<f64>,
    /// East and north of the datum [m].
    plane_m: Vector2<f64>,
    /// One over the fix's variance [1/m2].
    weight: f64,
}

impl Pair {
    /// Whether the localisation has jumped in between: by the map, the vehicle went another way than by its fixes.
    fn is_of_another_map(&self, next: &Self) -> bool {
        let [map_m, plane_m] = [(next.map_m - self.map_m).norm(), (next.plane_m - self.plane_m).norm()];
        let deviation_m = self.weight.min(next.weight).powf(-0.5);
        (map_m - plane_m).abs() > JUMP_M + JUMP_DEVIATIONS * deviation_m
    }
}

/// Takes the plane to the map.
#[derive(Clone, Copy, Debug)]
struct Alignment {
    turn: Rotation2<f64>,
    plane_m: Vector2<f64>,
    map_m: Vector2<f64>,
}

/// Where the map lies, by the fixes of the last kilometre.
///
/// The map's heading is found from them once they are far enough apart for what they err by; until then its x axis is
/// believed to point east, as a map's should.
#[derive(Clone, Debug, Default)]
pub struct Georeference {
    datum: Option<Geodetic>,
    pairs: VecDeque<Pair>,
}

impl Georeference {
    /// Learns from a fix that was taken while the antenna was at this place of the map, east and north [m].
    ///
    /// # Errors
    /// See [`GlobeError`]; nothing is learned then. A fix too far away leaves nothing of those before: one of the two is wrong,
    /// and the next begins anew.
    pub fn note(&mut self, fix: &NavSatFix, antenna_m: [f64; 2]) -> Result<(), GlobeError> {
        if fix.status.status < 0 {
            return Err(GlobeError::NoFix);
        }
        // Many receivers in two dimensions tell no altitude.
        let altitude_m = if fix.altitude.is_finite() { fix.altitude } else { 0.0 };
        let place = Geodetic::new(fix.latitude, fix.longitude, altitude_m)?;
        let deviation_m = deviation_m(fix)?;
        let datum = self.datum.get_or_insert(place);
        let plane_m = datum.plane_m(&place);
        if plane_m.norm() > PLANE_M {
            *self = Self::default();
            return Err(GlobeError::TooFar { found_m: plane_m.norm() });
        }
        self.keep(Pair { map_m: antenna_m.into(), plane_m, weight: deviation_m.powi(-2) });
        Ok(())
    }

    /// Keeps a pair, and of those before, what lies far enough apart and is of the same map.
    fn keep(&mut self, pair: Pair) {
        let mut newest = self.pairs.iter().rev();
        let (last, before) = (newest.next(), newest.next());
        if last.is_some_and(|last| last.is_of_another_map(&pair)) {
            self.pairs.clear();
        } else if let (Some(last), Some(before)) = (last, before)
            && (last.map_m - before.map_m).norm() < SPACING_M
        {
            self.pairs.pop_back();
        }
        self.pairs.push_back(pair);
        if self.pairs.len() > KEPT {
            self.pairs.pop_front();
        }
    }

    /// A place on the globe as one of the map, east and north [m]. Its altitude counts for nothing.
    ///
    /// # Errors
    /// See [`GlobeError`].
    pub fn place_m(&self, place: &GeoPoint) -> Result<[f64; 2], GlobeError> {
        let place = Geodetic::new(place.latitude, place.longitude, 0.0)?;
        let (Some(datum), Some(alignment)) = (self.datum, self.alignment()) else {
            return Err(GlobeError::Unanchored);
        };
        let plane_m = datum.plane_m(&Geodetic { altitude_m: datum.altitude_m, ..place });
        let found_m = (plane_m - alignment.plane_m).norm();
        if found_m > PLANE_M {
            return Err(GlobeError::TooFar { found_m });
        }
        Ok((alignment.map_m + alignment.turn * (plane_m - alignment.plane_m)).into())
    }

    /// The least squares of all pairs: their middles meet, and where it is known, the map is turned as they say.
    fn alignment(&self) -> Option<Alignment> {
        let weight: f64 = self.pairs.iter().map(|pair| pair.weight).sum();
        if self.pairs.is_empty() {
            return None;
        }
        let mean = |of: fn(&Pair) -> Vector2<f64>| {
            self.pairs.iter().map(|pair| pair.weight * of(pair)).sum::<Vector2<f64>>() / weight
        };
        let (plane_m, map_m) = (mean(|pair| pair.plane_m), mean(|pair| pair.map_m));
        let (mut along, mut across, mut spread) = (0.0, 0.0, 0.0);
        for pair in &self.pairs {
            let (plane, map) = (pair.plane_m - plane_m, pair.map_m - map_m);
            along += pair.weight * plane.dot(&map);
            across += pair.weight * plane.perp(&map);
            spread += pair.weight * plane.norm_squared();
        }
        // Errors of fixes turn the map by no more than their own over how far they are apart.
        let is_turn_known = spread * TURN_DEVIATION_RAD.powi(2) > 1.0;
        let turn_rad = if is_turn_known { across.atan2(along) } else { 0.0 };
        Some(Alignment { turn: Rotation2::new(turn_rad), plane_m, map_m })
    }
}

/// The standard deviation of a fix, the worse of east and north [m].
fn deviation_m(fix: &NavSatFix) -> Result<f64, GlobeError> {
    if fix.position_covariance_type == 0 {
        return Ok(UNSTATED_DEVIATION_M);
    }
    let [east_m2, .., north_m2, _, _, _, _] = fix.position_covariance;
    let found_m = east_m2.max(north_m2).sqrt();
    // What is no number is within no range.
    if (0.0..=DEVIATION_MAX_M).contains(&found_m) {
        Ok(found_m.max(DEVIATION_MIN_M))
    } else {
        Err(GlobeError::Unsure { found_m })
    }
}

#[cfg(test)]
mod tests;
