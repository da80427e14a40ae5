//! What points are of, where nobody says so.
//!
//! The ground under a point is the lowest return of the columns around it. What rises from it by more than a step is an
//! obstacle, unless it is like plants: points that lie scattered in all three directions (Lalonde et al. 2006, "Natural
//! terrain classification using three-dimensional ladar data"), where walls, trunks and rocks make sheets and rods. In
//! doubt it is an obstacle.

use std::collections::{BTreeSet, HashMap};

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use bus::message::PointRecord;
use terrain::TerrainClass;

/// Least points in a column by which it may be plants.
const POINTS_MIN: usize = 12;
/// Ground may rise this much per metre from one column to the next [-].
const GRADE_MAX: f64 = 0.6;
/// Least share of the smallest of three variances: 1/3 when points lie alike in all directions, 0 on a sheet.
const SCATTER_MIN: f64 = 0.08;

/// Lengths by which points are told apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeometryClasses {
    /// Edge of the columns that are compared [m].
    pub column_m: f64,
    /// What rises higher than this above ground of the steepest grade around it is not ground [m].
    pub step_m: f64,
    /// Plants are not taken for any above this [m].
    pub plants_max_m: f64,
}

/// Points of a column that rise above the ground: their number, their sum and that of their products.
#[derive(Clone, Copy, Debug, Default)]
struct Raised {
    n: usize,
    sum: Vector3<f64>,
    products: Matrix3<f64>,
    highest_m: f64,
}

impl Raised {
    fn add(&mut self, place_m: Vector3<f64>, above_m: f64) {
        self.n += 1;
        self.sum += place_m;
        self.products += place_m * place_m.transpose();
        self.highest_m = self.highest_m.max(above_m);
    }

    fn class(&self, lengths: &GeometryClasses) -> TerrainClass {
        let n = self.n.max(1) as f64;
        let mean = self.sum / n;
        let covariance = self.products / n - mean * mean.transpose();
        let variances = covariance.symmetric_eigenvalues();
        let is_scattered = variances.min() > SCATTER_MIN * variances.sum();
        let is_low = self.highest_m <= lengths.plants_max_m;
        if self.n >= POINTS_MIN && is_scattered && is_low {
            TerrainClass::Vegetation
        } else {
            TerrainClass::Obstacle
        }
    }
}

type Column = [i32; 2];

/// The columns that points stand in.
struct Columns {
    number_of: HashMap<Column, usize>,
    /// The lowest return of each [m].
    lowest_m: Vec<f32>,
    /// The column of every point.
    of_points: Vec<usize>,
}

impl Columns {
    fn new(places_m: &[[f32; 3]], column_m: f64) -> Self {
        let mut columns = Self { number_of: HashMap::new(), lowest_m: Vec::new(), of_points: Vec::new() };
        for [x_m, y_m, height_m] in places_m {
            let column = [x_m, y_m].map(|axis_m| (f64::from(*axis_m) / column_m).floor() as i32);
            let next = columns.lowest_m.len();
            let number = *columns.number_of.entry(column).or_insert(next);
            if number == next {
                columns.lowest_m.push(*height_m);
            }
            columns.lowest_m[number] = columns.lowest_m[number].min(*height_m);
            columns.of_points.push(number);
        }
        columns
    }

    /// How high the ground of each column may lie by what is around it [m].
    fn ground_m(&self, column_m: f64) -> Vec<f32> {
        let mut ground_m = vec![f32::INFINITY; self.lowest_m.len()];
        for column in self.number_of.keys().copied().collect::<BTreeSet<_>>() {
            let around = NEIGHBOURS.iter().filter_map(|&[dx, dy]| {
                let neighbour = [column[0].saturating_add(dx), column[1].saturating_add(dy)];
                let lowest_m = self.lowest_m[*self.number_of.get(&neighbour)?];
                let distance_m = column_m * (f64::from(dx).hypot(f64::from(dy)) + 0.5);
                Some(lowest_m + (GRADE_MAX * distance_m) as f32)
            });
            ground_m[self.number_of[&column]] = around.fold(f32::INFINITY, f32::min);
        }
        ground_m
    }
}

/// A column and the eight around it.
const NEIGHBOURS: [[i32; 2]; 9] =
    [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [1, -1], [-1, 1], [-1, -1]];

impl GeometryClasses {
    /// Writes the class of every point. `to_upright` takes them to a frame whose third axis points up: a sensor may hang
    /// upside down, and a camera's axes lie otherwise.
    pub fn classify(&self, points: &mut [PointRecord], to_upright: &Isometry3<f64>) {
        let places_m: Vec<[f32; 3]> = points.iter().map(|point| upright(point, to_upright)).collect();
        let columns = Columns::new(&places_m, self.column_m);
        let ground_m = columns.ground_m(self.column_m);
        let above_m = |place_m: &[f32; 3], column: usize| f64::from(place_m[2] - ground_m[column]);
        let mut raised = vec![Raised::default(); ground_m.len()];
        for (place_m, &column) in places_m.iter().zip(&columns.of_points) {
            let above_m = above_m(place_m, column);
            if above_m > self.step_m {
                raised[column].add(Vector3::from(place_m.map(f64::from)), above_m);
            }
        }
        let classes: Vec<TerrainClass> = raised.iter().map(|raised| raised.class(self)).collect();
        for ((point, place_m), &column) in points.iter_mut().zip(&places_m).zip(&columns.of_points) {
            let is_raised = above_m(place_m, column) > self.step_m;
            point.class_number = if is_raised { classes[column] } else { TerrainClass::Open } as u32;
        }
    }
}

fn upright(point: &PointRecord, to_upright: &Isometry3<f64>) -> [f32; 3] {
    let place = to_upright * Point3::from(point.position_m.map(f64::from));
    [place.x, place.y, place.z].map(|axis_m| axis_m as f32)
}
