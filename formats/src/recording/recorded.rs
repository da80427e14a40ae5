//! Grids and clouds of a recording, back from Foxglove's schemas.

use std::io;
use std::path::Path;

use foxglove::Decode;
use foxglove::messages::{Grid, PackedElementField, PointCloud, SceneUpdate};
use terrain::{GridGeometry, GridMap, Knowledge, RangePoint, Scan, SurfaceCell, TerrainClass};
use traversability::{Ground, GroundFlags};

use super::{RecordedMessage, grids, open_recording, scene};

/// Topic of the maps of the ground.
pub(super) const ELEVATION: &str = "/elevation";

/// Finest and coarsest cells that are believed [m].
const RESOLUTION_M: [f64; 2] = [1e-3, 1e3];
/// Farthest corner that is believed [m].
const CORNER_MAX_M: f64 = 1e8;

/// A risk map as it is recorded: at the yaw of the vehicle alone.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedRisk {
    /// Where the cells lie.
    pub geometry: GridGeometry,
    /// Linear and angular traction [-], worst |roll| and |pitch| [rad] of every cell.
    pub risks: Vec<[f32; 4]>,
    /// Class and flags of every cell; no slope is recorded.
    pub ground: Vec<Ground>,
}

/// The map of the ground in a message of topic `/elevation`. The likeliest class is recorded, as if it were certain.
///
/// Errors: what was expected and found, for a message that is no such map.
pub fn recorded_elevation(message: &RecordedMessage) -> Result<GridMap<SurfaceCell>, String> {
    let (geometry, cells) = cells(message, &grids::elevation_fields())?;
    let values = cells.iter().map(|bytes| surface_cell(bytes)).collect::<Result<Vec<_>, _>>()?;
    GridMap::from_values(geometry, values).ok_or_else(|| "expected a value for every cell".to_owned())
}

/// Every map of the ground in a recording, with its time [ns]; of one that breaks off, those before that place.
///
/// Errors: the file cannot be opened.
pub fn read_recorded_maps(path: &Path) -> io::Result<Vec<(u64, GridMap<SurfaceCell>)>> {
    let mut maps = Vec::new();
    // What is wrong with the file, whoever reads its drive log is told.
    let _problem = open_recording(path)?.take_all(|message| {
        if message.channel.topic == ELEVATION {
            maps.push((message.log_time_ns, recorded_elevation(&message)?));
        }
        Ok(())
    });
    Ok(maps)
}

/// The risks in a message of topic `/risk`.
///
/// Errors: those of [`recorded_elevation`].
pub fn recorded_risk(message: &RecordedMessage) -> Result<RecordedRisk, String> {
    let (geometry, cells) = cells(message, &grids::risk_fields())?;
    let risks = cells.iter().map(|bytes| [0, 4, 8, 12].map(|place| number(bytes, place))).collect();
    let ground = cells.iter().map(|bytes| {
        let class = class(bytes[16])? as u8;
        Ok(Ground { class, flags: GroundFlags(bytes[17]), ..Ground::default() })
    });
    let ground = ground.collect::<Result<Vec<_>, String>>()?;
    Ok(RecordedRisk { geometry, risks, ground })
}

/// The sweep in a message of topic `/scan`, in the body frame.
///
/// Errors: those of [`recorded_elevation`].
pub fn recorded_scan(message: &RecordedMessage) -> Result<Scan, String> {
    let cloud = PointCloud::decode(&message.data[..]).map_err(|error| error.to_string())?;
    let expected = scene::point_fields();
    require_fields(&cloud.fields, &expected)?;
    if cloud.point_stride as usize != scene::POINT_BYTES {
        return Err(format!("expected points of {} bytes, found {}", scene::POINT_BYTES, cloud.point_stride));
    }
    let points = cloud.data.chunks_exact(scene::POINT_BYTES).map(|bytes| {
        let position_m = [0, 4, 8].map(|place| number(bytes, place));
        Ok(RangePoint { position_m, class: class(bytes[12])? })
    });
    let points = points.collect::<Result<Vec<_>, String>>()?;
    Ok(Scan { valid_at_ns: message.log_time_ns, points, ..Scan::default() })
}

