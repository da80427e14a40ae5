//! Lines of a map as GeoJSON (RFC 7946): longitude and latitude on WGS 84 [deg], as every viewer of maps reads them.

use proj4rs::Proj;
use proj4rs::transform::transform;
use serde_json::{Map, Value, json};

/// Code of longitude and latitude on WGS 84.
const WGS_84: u16 = 4326;

/// Where the map frame lies: its origin in a projected coordinate reference system.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapReference {
    /// The system's code in the registry of EPSG.
    pub epsg: u16,
    /// The origin in it, east and north [m].
    pub origin_m: [f64; 2],
}

/// A line, and what is said of it.
#[derive(Clone, Debug)]
pub struct GeoLine<'a> {
    /// Its points in the map frame [m].
    pub points_m: &'a [[f64; 2]],
    /// The properties of its feature.
    pub properties: Map<String, Value>,
}

/// Why a line cannot be placed on the globe.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GeoJsonError {
    /// Nobody here knows the system.
    #[error("coordinates: expected a reference system that is known, found EPSG:{epsg}: {why}")]
    System {
        /// Its code.
        epsg: u16,
        /// What is wrong.
        why: String,
    },
    /// A point has no place on the globe.
    #[error("coordinates: expected a point of EPSG:{epsg}, found ({:.1}, {:.1}): {why}", .found_m[0], .found_m[1])]
    Point {
        /// Its system.
        epsg: u16,
        /// The point, east and north [m].
        found_m: [f64; 2],
        /// What is wrong.
        why: String,
    },
}

/// A collection of features, one for each line.
///
/// # Errors
/// A system that nobody knows, or points beyond it.
pub fn geojson(lines: &[GeoLine<'_>], reference: &MapReference) -> Result<Value, GeoJsonError> {
    let epsg = reference.epsg;
    let known = |code: u16| {
        Proj::from_epsg_code(code).map_err(|error| GeoJsonError::System { epsg, why: error.to_string() })
    };
    let (from, to) = (known(epsg)?, known(WGS_84)?);
    let place = |at_m: &[f64; 2]| {
        let found_m = [0, 1].map(|axis| reference.origin_m[axis] + at_m[axis]);
        let mut point = (found_m[0], found_m[1], 0.0);
        match transform(&from, &to, &mut point) {
            Ok(()) => Ok([point.0.to_degrees(), point.1.to_degrees()]),
            Err(error) => Err(GeoJsonError::Point { epsg, found_m, why: error.to_string() }),
        }
    };
    let feature = |line: &GeoLine<'_>| {
        let coordinates = line.points_m.iter().map(place).collect::<Result<Vec<_>, _>>()?;
        let geometry = json!({"type": "LineString", "coordinates": coordinates});
        Ok(json!({"type": "Feature", "properties": line.properties, "geometry": geometry}))
    };
    let features = lines.iter().map(feature).collect::<Result<Vec<_>, _>>()?;
    Ok(json!({"type": "FeatureCollection", "features": features}))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

    use super::*;

    fn placed(epsg: u16, origin_m: [f64; 2], at_m: [f64; 2]) -> [f64; 2] {
        let line = GeoLine { points_m: &[at_m, at_m], properties: Map::new() };
        let told = geojson(&[line], &MapReference { epsg, origin_m }).unwrap();
        let point = &told["features"][0]["geometry"]["coordinates"][0];
        [0, 1].map(|axis| point[axis].as_f64().unwrap())
    }

    #[test]
    fn places_are_those_that_are_published() {
        // On the central meridian of zone 33 and the equator: 500 km east by definition.
        let [longitude_deg, latitude_deg] = placed(32633, [499_000.0, -20.0], [1000.0, 20.0]);
        assert!((longitude_deg - 15.0).abs() < 1e-9 && latitude_deg.abs() < 1e-9);
        // The CN Tower: zone 17, 630084 m east, 4833438 m north; 79 deg 23' 13.7" W, 43 deg 38' 33.24" N.
        let [longitude_deg, latitude_deg] = placed(32617, [630_000.0, 4_833_000.0], [84.0, 438.0]);
        assert!((longitude_deg + 79.0 + 23.0 / 60.0 + 13.7 / 3600.0).abs() < 2e-5, "{longitude_deg}");
        assert!((latitude_deg - 43.0 - 38.0 / 60.0 - 33.24 / 3600.0).abs() < 2e-5, "{latitude_deg}");
    }

    #[test]
    fn a_feature_has_its_properties_and_a_system_that_nobody_knows_is_refused() {
        let mut properties = Map::new();
        properties.insert("length_m".to_owned(), json!(3.5));
        let lines = [GeoLine { points_m: &[[0.0, 0.0], [1.0, 0.0]], properties }];
        let at = |epsg| geojson(&lines, &MapReference { epsg, origin_m: [500_000.0, 0.0] });
        let told = at(32633).unwrap();
        assert_eq!(told["features"][0]["properties"]["length_m"], 3.5);
        assert_eq!(told["features"][0]["geometry"]["coordinates"].as_array().unwrap().len(), 2);
        let refused = at(1).unwrap_err().to_string();
        assert!(
            refused.starts_with("coordinates: expected a reference system that is known, found EPSG:1"),
            "{refused}"
        );
    }
}
