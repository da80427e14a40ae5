//! The topics of a drive under Foxglove's schemas, wherever they go: into a file, or to whoever looks on.

use std::sync::Arc;

use bicycle::DriveRow;
use foxglove::messages::{FrameTransform, Grid, PointCloud, PoseInFrame, PosesInFrame, SceneUpdate};
use foxglove::{Channel, Context, Encode};
use serde::Serialize;
use terrain::{GridMap, Pose, Scan, SurfaceCell};
use traversability::RiskMapView;

use super::drive_row::{self, DriveLogRow};
use super::json::JsonChannels;
use super::recorded::ELEVATION;
use super::{RecordError, grids, scene};

/// The topics of a drive. What is told goes to every sink of their context. Times are the caller's, monotonic [ns].
pub struct DriveTopics {
    channels: Channels,
    json: JsonChannels,
}

impl DriveTopics {
    /// Opens the topics.
    pub fn new(context: &Arc<Context>) -> Self {
        Self { channels: Channels::new(context), json: JsonChannels::new(Arc::clone(context)) }
    }

    /// Where the vehicle is.
    pub fn pose(&self, at_ns: u64, pose: &Pose) {
        self.channels.transform.log_with_time(&scene::transform(at_ns, pose), at_ns);
        self.channels.pose.log_with_time(&scene::pose_in_frame(at_ns, pose), at_ns);
    }

    /// Where the vehicle should go.
    pub fn goal(&self, at_ns: u64, pose: &Pose) {
        self.channels.goal.log_with_time(&scene::pose_in_frame(at_ns, pose), at_ns);
    }

    /// Where the vehicle has been, or is to go.
    pub fn path(&self, at_ns: u64, poses: &[Pose]) {
        self.channels.path.log_with_time(&scene::poses_in_frame(at_ns, poses), at_ns);
    }

    /// Rolled-out futures as points of the map frame [m], best first.
    pub fn rollouts(&self, at_ns: u64, best_first: &[Vec<[f64; 3]>]) {
        self.channels.rollouts.log_with_time(&scene::rollouts(at_ns, best_first), at_ns);
    }

    /// What the vehicle knows of the ground.
    pub fn elevation(&self, at_ns: u64, map: &GridMap<SurfaceCell>) {
        self.channels.elevation.log_with_time(&grids::elevation(at_ns, map), at_ns);
    }

    /// The risk map at the yaw bin that holds `yaw_rad`, usually the vehicle's.
    pub fn risk(&self, at_ns: u64, map: &RiskMapView<'_>, yaw_rad: f64) {
        self.channels.risk.log_with_time(&grids::risk(at_ns, map, yaw_rad), at_ns);
    }

    /// A sweep of the range sensor, in the body frame.
    pub fn scan(&self, at_ns: u64, scan: &Scan) {
        self.channels.scan.log_with_time(&scene::point_cloud(at_ns, scan), at_ns);
    }

    /// One row of the drive log.
    pub fn drive_row(&self, at_ns: u64, run: &str, row: &DriveRow) {
        self.channels.drive_log.log_with_time(&DriveLogRow::new(run, row), at_ns);
    }

    /// Anything that JSON can hold, under a topic that is opened with its first message.
    ///
    /// # Errors
    /// [`RecordError::NoJson`].
    pub fn json(
        &mut self,
        topic: &'static str,
        at_ns: u64,
        value: &impl Serialize,
    ) -> Result<(), RecordError> {
        let logged = self.json.log(topic, at_ns, value);
        logged.map_err(|problem| RecordError::NoJson { topic, problem })
    }
}

/// Topics under Foxglove's schemas.
struct Channels {
    transform: Channel<FrameTransform>,
    pose: Channel<PoseInFrame>,
    goal: Channel<PoseInFrame>,
    path: Channel<PosesInFrame>,
    rollouts: Channel<SceneUpdate>,
    elevation: Channel<Grid>,
    risk: Channel<Grid>,
    scan: Channel<PointCloud>,
    drive_log: Channel<DriveLogRow>,
}

impl Channels {
    fn new(context: &Arc<Context>) -> Self {
        fn channel<T: Encode>(context: &Arc<Context>, topic: &str) -> Channel<T> {
            context.channel_builder(topic).build()
        }
        Self {
            transform: channel(context, "/tf"),
            pose: channel(context, "/pose"),
            goal: channel(context, "/goal"),
            path: channel(context, "/path"),
            rollouts: channel(context, "/rollouts"),
            elevation: channel(context, ELEVATION),
            risk: channel(context, "/risk"),
            scan: channel(context, "/scan"),
            drive_log: channel(context, drive_row::TOPIC),
        }
    }
}