/// The points of the best future in a message of topic `/rollouts` [m], in the map frame; none where nothing was tried.
///
/// Errors: those of [`recorded_elevation`].
pub fn recorded_best_rollout(message: &RecordedMessage) -> Result<Vec<[f64; 3]>, String> {
    let scene = SceneUpdate::decode(&message.data[..]).map_err(|error| error.to_string())?;
    let lines = scene.entities.into_iter().flat_map(|entity| entity.lines);
    let best = lines.map(|line| line.points).next().unwrap_or_default();
    Ok(best.iter().map(|point| [point.x, point.y, point.z]).collect())
}

fn surface_cell(bytes: &[u8]) -> Result<SurfaceCell, String> {
    let knowledge = match bytes[13] {
        0 => Knowledge::Unknown,
        1 => Knowledge::Interpolated,
        2 => Knowledge::Measured,
        other => return Err(format!("expected knowledge from 0 to 2, found {other}")),
    };
    let class = class(bytes[12])?;
    let mut cell = SurfaceCell::certain(number(bytes, 0), class, number(bytes, 8));
    if knowledge == Knowledge::Unknown && class != TerrainClass::Obstacle {
        cell = SurfaceCell::UNKNOWN;
    }
    Ok(SurfaceCell { height_variance_m2: number(bytes, 4), knowledge, ..cell })
}

fn class(number: u8) -> Result<TerrainClass, String> {
    let class = TerrainClass::ALL.get(usize::from(number)).copied();
    class.ok_or_else(|| format!("expected a class from 0 to 3, found {number}"))
}

/// Four bytes of a cell, which has them.
fn number(bytes: &[u8], place: usize) -> f32 {
    let mut own = [0; 4];
    own.copy_from_slice(&bytes[place..place + 4]);
    f32::from_le_bytes(own)
}

/// Where the cells lie, and the bytes of each.
fn cells(
    message: &RecordedMessage,
    expected: &[PackedElementField],
) -> Result<(GridGeometry, Vec<Vec<u8>>), String> {
    let grid = Grid::decode(&message.data[..]).map_err(|error| error.to_string())?;
    require_fields(&grid.fields, expected)?;
    let stride = expected.last().map_or(0, |last| last.offset as usize + 1);
    let n_cols = grid.column_count as usize;
    let fits = n_cols > 0
        && grid.cell_stride as usize == stride
        && grid.row_stride as usize == n_cols * stride
        && !grid.data.is_empty()
        && grid.data.len().is_multiple_of(n_cols * stride);
    if !fits {
        return Err(format!(
            "expected rows of cells of {stride} bytes, found {} columns of {} bytes in {} bytes",
            grid.column_count,
            grid.cell_stride,
            grid.data.len()
        ));
    }
    let resolution_m = grid.cell_size.map_or(f64::NAN, |size| size.x);
    let corner =
        grid.pose.and_then(|pose| pose.position).map_or([f64::NAN; 2], |corner| [corner.x, corner.y]);
    let is_placed = (RESOLUTION_M[0]..=RESOLUTION_M[1]).contains(&resolution_m)
        && corner.iter().all(|along| along.abs() <= CORNER_MAX_M);
    if !is_placed {
        return Err(format!(
            "expected cells of a finite size and place, found {resolution_m} m at {corner:?}"
        ));
    }
    let origin = corner.map(|along| (along / resolution_m).round() as i64);
    let n_rows = grid.data.len() / (n_cols * stride);
    let geometry = GridGeometry { resolution_m, origin, n_rows, n_cols };
    Ok((geometry, grid.data.chunks_exact(stride).map(<[u8]>::to_vec).collect()))
}

