//! A surface message becomes a risk map's: the work of learning, of mapping while learning is silent, and of replay.

use crate::intake::shift_of;
use navigator::{Assessor, Jump, NavigatorError, StuckPose};
use terrain::{Cell, CellRegion, GridMap, SurfaceCell};
use traversability::{CvarLevel, RiskMapView};

use bus::channel::Refusal;
use bus::message::{Grid, MissionRecord, RiskHeader, Source, Stamp, StuckRecord, SurfaceHeader};
use bus::payload::{self, RiskParts};

/// Makes risk maps of the surfaces that it is shown, and judges only what has changed since the last one.
pub struct RiskMaker {
    assessor: Assessor,
    author: u64,
    checkpoint: u64,
    mirror: Option<GridMap<SurfaceCell>>,
    surface: Source,
    odometry_at_ns: u64,
    shift: (u64, Jump),
    stuck: Source,
    goal_m: Option<[f64; 2]>,
}

impl RiskMaker {
    /// A maker by this assessor; `author` and `checkpoint` are those of [`RiskHeader`].
    pub fn new(assessor: Assessor, author: u64, checkpoint: u64) -> Self {
        Self {
            assessor,
            author,
            checkpoint,
            mirror: None,
            surface: Source::default(),
            odometry_at_ns: 0,
            shift: (0, Jump::NONE),
            stuck: Source::default(),
            goal_m: None,
        }
    }

    /// Judges the ground by other networks from now on, the next time as a whole. What driving has proved stays, and so
    /// does the share of outcomes.
    pub fn judge_by(&mut self, mut assessor: Assessor, checkpoint: u64) -> Result<(), NavigatorError> {
        self.assessor.stuck().iter().for_each(|pose| assessor.note_stuck(*pose));
        assessor.judge_at(self.assessor.level())?;
        (self.assessor, self.checkpoint, self.mirror) = (assessor, checkpoint, None);
        Ok(())
    }

    /// Follows what was said of where to go, and for which share of outcomes to plan.
    pub fn follow(&mut self, mission: &MissionRecord) -> Result<(), NavigatorError> {
        self.goal_m = mission.destination_m().or(self.goal_m);
        mission.level().map_or(Ok(()), |level| self.assessor.judge_at(level))
    }

    /// Judges for this share of the worst outcomes from now on.
    pub fn judge_at(&mut self, level: CvarLevel) -> Result<(), NavigatorError> {
        self.assessor.judge_at(level)
    }

    /// The networks that it judges by, as [`RiskHeader::checkpoint`].
    pub fn checkpoint(&self) -> u64 {
        self.checkpoint
    }

    /// Where the times to the goal shall lead from now on.
    pub fn set_goal(&mut self, goal_m: [f64; 2]) {
        self.goal_m = Some(goal_m);
    }

    /// Whether it has been said where to: before, no surface is worth judging.
    pub fn has_goal(&self) -> bool {
        self.goal_m.is_some()
    }

    /// Remembers where the vehicle got stuck.
    pub fn note_stuck(&mut self, stamp: &Stamp, stuck: &StuckRecord) {
        self.stuck = stamp.source();
        self.assessor.note_stuck(StuckPose { position_m: stuck.position_m, yaw_rad: stuck.yaw_rad });
    }

    /// Judges a surface; refuses one that holds cells that cannot be.
    ///
    /// # Errors
    /// The surface is of another resolution than the assessor was made for.
    pub fn update(
        &mut self,
        header: &SurfaceHeader,
        payload: &[[f32; 8]],
    ) -> Result<Result<(), Refusal>, NavigatorError> {
        let Some(next) = payload::surface_map(header, payload) else { return Ok(Err(Refusal::Malformed)) };
        self.follow_shift(header);
        let changed = self.mirror.as_ref().map_or_else(
            || CellRegion::whole(next.geometry()),
            |last| changed_region(last, &next).unwrap_or(CellRegion { rows: 0..0, cols: 0..0 }),
        );
        let [x_m, y_m, _] = header.odometry.position_m;
        self.assessor.update([x_m, y_m], &next, &changed)?;
        self.mirror = Some(next);
        self.surface = header.stamp.source();
        self.odometry_at_ns = header.frame_at_ns;
        Ok(Ok(()))
    }

    /// Number of elements of the message; `None` before the first surface or without a goal.
    pub fn n_elements(&self) -> Option<usize> {
        let known = self.assessor.known().filter(|_| self.goal_m.is_some())?;
        Some(RiskParts::new(&known.geometry, known.n_yaws).n_elements())
    }

