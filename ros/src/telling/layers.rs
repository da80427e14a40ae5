//! Heights and risks as layers of a grid map.

use terrain::GridGeometry;
use traversability::{GroundFlags, Risk, RiskMapView};

use crate::message::{
    Float32MultiArray, GridMap, GridMapInfo, Header, MultiArrayDimension, MultiArrayLayout, Point, Pose,
};

/// The layers, in their order; the height [m], then what the ground does in the worst heading.
const LAYERS: [&str; 5] = ["elevation", "linear_traction", "angular_traction", "roll", "pitch"];
/// The layer without which nothing is known of a cell.
const BASIC: &str = "linear_traction";

/// A risk map and the heights of its cells [m] by their lattice index, as layers: of tractions the least over all
/// headings, of |roll| and |pitch| [rad] the greatest, half a turn more where the vehicle would touch an obstacle.
/// Where nothing has been seen they are NaN.
pub fn grid_map(
    header: Header,
    map: &RiskMapView<'_>,
    height_m: impl Fn([i64; 2]) -> Option<f32>,
) -> GridMap {
    let GridGeometry { resolution_m, origin, n_rows, n_cols } = map.geometry;
    let heights_m = (0..n_rows as i64).flat_map(|row| (0..n_cols as i64).map(move |col| [col, row]));
    let heights_m = heights_m.map(|[col, row]| height_m([origin[0] + col, origin[1] + row]));
    let mut layers = vec![Vec::with_capacity(n_rows * n_cols); LAYERS.len()];
    for ((height_m, ground), risks) in heights_m.zip(map.ground).zip(map.risks.chunks(map.n_yaws)) {
        let is_unknown = ground.flags.contains(GroundFlags::UNKNOWN);
        let risk = if is_unknown { [f32::NAN; 4] } else { worst(risks) };
        let cell = [height_m.unwrap_or(f32::NAN), risk[0], risk[1], risk[2], risk[3]];
        layers.iter_mut().zip(cell).for_each(|(layer, value)| layer.push(value));
    }
    let layout = layout(n_rows, n_cols);
    let array = |mut data: Vec<f32>| {
        // From the north-east instead of the south-west.
        data.reverse();
        Float32MultiArray { layout: layout.clone(), data }
    };
    let [length_x, length_y] = [n_cols, n_rows].map(|n| n as f64 * resolution_m);
    let [x, y] = origin.map(|index| index as f64 * resolution_m);
    let position = Point { x: x + 0.5 * length_x, y: y + 0.5 * length_y, z: 0.0 };
    GridMap {
        header,
        info: GridMapInfo {
            resolution: resolution_m,
            length_x,
            length_y,
            pose: Pose { position, ..Pose::default() },
        },
        layers: LAYERS.map(str::to_owned).to_vec(),
        basic_layers: vec![BASIC.to_owned()],
        data: layers.into_iter().map(array).collect(),
        outer_start_index: 0,
        inner_start_index: 0,
    }
}

/// The worst that happens in any heading. What is no number stays none.
fn worst(risks: &[Risk]) -> [f32; 4] {
    let worse = |risk: [f32; 4], other: &Risk| {
        let least = |one: f32, other: f32| if other < one || other.is_nan() { other } else { one };
        let greatest = |one: f32, other: f32| if other > one || other.is_nan() { other } else { one };
        [
            least(risk[0], other.linear_traction),
            least(risk[1], other.angular_traction),
            greatest(risk[2], other.roll_rad),
            greatest(risk[3], other.pitch_rad),
        ]
    };
    risks.iter().fold([1.0, 1.0, 0.0, 0.0], worse)
}

fn layout(n_rows: usize, n_cols: usize) -> MultiArrayLayout {
    let dimension = |label: &str, size: usize, stride: usize| MultiArrayDimension {
        label: label.to_owned(),
        size: size as u32,
        stride: stride as u32,
    };
    let dim =
        vec![dimension("column_index", n_rows, n_rows * n_cols), dimension("row_index", n_cols, n_cols)];
    MultiArrayLayout { dim, data_offset: 0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use traversability::Ground;

    #[test]
    fn cells_begin_in_the_north_east_and_run_along_falling_x() {
        let geometry = GridGeometry { resolution_m: 0.5, origin: [-4, 6], n_rows: 2, n_cols: 3 };
        let (mut risks, mut ground) = ([Risk::NONE; 12], [Ground::default(); 6]);
        risks[1] = Risk { linear_traction: 0.25, angular_traction: 0.5, roll_rad: 0.75, pitch_rad: 0.0 };
        risks[0] = Risk { pitch_rad: 0.125, ..Risk::NONE };
        risks[9] = Risk { roll_rad: f32::NAN, ..Risk::NONE };
        ground[5].flags = GroundFlags::UNKNOWN;
        let map = RiskMapView::new(geometry, 2, &risks, &ground).unwrap();
        // The height says where its cell is; of the cell in the south-east none is known.
        let height_m = |[x, y]: [i64; 2]| ([x, y] != [-2, 6]).then_some((10 * x + y) as f32);
        let told = grid_map(Header::default(), &map, height_m);
        assert_eq!(told.layers, LAYERS);
        let [heights_m, linear, angular, roll, pitch] = [0, 1, 2, 3, 4].map(|k| &told.data[k].data);
        assert_eq!(heights_m[0], -13.0, "north-east first");
        assert_eq!(heights_m[1..3], [-23.0, -33.0], "then to the west");
        assert!(heights_m[3].is_nan(), "then the row south of it");
        assert_eq!((linear[5], angular[5], roll[5], pitch[5]), (0.25, 0.5, 0.75, 0.125));
        assert!(linear[0].is_nan() && pitch[0].is_nan(), "nothing is known of it");
        assert_eq!((linear[1], roll[1].is_nan()), (1.0, true));
        assert_eq!((linear[2], angular[2], roll[2], pitch[2]), (1.0, 1.0, 0.0, 0.0));
        let dimensions = told.data[0].layout.dim.iter().map(|dim| (dim.label.as_str(), dim.size, dim.stride));
        assert_eq!(dimensions.collect::<Vec<_>>(), [("column_index", 2, 6), ("row_index", 3, 3)]);
        let GridMapInfo { length_x, length_y, pose, .. } = told.info;
        assert_eq!((length_x, length_y, pose.position.x, pose.position.y), (1.5, 1.0, -1.25, 3.5));
    }
}
