//! What payloads hold, how maps lie in them, and what makes a message malformed.

mod check;

use terrain::{GridGeometry, GridMap, Knowledge, SurfaceCell, TerrainClass};
use traversability::{Ground, Risk, RiskMapView};
use xxhash_rust::xxh3::xxh3_64;

use crate::message::{RiskHeader, SurfaceHeader};
pub(crate) use check::{
    check_anything, check_checkpoint, check_command, check_futures, check_imu, check_mission, check_odometry,
    check_order, check_plan, check_risk, check_scan, check_stuck, check_surface, check_tracks,
};

/// Yaw bins beyond which nobody believes a map.
const YAWS_MAX: u64 = 1024;
/// Headings for which times are told of a vehicle with a turning circle.
pub const HEADINGS: usize = 16;
/// Bytes of an element of a risk map.
const QUAD: usize = size_of::<[f32; 4]>();

/// Where the parts of a risk map lie in its payload, in elements of four f32: risks [row, col, yaw], then grounds
/// [row, col] of twelve bytes, then times to the goal [row, col] and, of a vehicle with a turning circle, what that adds
/// [heading, row, col], each part filled up to whole elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RiskParts {
    n_cells: usize,
    n_risks: usize,
    n_ground_elements: usize,
    n_headings: usize,
}

impl RiskParts {
    /// The parts of a map of this shape, with what turning adds for so many headings.
    pub fn new(geometry: &GridGeometry, n_yaws: usize, n_headings: usize) -> Self {
        let n_cells = geometry.n_cells();
        Self {
            n_cells,
            n_risks: n_cells * n_yaws,
            n_ground_elements: (n_cells * size_of::<Ground>()).div_ceil(QUAD),
            n_headings,
        }
    }

    /// Elements of the whole payload.
    pub fn n_elements(&self) -> usize {
        let n_times = self.n_cells * (1 + self.n_headings);
        self.n_risks + self.n_ground_elements + (n_times * size_of::<f32>()).div_ceil(QUAD)
    }

    /// The risks.
    pub fn risks<'a>(&self, payload: &'a [[f32; 4]]) -> &'a [Risk] {
        bytemuck::cast_slice(&payload[..self.n_risks])
    }

    /// The risks, to be changed in place.
    pub fn risks_mut<'a>(&self, payload: &'a mut [[f32; 4]]) -> &'a mut [Risk] {
        bytemuck::cast_slice_mut(&mut payload[..self.n_risks])
    }

    /// The grounds.
    pub fn ground<'a>(&self, payload: &'a [[f32; 4]]) -> &'a [Ground] {
        let part = &payload[self.n_risks..][..self.n_ground_elements];
        let bytes: &[u8] = bytemuck::cast_slice(part);
        bytemuck::cast_slice(&bytes[..self.n_cells * size_of::<Ground>()])
    }

    /// The times to the goal.
    pub fn times<'a>(&self, payload: &'a [[f32; 4]]) -> TimesView<'a> {
        let part = payload[self.n_risks + self.n_ground_elements..].as_flattened();
        let (seconds, rest) = part.split_at(self.n_cells);
        TimesView { seconds, turning_s: &rest[..self.n_headings * self.n_cells] }
    }

    /// The times to the goal and what turning adds to them, to be written in place [s].
    pub fn times_mut<'a>(&self, payload: &'a mut [[f32; 4]]) -> [&'a mut [f32]; 2] {
        let part = payload[self.n_risks + self.n_ground_elements..].as_flattened_mut();
        let (seconds, rest) = part.split_at_mut(self.n_cells);
        [seconds, &mut rest[..self.n_headings * self.n_cells]]
    }

    /// The element at a place of a payload that says what `known` does; times to the goal are zero.
    pub fn element(&self, known: &RiskMapView<'_>, place: usize) -> [f32; 4] {
        if let Some(risk) = known.risks.get(place) {
            return [risk.linear_traction, risk.angular_traction, risk.roll_rad, risk.pitch_rad];
        }
        let first = 4 * (place - self.n_risks);
        [0, 1, 2, 3].map(|k| {
            let word = first + k;
            let Some(ground) = known.ground.get(word / 3) else { return 0.0 };
            match word % 3 {
                axis @ (0 | 1) => ground.gradient[axis],
                _ => f32::from_bits(u32::from_le_bytes([
                    ground.class,
                    ground.flags.0,
                    ground.friction.hundredths(),
                    ground.speed.tenths(),
                ])),
            }
        })
    }
}

