//! The ground as an image: height as colour, slope as light and shadow, and over it what grows, what blocks, what is
//! risky and what was never seen.

use terrain::GridMap;

use super::{DrivePicture, RiskLayer};
use crate::axes::Axes;
use crate::canvas::Image;
use crate::colour::{Ramp, Rgb};

/// Direction towards the sun: from the north-west, 40 degrees high (east, north, up).
const SUN: [f32; 3] = [-0.541_675, 0.541_675, 0.642_788];
/// Light on level ground: this much is left where the sun does not reach.
const AMBIENT: f32 = 0.35;
/// Slope that only one pixel in twenty exceeds after exaggeration; more would drown in shadow.
const STEEP: f32 = 0.7;
/// Opacity of the worst risk.
const RISK_OPACITY: f32 = 0.72;
/// Plants this many wheel radii high are painted as dense as plants get: no wheel crosses them.
const DENSE_FROM_RADII: f32 = 4.0;

/// The map's ground, one pixel of the image per pixel of the axes' frame.
pub(crate) fn relief(picture: &DrivePicture<'_>, axes: &Axes) -> Image {
    let (width, height) = (axes.frame.width as usize, axes.frame.height as usize);
    let raster = Raster { axes, width, height };
    let heights = raster.sampled(|x_m, y_m| smooth_height_m(&picture.world.heights, x_m, y_m));
    let light = raster.light(&heights, picture.world.geometry().resolution_m);
    let (low, high) = extent(&heights);
    let pixels = (0..width * height)
        .map(|i| {
            let [x_m, y_m] = raster.centre_m(i);
            let ground = Ramp::GROUND.at((heights[i] - low) / (high - low).max(0.2)).lit(light[i]);
            let covered = cover(picture, x_m, y_m, light[i], ground);
            let risky = picture.risk.as_ref().map_or(covered, |risk| tint(risk, x_m, y_m, covered));
            let is_unfamiliar = picture.unfamiliar.and_then(|cells| cells.at(x_m, y_m)).is_some_and(|is| *is);
            let hatched = if is_unfamiliar { hatch([i % width, i / width], risky) } else { risky };
            fade(picture.known, x_m, y_m, hatched)
        })
        .collect();
    Image { width, pixels }
}

struct Raster<'a> {
    axes: &'a Axes,
    width: usize,
    height: usize,
}

impl Raster<'_> {
    fn metres_per_pixel(&self) -> f64 {
        self.axes.x.span() / self.width as f64
    }

    /// Centre of a pixel in the map frame [m].
    fn centre_m(&self, index: usize) -> [f64; 2] {
        let (right, down) = ((index % self.width) as f64 + 0.5, (index / self.width) as f64 + 0.5);
        let m = self.metres_per_pixel();
        [self.axes.x.low + right * m, self.axes.y.high - down * m]
    }

    fn sampled(&self, value: impl Fn(f64, f64) -> f32) -> Vec<f32> {
        (0..self.width * self.height)
            .map(|i| {
                let [x_m, y_m] = self.centre_m(i);
                value(x_m, y_m)
            })
            .collect()
    }

    /// Light on every pixel, 1 on level ground. Slopes are taken over at least one cell of the world.
    fn light(&self, heights: &[f32], cell_m: f64) -> Vec<f32> {
        let reach = (cell_m / self.metres_per_pixel()).ceil().max(1.0) as usize;
        let slopes: Vec<[f32; 2]> = (0..heights.len()).map(|i| self.slope(heights, i, reach)).collect();
        let exaggeration = exaggeration(&slopes);
        slopes.iter().map(|&[east, north]| lit([east * exaggeration, north * exaggeration])).collect()
    }

    /// Rise per metre east and north.
    fn slope(&self, heights: &[f32], index: usize, reach: usize) -> [f32; 2] {
        let (col, row) = (index % self.width, index / self.width);
        let (west, east) = (col.saturating_sub(reach), (col + reach).min(self.width - 1));
        let (north, south) = (row.saturating_sub(reach), (row + reach).min(self.height - 1));
        let at = |col: usize, row: usize| heights[row * self.width + col];
        let m = self.metres_per_pixel() as f32;
        [
            (at(east, row) - at(west, row)) / ((east - west).max(1) as f32 * m),
            (at(col, north) - at(col, south)) / ((south - north).max(1) as f32 * m),
        ]
    }
}