    /// What is to be written into the message first, element by element.
    pub fn writer(&self) -> Option<impl Fn(usize) -> [f32; 4] + '_> {
        let known = self.assessor.known()?;
        let parts = RiskParts::new(&known.geometry, known.n_yaws);
        Some(move |place| parts.element(&known, place))
    }

    /// Completes, in place, a message that was written so, and gives its header, without stamp.
    pub fn finish(&mut self, payload: &mut [[f32; 4]]) -> Result<RiskHeader, NavigatorError> {
        let (Some(known), Some(goal_m)) = (self.assessor.known(), self.goal_m) else {
            return Ok(RiskHeader::default());
        };
        let (geometry, n_yaws) = (known.geometry, known.n_yaws);
        let parts = RiskParts::new(&geometry, n_yaws);
        self.assessor.amend(parts.risks_mut(payload));
        // The parts have the lengths of a map of this shape.
        let Ok(map) = RiskMapView::new(geometry, n_yaws, parts.risks(payload), parts.ground(payload)) else {
            return Ok(RiskHeader::default());
        };
        self.assessor.time_to_goal(map, goal_m)?;
        parts.seconds_mut(payload).copy_from_slice(self.assessor.last_time_to_goal().seconds);
        Ok(RiskHeader {
            stamp: Stamp::default(),
            grid: Grid::from(&geometry),
            n_yaws: n_yaws as u64,
            author: self.author,
            surface: self.surface,
            odometry_at_ns: self.odometry_at_ns,
            stuck: self.stuck,
            goal_m,
            alpha: self.assessor.level().get(),
            checkpoint: self.checkpoint,
            content_hash: payload::content_hash(payload),
        })
    }

    /// Stuck poses move along with what was mapped. A mapping that began anew has forgotten both.
    fn follow_shift(&mut self, header: &SurfaceHeader) {
        let (epoch_ns, last) = self.shift;
        let now = shift_of(header);
        if epoch_ns == header.stamp.epoch_ns && now != last {
            self.assessor.follow_jump(&last.inverse().then(&now));
        }
        self.shift = (header.stamp.epoch_ns, now);
    }
}

/// The bounding rectangle, in the window of `next`, of all cells that differ; what entered the window differs.
fn changed_region(last: &GridMap<SurfaceCell>, next: &GridMap<SurfaceCell>) -> Option<CellRegion> {
    let geometry = next.geometry();
    if (geometry.resolution_m, geometry.n_rows, geometry.n_cols)
        != (last.geometry().resolution_m, last.geometry().n_rows, last.geometry().n_cols)
    {
        return Some(CellRegion::whole(geometry));
    }
    let mut found: Option<CellRegion> = None;
    for (index, cell) in next.values().iter().enumerate() {
        let Cell { row, col } = geometry.cell(index);
        let lattice = [geometry.origin[0] + col as i64, geometry.origin[1] + row as i64];
        if last.at_lattice(lattice).is_some_and(|before| is_same(before, cell)) {
            continue;
        }
        found = Some(match found {
            None => CellRegion { rows: row..row + 1, cols: col..col + 1 },
            Some(region) => CellRegion {
                rows: region.rows.start.min(row)..region.rows.end.max(row + 1),
                cols: region.cols.start.min(col)..region.cols.end.max(col + 1),
            },
        });
    }
    found
}

/// To the last bit: an unknown height is no number, and equal to itself here.
fn is_same(one: &SurfaceCell, other: &SurfaceCell) -> bool {
    let bits = |cell: &SurfaceCell| payload::cell_numbers(cell).map(f32::to_bits);
    bits(one) == bits(other)
}

#[cfg(test)]
mod tests {
    use super::*;
    use terrain::{GridGeometry, TerrainClass};

    fn map(origin: [i64; 2]) -> GridMap<SurfaceCell> {
        let geometry = GridGeometry { resolution_m: 0.5, origin, n_rows: 4, n_cols: 5 };
        GridMap::filled(geometry, SurfaceCell::UNKNOWN)
    }

    #[test]
    fn only_what_differs_has_changed() {
        let last = map([0, 0]);
        assert_eq!(changed_region(&last, &last), None, "unknown heights are equal to themselves");
        let mut next = last.clone();
        for cell in [Cell { row: 1, col: 3 }, Cell { row: 2, col: 2 }] {
            next[cell] = SurfaceCell::certain(1.0, TerrainClass::Open, 0.0);
        }
        assert_eq!(changed_region(&last, &next), Some(CellRegion { rows: 1..3, cols: 2..4 }));
    }

    #[test]
    fn what_entered_the_window_has_changed() {
        let moved = map([1, 0]);
        assert_eq!(changed_region(&map([0, 0]), &moved), Some(CellRegion { rows: 0..4, cols: 4..5 }));
        let far = map([100, 0]);
        assert_eq!(changed_region(&map([0, 0]), &far), Some(CellRegion::whole(far.geometry())));
    }
}