/// Times to the goal, where their message lies.
#[derive(Clone, Copy, Debug)]
pub struct TimesView<'a> {
    /// Least times, whatever the heading [s], shape [row, col].
    pub seconds: &'a [f32],
    /// What keeping to the turning circle adds [s], shape [heading, row, col]; empty of a vehicle without one.
    pub turning_s: &'a [f32],
}

/// A risk map as the controller reads it, where its message lies, and the times to the goal.
pub fn risk_views<'a>(
    header: &RiskHeader,
    payload: &'a [[f32; 4]],
) -> Option<(RiskMapView<'a>, TimesView<'a>)> {
    let geometry = header.grid.geometry()?;
    let n_yaws = (1..=YAWS_MAX).contains(&header.n_yaws).then_some(header.n_yaws as usize)?;
    // Times are interpolated between cells: one row or column has nothing to interpolate between.
    let geometry = Some(geometry).filter(|geometry| geometry.n_rows.min(geometry.n_cols) >= 2)?;
    let n_headings = [0, HEADINGS].into_iter().find(|n| *n as u64 == header.n_headings)?;
    let parts = RiskParts::new(&geometry, n_yaws, n_headings);
    if parts.n_elements() != payload.len() {
        return None;
    }
    let map = RiskMapView::new(geometry, n_yaws, parts.risks(payload), parts.ground(payload)).ok()?;
    Some((map, parts.times(payload)))
}

/// Hash of a payload, as headers carry it.
pub fn content_hash<T: bytemuck::NoUninit>(payload: &[T]) -> u64 {
    xxh3_64(bytemuck::cast_slice(payload))
}

/// A cell of the map of the ground as eight numbers: height, its variance, height of vegetation, probabilities of the
/// four classes, and how the height came to be known (0 unknown, 1 interpolated, 2 measured).
pub fn cell_numbers(cell: &SurfaceCell) -> [f32; 8] {
    let [open, loose, vegetation, obstacle] = cell.class_probability;
    let knowledge = f32::from(cell.knowledge as u8);
    let SurfaceCell { height_m, height_variance_m2, vegetation_height_m, .. } = *cell;
    [height_m, height_variance_m2, vegetation_height_m, open, loose, vegetation, obstacle, knowledge]
}

/// The cell that eight numbers tell of; `None` when they cannot be a cell's.
pub fn numbers_cell(numbers: &[f32; 8]) -> Option<SurfaceCell> {
    let [height_m, height_variance_m2, vegetation_height_m, open, loose, vegetation, obstacle, knowledge] =
        *numbers;
    let knowledge = if knowledge == 0.0 {
        Knowledge::Unknown
    } else if knowledge == 1.0 {
        Knowledge::Interpolated
    } else if knowledge == 2.0 {
        Knowledge::Measured
    } else {
        return None;
    };
    let class_probability: [f32; TerrainClass::COUNT] = [open, loose, vegetation, obstacle];
    let is_known = knowledge != Knowledge::Unknown;
    let is_height = height_m.is_finite() && height_variance_m2.is_finite() && height_variance_m2 >= 0.0;
    let are_shares = class_probability.iter().all(|share| (0.0..=1.0 + 1e-4).contains(share));
    let is_sound = (!is_known || is_height) && are_shares && vegetation_height_m.is_finite();
    is_sound.then_some(SurfaceCell {
        height_m,
        height_variance_m2,
        vegetation_height_m,
        class_probability,
        knowledge,
    })
}