fn require_fields(found: &[PackedElementField], expected: &[PackedElementField]) -> Result<(), String> {
    let names = |fields: &[PackedElementField]| {
        fields.iter().map(|field| field.name.as_str()).collect::<Vec<_>>().join(", ")
    };
    if found == expected {
        Ok(())
    } else {
        Err(format!("expected the fields {}, found {}", names(expected), names(found)))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use foxglove::Encode;
    use traversability::{Risk, RiskMap};

    use super::*;

    fn message(encoded: &impl Encode) -> RecordedMessage {
        let mut data = Vec::new();
        assert!(encoded.encode(&mut data).is_ok());
        RecordedMessage { channel: Arc::default(), log_time_ns: 7, data }
    }

    fn geometry() -> GridGeometry {
        GridGeometry { resolution_m: 0.2, origin: [-40, 15], n_rows: 3, n_cols: 3 }
    }

    #[test]
    fn a_map_of_the_ground_comes_back_as_it_went() {
        let mut values = vec![SurfaceCell::certain(1.5, TerrainClass::Vegetation, 0.4); 9];
        values[1] = SurfaceCell::UNKNOWN;
        values[2].knowledge = Knowledge::Interpolated;
        values[2].height_variance_m2 = 0.25;
        let map = GridMap::from_values(geometry(), values).unwrap();
        let back = recorded_elevation(&message(&grids::elevation(7, &map))).unwrap();
        assert_eq!(back.geometry(), map.geometry());
        assert_eq!(format!("{:?}", back.values()), format!("{:?}", map.values()));
    }

    #[test]
    fn risks_come_back_at_the_yaw_that_was_recorded() {
        let mut map = RiskMap::constant(geometry(), 4, Risk::OUTSIDE);
        map.fill(|risks, ground| {
            risks[4 * 4 + 1] =
                Risk { linear_traction: 0.5, angular_traction: 0.25, roll_rad: 0.1, pitch_rad: 0.2 };
            ground[4].flags = GroundFlags::UNKNOWN;
        });
        let yaw_rad = 0.75 * std::f64::consts::PI;
        let back = recorded_risk(&message(&grids::risk(7, &map.view(), yaw_rad))).unwrap();
        assert_eq!(back.risks[4], [0.5, 0.25, 0.1, 0.2]);
        assert_eq!((back.ground[4].flags, back.geometry), (GroundFlags::UNKNOWN, geometry()));
    }

    #[test]
    fn a_sweep_comes_back_as_it_went() {
        let points = vec![RangePoint { position_m: [1.0, -2.0, 0.5], class: TerrainClass::Obstacle }; 3];
        let scan = Scan { valid_at_ns: 7, points, ..Scan::default() };
        assert_eq!(recorded_scan(&message(&scene::point_cloud(7, &scan))).unwrap().points, scan.points);
    }

    #[test]
    fn the_best_future_comes_back_as_it_went() {
        let best = vec![[0.0, 1.0, 2.0], [0.5, -1.25, 2.5]];
        let told = message(&scene::rollouts(7, &[best.clone(), vec![[9.0; 3]]]));
        assert_eq!(recorded_best_rollout(&told), Ok(best));
        assert_eq!(recorded_best_rollout(&message(&scene::rollouts(7, &[]))), Ok(Vec::new()));
    }

    #[test]
    fn what_is_no_map_is_refused() {
        let map = GridMap::from_values(geometry(), vec![SurfaceCell::UNKNOWN; 9]).unwrap();
        let whole = grids::elevation(7, &map);
        let told = |grid: &Grid| recorded_elevation(&message(grid)).unwrap_err();
        let torn = Grid { data: whole.data.slice(1..), ..whole.clone() };
        assert!(told(&torn).contains("expected rows of cells of 14 bytes"), "{}", told(&torn));
        let nowhere = Grid { pose: None, ..whole.clone() };
        assert!(told(&nowhere).contains("finite size and place"), "{}", told(&nowhere));
        let other = Grid { fields: Vec::new(), ..whole.clone() };
        assert!(told(&other).contains("expected the fields height_m"), "{}", told(&other));
        let garbage = RecordedMessage { channel: Arc::default(), log_time_ns: 0, data: vec![0xff; 9] };
        assert!(recorded_elevation(&garbage).is_err() && recorded_risk(&garbage).is_err());
        assert!(recorded_scan(&garbage).is_err());
    }
}
