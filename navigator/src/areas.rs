//! Where nobody may drive, whatever the ground is like: areas to keep out of, and the one to stay within.

use serde::{Deserialize, Serialize};
use terrain::{GridGeometry, GridMap, SurfaceCell, TerrainClass};

use crate::NavigatorError;

/// Largest coordinate of a corner [m].
const COORDINATE_MAX_M: f64 = 1e6;

/// Polygons in the map frame, each by its corners east and north [m], in either sense of rotation.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Areas {
    /// No part of the vehicle may touch any of these.
    pub keep_out_m: Vec<Vec<[f64; 2]>>,
    /// No part of the vehicle may leave this one; without corners it may be anywhere.
    pub geofence_m: Vec<[f64; 2]>,
}

impl Areas {
    /// Whether a place lies within the fence and out of all that is to be kept out of.
    pub fn allow(&self, place_m: [f64; 2]) -> bool {
        self.allow_around(place_m, 0.0)
    }

    /// Whether everything within `radius_m` of a place does.
    fn allow_around(&self, place_m: [f64; 2], radius_m: f64) -> bool {
        let is_near = |corners_m: &[[f64; 2]]| {
            radius_m > 0.0 && edges(corners_m).any(|edge| distance_m(place_m, edge) <= radius_m)
        };
        let is_out = |corners_m: &Vec<[f64; 2]>| !is_inside(place_m, corners_m) && !is_near(corners_m);
        let fence_m = &self.geofence_m;
        let is_within = fence_m.is_empty() || (is_inside(place_m, fence_m) && !is_near(fence_m));
        is_within && self.keep_out_m.iter().all(is_out)
    }

    /// Refuses the first polygon that is none.
    pub(crate) fn validate(&self) -> Result<(), NavigatorError> {
        let fence = Some(("areas.geofence_m", &self.geofence_m)).filter(|(_, corners)| !corners.is_empty());
        let keep_out = self.keep_out_m.iter().map(|corners| ("areas.keep_out_m", corners));
        fence.into_iter().chain(keep_out).try_for_each(|(field, corners)| check(field, corners))
    }

    fn are_empty(&self) -> bool {
        self.keep_out_m.is_empty() && self.geofence_m.is_empty()
    }
}

fn check(field: &'static str, corners_m: &[[f64; 2]]) -> Result<(), NavigatorError> {
    let refuse = |expected, found| Err(NavigatorError::Config { field, expected, found });
    if corners_m.len() < 3 {
        return refuse("at least 3 corners of a polygon", corners_m.len() as f64);
    }
    let is_place = |value: &&f64| value.abs() <= COORDINATE_MAX_M;
    match corners_m.as_flattened().iter().find(|value| !is_place(value)) {
        Some(found) => refuse("corners of at most 1000000 m from the origin", *found),
        None => Ok(()),
    }
}

/// The edges of a polygon, the last one back to the first corner.
fn edges(corners_m: &[[f64; 2]]) -> impl Iterator<Item = [[f64; 2]; 2]> {
    let next = corners_m.iter().cycle().skip(1);
    corners_m.iter().zip(next).map(|(from_m, to_m)| [*from_m, *to_m])
}

/// By the number of edges that a ray eastwards crosses.
fn is_inside([x_m, y_m]: [f64; 2], corners_m: &[[f64; 2]]) -> bool {
    let crosses = |[[ax_m, ay_m], [bx_m, by_m]]: &[[f64; 2]; 2]| {
        (*ay_m > y_m) != (*by_m > y_m) && x_m < ax_m + (bx_m - ax_m) * (y_m - ay_m) / (by_m - ay_m)
    };
    edges(corners_m).filter(crosses).count() % 2 == 1
}