/// Bilinear between the cells' centres; beyond the outermost ones, theirs.
fn smooth_height_m(heights: &GridMap<f32>, x_m: f64, y_m: f64) -> f32 {
    let geometry = heights.geometry();
    let [west_m, south_m] = geometry.south_west_m();
    let place = |value_m: f64, low_m: f64, n: usize| {
        let cells = ((value_m - low_m) / geometry.resolution_m - 0.5).clamp(0.0, n as f64 - 1.0);
        let below = (cells as usize).min(n.saturating_sub(2));
        (below, (cells - below as f64) as f32)
    };
    let (col, u) = place(x_m, west_m, geometry.n_cols);
    let (row, v) = place(y_m, south_m, geometry.n_rows);
    let at = |row: usize, col: usize| heights.values()[row * geometry.n_cols + col];
    let south = at(row, col) * (1.0 - u) + at(row, col + 1) * u;
    let north = at(row + 1, col) * (1.0 - u) + at(row + 1, col + 1) * u;
    south * (1.0 - v) + north * v
}

/// How much flat country must be exaggerated to show its shape, and never less than the truth.
fn exaggeration(slopes: &[[f32; 2]]) -> f32 {
    let mut sizes: Vec<f32> = slopes.iter().map(|[east, north]| east.hypot(*north)).collect();
    let rank = sizes.len() * 19 / 20;
    if rank >= sizes.len() {
        return 1.0;
    }
    let steep = *sizes.select_nth_unstable_by(rank, f32::total_cmp).1;
    (STEEP / steep.max(1e-3)).clamp(1.0, 6.0)
}

/// Lambert's law, scaled to 1 on level ground.
pub(crate) fn lit([east, north]: [f32; 2]) -> f32 {
    let length = (east * east + north * north + 1.0).sqrt();
    let sun = ((SUN[2] - SUN[0] * east - SUN[1] * north) / length).max(0.0);
    AMBIENT + (1.0 - AMBIENT) * sun / SUN[2]
}

/// Lowest and highest of the values.
fn extent(values: &[f32]) -> (f32, f32) {
    values.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)))
}

fn cover(picture: &DrivePicture<'_>, x_m: f64, y_m: f64, light: f32, ground: Rgb) -> Rgb {
    let patch = picture.world.patch(x_m, y_m);
    if patch.class == terrain::TerrainClass::Obstacle {
        return ground.blend(Rgb::OBSTACLE, 0.88);
    }
    if patch.vegetation_height_m <= 0.0 {
        return ground;
    }
    let dense_m = DENSE_FROM_RADII * picture.vehicle.geometry.wheel_radius_m as f32;
    let density = (patch.vegetation_height_m / dense_m).min(1.0);
    ground.blend(Rgb::VEGETATION.lit(light), 0.25 + 0.55 * density)
}

fn tint(risk: &RiskLayer<'_>, x_m: f64, y_m: f64, ground: Rgb) -> Rgb {
    match risk.values.at(x_m, y_m) {
        Some(value) if value.is_finite() => {
            let share = risk.share(*value);
            ground.blend(Ramp::RISK.at(share), RISK_OPACITY * share.powf(0.7))
        }
        _ => ground,
    }
}

/// Distance of the lines that hatch unfamiliar ground, and their width [px].
const HATCH: [usize; 2] = [9, 2];

/// Lines from the lower left to the upper right.
pub(super) fn hatch([right, down]: [usize; 2], colour: Rgb) -> Rgb {
    if (right + down) % HATCH[0] < HATCH[1] { colour.blend(Rgb::UNFAMILIAR, 0.75) } else { colour }
}

