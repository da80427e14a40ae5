//! From points to things: what stands above the ground, gathered by where it stands.

use std::collections::BTreeMap;

use terrain::{BodyBox, GridMap, Pose, Scan, SurfaceCell, TerrainClass};

use crate::TrackingConfig;

/// Least radius of a thing of which one side or a single column was seen [m].
const RADIUS_LEAST_M: f64 = 0.1;

/// A thing that stands above the ground, as one scan shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cluster {
    /// Estimated centre, east, north [m].
    pub centre_m: [f64; 2],
    /// Of a circle about the centre that reaches as far as what was seen of it [m].
    pub radius_m: f64,
    /// From the sensor to the centre [m].
    pub range_m: f64,
}

/// The points of one cell.
#[derive(Clone, Debug, Default)]
struct Column {
    /// East, north from the sensor [m].
    solid_m: Vec<[f64; 2]>,
    n_plants: usize,
}

impl Column {
    /// A camera errs: what is mostly plants has no solid core.
    fn is_solid(&self) -> bool {
        !self.solid_m.is_empty() && self.solid_m.len() >= self.n_plants
    }
}

/// The things that stand above the ground in a scan that was taken at `pose`, at most `most` of them, the nearest first.
/// Points on `own_body` and above ground that nobody knows count for nothing.
pub(crate) fn clusters(
    scan: &Scan,
    pose: &Pose,
    surface: &GridMap<SurfaceCell>,
    own_body: &BodyBox,
    config: &TrackingConfig,
    most: usize,
) -> Vec<Cluster> {
    let motion = pose.isometry();
    let origin = motion * point_of(scan.origin_m);
    let mut columns: BTreeMap<[i64; 2], Column> = BTreeMap::new();
    for point in &scan.points {
        let body_m = point.position_m.map(f64::from);
        if !body_m.iter().all(|value| value.is_finite()) || own_body.contains(body_m) {
            continue;
        }
        let place = motion * point_of(point.position_m);
        let Some(ground) = surface.at(place.x, place.y).filter(|cell| cell.is_known()) else { continue };
        let above_m = place.z - f64::from(ground.height_m);
        if !(config.height_min_m..=config.height_max_m).contains(&above_m) {
            continue;
        }
        let key = [place.x, place.y].map(|value_m| (value_m / config.cell_m).floor() as i64);
        let column = columns.entry(key).or_default();
        match point.class {
            TerrainClass::Vegetation => column.n_plants += 1,
            _ => column.solid_m.push([place.x - origin.x, place.y - origin.y]),
        }
    }
    columns.retain(|_, column| column.is_solid());
    let mut found: Vec<Cluster> = connected(columns)
        .iter()
        .filter(|points_m| points_m.len() >= config.points_min)
        .map(|points_m| enclosed(points_m, [origin.x, origin.y]))
        .filter(|cluster| cluster.radius_m <= config.radius_max_m)
        .collect();
    found.sort_by(|a, b| a.range_m.total_cmp(&b.range_m));
    found.truncate(most);
    found
}

/// The points of cells that touch one another, by side or corner.
fn connected(mut columns: BTreeMap<[i64; 2], Column>) -> Vec<Vec<[f64; 2]>> {
    let mut groups = Vec::new();
    while let Some((key, column)) = columns.pop_first() {
        let (mut points_m, mut border) = (column.solid_m, vec![key]);
        while let Some([col, row]) = border.pop() {
            for neighbour in (-1..=1).flat_map(|up| (-1..=1).map(move |right| [col + right, row + up])) {
                if let Some(column) = columns.remove(&neighbour) {
                    points_m.extend(column.solid_m);
                    border.push(neighbour);
                }
            }
        }
        groups.push(points_m);
    }
    groups
}

/// The circle that points seen from one side tell of. A sensor sees the near half of a round thing: across the line of
/// sight it is as wide as its points, along it the centre lies that half width behind the nearest of them.
fn enclosed(points_m: &[[f64; 2]], origin_m: [f64; 2]) -> Cluster {
    let n = points_m.len() as f64;
    let [east_m, north_m] = [0, 1].map(|axis| points_m.iter().map(|point_m| point_m[axis]).sum::<f64>() / n);
    let range_m = libm::hypot(east_m, north_m).max(1e-6);
    let ahead = [east_m / range_m, north_m / range_m];
    let [along, across] = [ahead, [-ahead[1], ahead[0]]].map(|axis| {
        let places = points_m.iter().map(|[x_m, y_m]| axis[0] * x_m + axis[1] * y_m);
        places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at_m| [low.min(at_m), high.max(at_m)])
    });
    let half_width_m = 0.5 * (across[1] - across[0]);
    let radius_m = half_width_m.max(0.5 * (along[1] - along[0])).max(RADIUS_LEAST_M);
    let (along_m, across_m) = (along[0] + radius_m, 0.5 * (across[0] + across[1]));
    Cluster {
        centre_m: [
            origin_m[0] + along_m * ahead[0] - across_m * ahead[1],
            origin_m[1] + along_m * ahead[1] + across_m * ahead[0],
        ],
        radius_m,
        range_m: along_m,
    }
}