/// From a place to the nearest point of an edge [m].
fn distance_m([x_m, y_m]: [f64; 2], [[ax_m, ay_m], [bx_m, by_m]]: [[f64; 2]; 2]) -> f64 {
    let ([east_m, north_m], [px_m, py_m]) = ([bx_m - ax_m, by_m - ay_m], [x_m - ax_m, y_m - ay_m]);
    let length_m2 = east_m * east_m + north_m * north_m;
    // An edge without length is its corner.
    let share = if length_m2 > 0.0 { (px_m * east_m + py_m * north_m) / length_m2 } else { 0.0 };
    let share = share.clamp(0.0, 1.0);
    let (dx_m, dy_m) = (px_m - share * east_m, py_m - share * north_m);
    (dx_m * dx_m + dy_m * dy_m).sqrt()
}

/// Turns what may not be driven on into obstacles of the surface, so that the footprint and its margin keep clear of it
/// as of any other.
pub(crate) struct Barrier {
    areas: Areas,
    geometry: Option<GridGeometry>,
    is_barred: Vec<bool>,
    surface: Option<GridMap<SurfaceCell>>,
}

impl Barrier {
    pub fn new(areas: Areas) -> Self {
        Self { areas, geometry: None, is_barred: Vec::new(), surface: None }
    }

    /// The surface with every cell that an area reaches into as an obstacle; itself, where there are no areas.
    pub fn bar<'a>(&'a mut self, surface: &'a GridMap<SurfaceCell>) -> &'a GridMap<SurfaceCell> {
        if self.areas.are_empty() {
            return surface;
        }
        let geometry = *surface.geometry();
        if self.geometry != Some(geometry) {
            self.survey(&geometry);
        }
        let barred = self.surface.insert(surface.clone());
        let cells = barred.values_mut().iter_mut().zip(&self.is_barred);
        for (cell, _) in cells.filter(|(_, is_barred)| **is_barred) {
            cell.class_probability = [0.0; TerrainClass::COUNT];
            cell.class_probability[TerrainClass::Obstacle as usize] = 1.0;
        }
        barred
    }