fn fade(known: Option<&GridMap<bool>>, x_m: f64, y_m: f64, colour: Rgb) -> Rgb {
    match known {
        Some(known) if known.at(x_m, y_m) != Some(&true) => colour.blend(Rgb::UNSEEN, 0.62),
        _ => colour,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axes::Range;
    use crate::canvas::Rect;
    use scenarios::{Patch, Stribeck, World};
    use terrain::GridGeometry;

    /// Flat ground of 8 x 8 m: an obstacle in the north-east, plants in the south-west.
    fn quarters() -> World {
        let geometry = GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows: 8, n_cols: 8 };
        let bare = Patch::open(Stribeck::DIRT);
        let patch = |x: f64, y: f64| match (x > 4.0, y > 4.0) {
            (true, true) => bare.obstructed(2.0),
            (false, false) => bare.overgrown(0.5),
            _ => bare,
        };
        World::from_fn("quarters", geometry, |_, _| 0.0, patch).unwrap()
    }

    #[test]
    fn each_layer_shows_where_it_lies_with_north_up() {
        let world = quarters();
        let mut risk = GridMap::filled(*world.geometry(), f32::NAN);
        let mut known = GridMap::filled(*world.geometry(), true);
        for index in 0..world.geometry().n_cells() {
            let cell = world.geometry().cell(index);
            if cell.row >= 4 && cell.col < 4 {
                risk[cell] = 0.0;
            }
            known[cell] = cell.row >= 4 || cell.col < 4;
        }
        let picture = DrivePicture {
            title: "",
            subtitles: &[],
            world: &world,
            risk: Some(RiskLayer { values: &risk, label: "", harmless: 1.0, worst: 0.0 }),
            known: Some(&known),
            unfamiliar: None,
            driven: &[],
            planned: &[],
            walked: &[],
            areas: None,
            start_m: [1.0, 1.0],
            goal_m: [7.0, 7.0],
            goal_radius_m: 1.0,
            failure: None,
            vehicle: &formats::read_vehicle("pietra_full_size").unwrap(),
        };
        let whole = Range { low: 0.0, high: 8.0 };
        let frame = Rect { x: 0.0, y: 0.0, width: 80.0, height: 80.0 };
        let image = relief(&picture, &Axes { frame, x: whole, y: whole });
        let [north_west, north_east, south_west, south_east] = [(20, 20), (60, 20), (20, 60), (60, 60)]
            .map(|(right, down): (usize, usize)| image.pixels[down * 80 + right]);

        let bare = Ramp::GROUND.at(0.0);
        assert_eq!(north_west, bare.blend(Ramp::RISK.at(1.0), RISK_OPACITY));
        assert_eq!(north_east, bare.blend(Rgb::OBSTACLE, 0.88));
        assert!(south_west.1 > south_west.0 && south_west.1 > south_west.2, "green: {south_west:?}");
        assert_eq!(south_east, bare.blend(Rgb::UNSEEN, 0.62));
    }

    #[test]
    fn level_ground_has_unit_light_and_the_slope_towards_the_sun_more() {
        assert!((lit([0.0, 0.0]) - 1.0).abs() < 1e-6);
        // Rising towards the south-east turns the face to the north-west, where the sun stands.
        assert!(lit([0.3, -0.3]) > 1.1);
        assert!(lit([-0.3, 0.3]) < 0.8);
        // Along the contour line through the sun's direction nothing but the tilt counts: both sides alike.
        assert!((lit([0.3, 0.3]) - lit([-0.3, -0.3])).abs() < 1e-6);
    }

    #[test]
    fn slopes_of_a_plane_are_its_gradient_in_the_map_frame() {
        let frame = Rect { x: 0.0, y: 0.0, width: 30.0, height: 20.0 };
        let axes = Axes { frame, x: Range { low: 5.0, high: 8.0 }, y: Range { low: -1.0, high: 1.0 } };
        let raster = Raster { axes: &axes, width: 30, height: 20 };
        let heights = raster.sampled(|x_m, y_m| (0.3 * x_m - 0.2 * y_m) as f32);
        for index in [0, 29, 315, 599] {
            let [east, north] = raster.slope(&heights, index, 2);
            assert!((east - 0.3).abs() < 1e-4 && (north + 0.2).abs() < 1e-4, "{index}: {east}, {north}");
        }
    }

    #[test]
    fn bilinear_height_reproduces_a_plane_and_holds_it_at_the_border() {
        let geometry = GridGeometry { resolution_m: 0.5, origin: [-4, 6], n_rows: 5, n_cols: 7 };
        let plane = |[x_m, y_m]: [f64; 2]| (0.3 * x_m - 0.2 * y_m + 1.0) as f32;
        let values = (0..geometry.n_cells()).map(|i| plane(geometry.centre_m(geometry.cell(i)))).collect();
        let heights = GridMap::from_values(geometry, values).unwrap();
        for [x_m, y_m] in [[-1.7, 3.3], [0.0, 4.0], [1.2, 5.2], [-0.51, 4.49]] {
            assert!((smooth_height_m(&heights, x_m, y_m) - plane([x_m, y_m])).abs() < 1e-5);
        }
        // The south-west corner takes the value of the nearest centre, (-1.75, 3.25).
        assert!((smooth_height_m(&heights, -2.0, 3.0) - plane([-1.75, 3.25])).abs() < 1e-6);
    }

    #[test]
    fn flat_country_is_exaggerated_and_mountains_are_not() {
        assert_eq!(exaggeration(&[[0.0, 0.0]; 100]), 6.0);
        assert_eq!(exaggeration(&[[0.35, 0.0]; 100]), 2.0);
        assert_eq!(exaggeration(&[[0.0, 1.5]; 100]), 1.0);
    }
}