/// A surface message as a map; `None` when it is none.
pub fn surface_map(header: &SurfaceHeader, payload: &[[f32; 8]]) -> Option<GridMap<SurfaceCell>> {
    let cells = payload.iter().map(numbers_cell).collect::<Option<Vec<_>>>()?;
    GridMap::from_values(header.grid.geometry()?, cells)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::channel::{FUTURE_NS, Refusal};
    use crate::message::{
        CheckpointHeader, CommandRecord, FutureRecord, Grid, ImuRecord, MissionRecord, OrderHeader,
        PlanRecord, PointRecord, ScanHeader, Stamp, StuckRecord, TRACKS_MAX, TrackRecord, TracksHeader,
    };
    use traversability::{FrictionLimit, GroundFlags, RiskMap, SpeedLimit};

    /// A map of odd sizes, so that every part ends within an element, and its message.
    fn told() -> (RiskMap, RiskHeader, Vec<[f32; 4]>) {
        let geometry = GridGeometry { resolution_m: 0.2, origin: [-3, 4], n_rows: 3, n_cols: 5 };
        let mut map = RiskMap::constant(geometry, 3, Risk::NONE);
        map.fill(|risks, ground| {
            for (k, risk) in risks.iter_mut().enumerate() {
                risk.pitch_rad = k as f32;
            }
            for (k, ground) in ground.iter_mut().enumerate() {
                *ground = Ground {
                    gradient: [k as f32, -0.5],
                    class: (k % 4) as u8,
                    flags: GroundFlags(k as u8),
                    friction: FrictionLimit::new(0.01 * (k % 90 + 1) as f32),
                    speed: SpeedLimit::new(0.1 * (k % 200 + 1) as f32),
                };
            }
        });
        let parts = RiskParts::new(&geometry, 3, 0);
        let known = map.view();
        let payload = (0..parts.n_elements()).map(|place| parts.element(&known, place)).collect();
        let header =
            RiskHeader { grid: Grid::from(&geometry), n_yaws: 3, map_source: 1, ..RiskHeader::default() };
        (map, header, payload)
    }

    #[test]
    fn inertial_samples_come_in_order_and_are_numbers() {
        let stamp = Stamp { published_at_ns: 1_000_000_000, ..Stamp::default() };
        let at = |valid_at_ns| ImuRecord {
            valid_at_ns,
            acceleration_mps2: [0.0, 0.0, 9.81],
            ..ImuRecord::default()
        };
        assert_eq!(check_imu(&stamp, &[at(5), at(9)]), Ok(()));
        assert_eq!(check_imu(&stamp, &[]), Err(Refusal::Malformed));
        assert_eq!(check_imu(&stamp, &[at(9), at(9)]), Err(Refusal::Malformed), "the same time twice");
        assert_eq!(check_imu(&stamp, &[at(1_000_000_000 + FUTURE_NS + 1)]), Err(Refusal::FromFuture));
        let broken = ImuRecord { angular_rate_radps: [0.0, f32::NAN, 0.0], ..at(10) };
        assert_eq!(check_imu(&stamp, &[at(5), broken]), Err(Refusal::NonFinite));
    }

    #[test]
    fn tracks_that_cannot_be_are_refused() {
        let (header, track) = (TracksHeader::default(), TrackRecord { number: 1, ..TrackRecord::default() });
        assert_eq!(check_tracks(&header, &[]), Ok(()), "nothing moves");
        assert_eq!(check_tracks(&header, &[track; TRACKS_MAX]), Ok(()));
        assert_eq!(check_tracks(&header, &[track; TRACKS_MAX + 1]), Err(Refusal::Malformed));
        for broken in [
            TrackRecord { position_m: [0.0, f64::NAN], ..track },
            TrackRecord { velocity_mps: [f64::INFINITY, 0.0], ..track },
            TrackRecord { cross_m2ps: f64::NAN, ..track },
            TrackRecord { radius_m: f64::INFINITY, ..track },
        ] {
            assert_eq!(check_tracks(&header, &[track, broken]), Err(Refusal::NonFinite), "{broken:?}");
        }
        for broken in [
            TrackRecord { radius_m: -0.1, ..track },
            TrackRecord { position_m2: -0.1, ..track },
            TrackRecord { velocity_m2ps2: -0.1, ..track },
        ] {
            assert_eq!(check_tracks(&header, &[broken]), Err(Refusal::Malformed), "{broken:?}");
        }
    }

    #[test]
    fn a_risk_map_is_read_where_its_message_lies() {
        let (map, header, mut payload) = told();
        let parts = RiskParts::new(map.geometry(), 3, 0);
        parts.times_mut(&mut payload)[0][14] = 7.0;
        let (view, times) = risk_views(&header, &payload).unwrap();
        assert_eq!((view.risks, view.ground), (map.view().risks, map.view().ground));
        assert_eq!((times.seconds.len(), times.seconds[14], times.turning_s.len()), (15, 7.0, 0));
        assert_eq!(view.risks.as_ptr().cast(), payload.as_ptr(), "no copy");
        assert_eq!(check_risk(&header, &payload), Ok(()));
    }

    #[test]
    fn what_turning_adds_is_told_for_sixteen_headings_or_none() {
        let (map, header, _) = told();
        let parts = RiskParts::new(map.geometry(), 3, HEADINGS);
        let known = map.view();
        let mut payload: Vec<[f32; 4]> =
            (0..parts.n_elements()).map(|place| parts.element(&known, place)).collect();
        let [seconds, turning_s] = parts.times_mut(&mut payload);
        assert_eq!((seconds.len(), turning_s.len()), (15, HEADINGS * 15));
        (seconds[14], turning_s[HEADINGS * 15 - 1]) = (7.0, 3.0);
        let header = RiskHeader { n_headings: HEADINGS as u64, ..header };
        let (view, times) = risk_views(&header, &payload).unwrap();
        assert_eq!(view.ground, known.ground);
        assert_eq!((times.seconds[14], times.turning_s[HEADINGS * 15 - 1]), (7.0, 3.0));
        assert_eq!(check_risk(&header, &payload), Ok(()));
        for n_headings in [0, 1, 15, 17, u64::MAX] {
            let refused = check_risk(&RiskHeader { n_headings, ..header }, &payload);
            assert_eq!(refused, Err(Refusal::Malformed), "{n_headings}");
        }
        parts.times_mut(&mut payload)[1][40] = f32::NAN;
        assert_eq!(check_risk(&header, &payload), Err(Refusal::NonFinite));
    }

    #[test]
    fn risk_maps_that_cannot_be_are_refused() {
        let (map, header, payload) = told();
        let refused = |header: RiskHeader, payload: &[[f32; 4]]| check_risk(&header, payload).unwrap_err();
        assert_eq!(refused(header, &payload[1..]), Refusal::Malformed);
        assert_eq!(refused(RiskHeader { n_yaws: u64::MAX, ..header }, &payload), Refusal::Malformed);
        assert_eq!(refused(RiskHeader { n_yaws: 0, ..header }, &payload), Refusal::Malformed);
        assert_eq!(refused(RiskHeader { map_source: 3, ..header }, &payload), Refusal::Malformed);
        let huge = Grid { n_rows: u64::MAX, ..header.grid };
        assert_eq!(refused(RiskHeader { grid: huge, ..header }, &payload), Refusal::Malformed);
        // Times are interpolated between rows: one alone is none, however right its length is.
        let row = GridGeometry { resolution_m: 0.2, origin: [0, 0], n_rows: 1, n_cols: 5 };
        let lone = RiskHeader { grid: Grid::from(&row), ..header };
        let length = RiskParts::new(&row, 3, 0).n_elements();
        assert_eq!(refused(lone, &vec![[0.0; 4]; length]), Refusal::Malformed);
        let parts = RiskParts::new(map.geometry(), 3, 0);
        let n_risks = parts.n_risks;
        for (place, k) in [(0, 0), (n_risks - 1, 3), (n_risks, 0), (payload.len() - 1, 1)] {
            for value in [f32::NAN, f32::INFINITY] {
                let mut broken = payload.clone();
                broken[place][k] = value;
                assert_eq!(refused(header, &broken), Refusal::NonFinite, "{place} {k}");
            }
        }
        let mut broken = payload;
        broken[n_risks][2] = f32::from_bits(4);
        assert_eq!(refused(header, &broken), Refusal::Malformed, "a class that there is not");
    }

    #[test]
    fn cells_survive_the_way_and_what_is_none_is_refused() {
        let known = SurfaceCell::certain(1.5, TerrainClass::Loose, 0.2);
        assert_eq!(numbers_cell(&cell_numbers(&known)), Some(known));
        let unknown = numbers_cell(&cell_numbers(&SurfaceCell::UNKNOWN)).unwrap();
        assert!(unknown.height_m.is_nan() && !unknown.is_known());
        let numbers = cell_numbers(&known);
        for (place, value) in [(0, f32::NAN), (1, -1.0), (2, f32::INFINITY), (3, 1.5), (6, -0.1), (7, 0.5)] {
            let mut broken = numbers;
            broken[place] = value;
            assert_eq!(numbers_cell(&broken), None, "{place}");
        }
    }

    #[test]
    fn small_messages_are_one_record_of_numbers() {
        let stamp = Stamp::default();
        let drive = CommandRecord { speed_mps: 1.0, decision: 1, ..CommandRecord::default() };
        assert_eq!(check_command(&stamp, &[drive]), Ok(()));
        assert_eq!(check_command(&stamp, &[]), Err(Refusal::Malformed));
        assert_eq!(check_command(&stamp, &[drive, drive]), Err(Refusal::Malformed));
        let wild = CommandRecord { steering_rad: f32::NAN, ..drive };
        assert_eq!(check_command(&stamp, &[wild]), Err(Refusal::NonFinite));
        assert_eq!(check_command(&stamp, &[CommandRecord::default()]), Err(Refusal::Malformed));
        let unborn = CommandRecord { scan_at_ns: FUTURE_NS + 1, ..drive };
        assert_eq!(check_command(&stamp, &[unborn]), Err(Refusal::FromFuture));
        let lost = StuckRecord { yaw_rad: f64::INFINITY, ..StuckRecord::default() };
        assert_eq!(check_stuck(&stamp, &[lost]), Err(Refusal::NonFinite));
        let nowhere = MissionRecord { goal_m: [0.0, f64::NAN], ..MissionRecord::default() };
        assert_eq!(check_mission(&stamp, &[nowhere]), Err(Refusal::NonFinite));
    }

    #[test]
    fn a_plan_is_places_of_numbers() {
        let (stamp, place) = (Stamp::default(), PlanRecord::default());
        assert_eq!(check_plan(&stamp, &[place, place]), Ok(()));
        assert_eq!(check_plan(&stamp, &[]), Err(Refusal::Malformed));
        let nowhere = PlanRecord { position_m: [0.0, f64::NAN], ..place };
        let wild = PlanRecord { speed_mps: f64::INFINITY, ..place };
        for broken in [nowhere, wild] {
            assert_eq!(check_plan(&stamp, &[place, broken]), Err(Refusal::NonFinite));
        }
    }

    #[test]
    fn futures_are_places_of_numbers_with_costs_that_are_some() {
        let (stamp, place) = (Stamp::default(), FutureRecord::default());
        assert_eq!(check_futures(&stamp, &[place, place]), Ok(()));
        assert_eq!(check_futures(&stamp, &[]), Err(Refusal::Malformed));
        let nowhere = FutureRecord { position_m: [f64::NAN, 0.0], ..place };
        let priceless = FutureRecord { cost_s: f64::INFINITY, ..place };
        for broken in [nowhere, priceless] {
            assert_eq!(check_futures(&stamp, &[place, broken]), Err(Refusal::NonFinite));
        }
    }

    #[test]
    fn missions_and_orders_that_cannot_be_are_refused() {
        let (stamp, whole) = (Stamp::default(), MissionRecord::default());
        assert_eq!(check_mission(&stamp, &[whole]), Ok(()));
        let path = MissionRecord { path_speed_mps: 1.0, n_corners: 2, ..whole };
        assert_eq!(check_mission(&stamp, &[path]), Ok(()));
        for broken in [
            MissionRecord { state: 5, ..whole },
            MissionRecord { n_corners: 33, ..path },
            MissionRecord { n_corners: 1, ..path },
            MissionRecord { path_speed_mps: -1.0, ..path },
            MissionRecord { alpha: 1.1, ..whole },
            MissionRecord { tolerance_m: -0.1, ..whole },
        ] {
            assert_eq!(check_mission(&stamp, &[broken]), Err(Refusal::Malformed), "{broken:?}");
        }
        let mut lost = path;
        lost.corner_y_m[31] = f64::NAN;
        assert_eq!(check_mission(&stamp, &[lost]), Err(Refusal::NonFinite));
        let order = OrderHeader::default();
        assert_eq!(check_order(&order, &[[0.0, 1.0]]), Ok(()));
        assert_eq!(check_order(&order, &[[0.0, f64::INFINITY]]), Err(Refusal::NonFinite));
        assert_eq!(check_order(&OrderHeader { alpha: f64::NAN, ..order }, &[]), Err(Refusal::NonFinite));
    }

    #[test]
    fn scans_from_nowhere_and_networks_shorter_than_they_say_are_refused() {
        let scan = ScanHeader { origin_m: [0.0, 0.0, 1.5], ..ScanHeader::default() };
        let broken = PointRecord { position_m: [f32::NAN; 3], ..PointRecord::default() };
        assert_eq!(check_scan(&scan, &[broken]), Ok(()), "a point that is none is the map's to drop");
        for value in [f32::NAN, f32::INFINITY] {
            let nowhere = ScanHeader { origin_m: [0.0, value, 1.5], ..scan };
            assert_eq!(check_scan(&nowhere, &[]), Err(Refusal::NonFinite));
        }
        let networks = CheckpointHeader { n_weight_bytes: 4, ..CheckpointHeader::default() };
        assert_eq!(check_checkpoint(&networks, &[0; 5]), Ok(()));
        assert_eq!(check_checkpoint(&networks, &[0; 3]), Err(Refusal::Malformed));
        for place in [0, 1] {
            let mut odd = networks;
            odd.recent_emd2[place] = f64::NAN;
            assert_eq!(check_checkpoint(&odd, &[0; 5]), Err(Refusal::NonFinite));
            let mut odd = networks;
            odd.original_emd2[place] = f64::INFINITY;
            assert_eq!(check_checkpoint(&odd, &[0; 5]), Err(Refusal::NonFinite));
        }
    }
}