    fn survey(&mut self, geometry: &GridGeometry) {
        // From the centre of a cell to its corners.
        let reach_m = std::f64::consts::FRAC_1_SQRT_2 * geometry.resolution_m;
        let allowed = |index| self.areas.allow_around(geometry.centre_m(geometry.cell(index)), reach_m);
        self.is_barred = (0..geometry.n_cells()).map(|index| !allowed(index)).collect();
        self.geometry = Some(*geometry);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SQUARE_M: [[f64; 2]; 4] = [[1.0, 1.0], [4.0, 1.0], [4.0, 3.0], [1.0, 3.0]];

    fn fenced() -> Areas {
        let fence = vec![[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]];
        Areas { keep_out_m: vec![SQUARE_M.to_vec()], geofence_m: fence }
    }

    #[test]
    fn what_lies_in_the_fence_and_out_of_the_rest_is_allowed() {
        let areas = fenced();
        for (place_m, is_allowed) in [
            ([5.0, 5.0], true),
            ([2.0, 2.0], false),
            ([0.5, 2.0], true),
            ([-0.5, 5.0], false),
            ([5.0, 10.5], false),
        ] {
            assert_eq!(areas.allow(place_m), is_allowed, "{place_m:?}");
        }
        assert!(Areas::default().allow([1e9, -1e9]), "no areas forbid nothing");
    }

    #[test]
    fn a_fence_with_a_bay_keeps_out_of_the_bay() {
        // A U: the bay between x = 2 and x = 4 above y = 1 is outside.
        let corners =
            [[0.0, 0.0], [6.0, 0.0], [6.0, 5.0], [4.0, 5.0], [4.0, 1.0], [2.0, 1.0], [2.0, 5.0], [0.0, 5.0]];
        let areas = Areas { geofence_m: corners.to_vec(), ..Areas::default() };
        assert!(areas.allow([1.0, 4.0]) && areas.allow([5.0, 4.0]) && areas.allow([3.0, 0.5]));
        assert!(!areas.allow([3.0, 3.0]));
    }

    #[test]
    fn polygons_that_are_none_are_refused_by_name() {
        let told = |areas: Areas| areas.validate().unwrap_err().to_string();
        let line = Areas { keep_out_m: vec![vec![[0.0, 0.0], [1.0, 0.0]]], ..Areas::default() };
        assert_eq!(told(line), "areas.keep_out_m: expected at least 3 corners of a polygon, found 2");
        let mut lost = fenced();
        lost.geofence_m[2][1] = f64::NAN;
        assert!(
            told(lost).starts_with("areas.geofence_m: expected corners of at most 1000000 m"),
            "not a number"
        );
    }

    /// Cells that a polygon only cuts with an edge or a corner are barred too: one thinner than a cell does not slip
    /// between the centres.
    #[test]
    fn a_strip_thinner_than_a_cell_is_a_wall() {
        let strip = vec![[-9.0, 0.26], [9.0, 0.26], [9.0, 0.27], [-9.0, 0.27]];
        let geometry = GridGeometry::centred(0.2, 20, 20, 0.0, 0.0);
        let surface = GridMap::filled(geometry, SurfaceCell::certain(0.0, TerrainClass::Open, 0.0));
        let mut barrier = Barrier::new(Areas { keep_out_m: vec![strip], ..Areas::default() });
        let barred = barrier.bar(&surface);
        let class_at = |x_m: f64, y_m: f64| barred.at(x_m, y_m).unwrap().class();
        for column in 0..20 {
            let x_m = -1.9 + 0.2 * f64::from(column);
            assert_eq!(class_at(x_m, 0.26), TerrainClass::Obstacle, "{x_m}");
            assert_eq!(class_at(x_m, -0.3), TerrainClass::Open, "{x_m}");
        }
        assert_eq!(barred.at(0.0, 0.26).unwrap().height_m, 0.0, "the height stays what it is");
    }

    #[test]
    fn the_areas_stay_where_they_are_when_the_window_moves() {
        let mut barrier = Barrier::new(fenced());
        for x_m in [2.0, 3.0, 2.0] {
            let geometry = GridGeometry::centred(0.25, 16, 16, x_m, 2.0);
            let surface = GridMap::filled(geometry, SurfaceCell::certain(0.0, TerrainClass::Open, 0.0));
            let barred = barrier.bar(&surface);
            assert_eq!(barred.at(3.1, 2.1).unwrap().class(), TerrainClass::Obstacle, "window at {x_m}");
            assert_eq!(barred.at(2.6, 0.4).unwrap().class(), TerrainClass::Open, "window at {x_m}");
        }
    }

    proptest! {
        /// Of a rectangle, inside and distance have closed forms.
        #[test]
        fn rectangles_agree_with_their_closed_form(x_m in -2.0..8.0_f64, y_m in -2.0..6.0_f64) {
            let inside = (1.0..4.0).contains(&x_m) && (1.0..3.0).contains(&y_m);
            prop_assume!([x_m - 1.0, x_m - 4.0, y_m - 1.0, y_m - 3.0].iter().all(|v| v.abs() > 1e-9));
            prop_assert_eq!(is_inside([x_m, y_m], &SQUARE_M), inside);
            let beyond = |v: f64, low: f64, high: f64| (low - v).max(v - high);
            let (dx_m, dy_m) = (beyond(x_m, 1.0, 4.0), beyond(y_m, 1.0, 3.0));
            let expected_m = if inside { -dx_m.max(dy_m) } else { dx_m.max(0.0).hypot(dy_m.max(0.0)) };
            let found_m = edges(&SQUARE_M).map(|edge| distance_m([x_m, y_m], edge)).fold(f64::MAX, f64::min);
            prop_assert!((found_m - expected_m).abs() < 1e-12, "{} {}", found_m, expected_m);
        }
    }
}