fn point_of(place_m: [f32; 3]) -> nalgebra::Point3<f64> {
    nalgebra::Point3::from(place_m.map(f64::from))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;
    use terrain::{GridGeometry, RangePoint};

    /// Level known ground about the origin; a strip in the north that nobody has seen.
    fn ground() -> GridMap<SurfaceCell> {
        let geometry = GridGeometry::centred(0.2, 200, 200, 0.0, 0.0);
        let cells = (0..geometry.n_cells()).map(|index| {
            let [_, y_m] = geometry.centre_m(geometry.cell(index));
            if y_m > 15.0 { SurfaceCell::UNKNOWN } else { SurfaceCell::certain(0.0, TerrainClass::Open, 0.0) }
        });
        GridMap::from_values(geometry, cells.collect()).unwrap()
    }

    /// What a sensor 1 m above the body's origin sees of an upright cylinder: the points of its wall that face it.
    fn wall(centre_m: [f64; 2], radius_m: f64, class: TerrainClass) -> Vec<RangePoint> {
        let mut points = Vec::new();
        for k in 0..240 {
            let (sin, cos) = (f64::from(k) / 240.0 * TAU).sin_cos();
            let [x_m, y_m] = [centre_m[0] + radius_m * cos, centre_m[1] + radius_m * sin];
            let faces = cos * x_m + sin * y_m < 0.0;
            for z_m in [0.0, 0.5, 1.0, 1.5] {
                if faces {
                    points.push(RangePoint { position_m: [x_m, y_m, z_m].map(|v| v as f32), class });
                }
            }
        }
        points
    }

    fn seen(points: Vec<RangePoint>) -> Vec<Cluster> {
        let scan = Scan { valid_at_ns: 0, origin_m: [0.0, 0.0, 1.0], points };
        clusters(&scan, &Pose::default(), &ground(), &BodyBox::EMPTY, &TrackingConfig::default(), 10)
    }

    #[test]
    fn a_round_thing_is_found_where_it_stands_though_half_of_it_is_seen() {
        for (centre_m, radius_m) in [([6.0, 1.0], 0.3), ([-4.0, 9.0], 0.3), ([0.0, -12.0], 1.2)] {
            let found = seen(wall(centre_m, radius_m, TerrainClass::Obstacle));
            assert_eq!(found.len(), 1);
            let off_m = libm::hypot(found[0].centre_m[0] - centre_m[0], found[0].centre_m[1] - centre_m[1]);
            assert!(off_m < 0.1 * radius_m, "{found:?}");
            assert!((found[0].radius_m - radius_m).abs() < 0.1 * radius_m, "{found:?}");
        }
    }

    #[test]
    fn things_apart_are_two_and_the_nearer_comes_first() {
        let mut points = wall([8.0, 2.0], 0.3, TerrainClass::Obstacle);
        points.extend(wall([5.0, -2.0], 0.3, TerrainClass::Open));
        let found = seen(points);
        assert_eq!(found.len(), 2);
        assert!(found[0].centre_m[0] < 6.0 && found[1].centre_m[0] > 7.0, "{found:?}");
    }

    #[test]
    fn plants_ground_unknown_places_and_walls_are_nothing_that_moves() {
        assert_eq!(seen(wall([6.0, 1.0], 0.3, TerrainClass::Vegetation)), [], "plants");
        let low = wall([6.0, 1.0], 0.3, TerrainClass::Obstacle).into_iter();
        assert_eq!(seen(low.filter(|point| point.position_m[2] < 0.2).collect()), [], "on the ground");
        assert_eq!(seen(wall([0.0, 17.0], 0.3, TerrainClass::Obstacle)), [], "above ground nobody knows");
        assert_eq!(seen(wall([9.0, 0.0], 4.0, TerrainClass::Obstacle)), [], "as large as a wall");
    }

    /// One point in a hundred of a bush is named wrongly.
    #[test]
    fn a_camera_that_errs_makes_no_thing_of_a_bush() {
        let mut points = wall([6.0, 1.0], 0.6, TerrainClass::Vegetation);
        for point in points.iter_mut().step_by(10) {
            point.class = TerrainClass::Obstacle;
        }
        assert_eq!(seen(points), []);
    }

    #[test]
    fn what_is_no_number_or_the_vehicle_itself_counts_for_nothing() {
        let mut points = wall([3.0, 0.0], 0.3, TerrainClass::Obstacle);
        points.iter_mut().for_each(|point| point.position_m[1] = f32::NAN);
        assert_eq!(seen(points), []);
        let points = wall([3.0, 0.0], 0.3, TerrainClass::Obstacle);
        let scan = Scan { valid_at_ns: 0, origin_m: [0.0, 0.0, 1.0], points };
        let own = BodyBox { min_m: [-1.0, -1.0, -1.0], max_m: [4.0, 1.0, 2.0] };
        let found = clusters(&scan, &Pose::default(), &ground(), &own, &TrackingConfig::default(), 10);
        assert_eq!(found, []);
    }
}
