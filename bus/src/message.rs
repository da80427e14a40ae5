//! What the processes tell one another: records of plain numbers, the same in every process and language.

mod convert;
pub mod mission;

use iceoryx2::prelude::ZeroCopySend;

use crate::layout::{RecordLayout, record};
pub use convert::{HOLD_REASONS, STOP_REASONS, drive_row};

/// Version of everything in this file; messages of another are refused.
pub const LAYOUT_VERSION: u32 = 8;

/// Moving obstacles that are told of at the most.
pub const TRACKS_MAX: usize = 16;

record! {
    /// First field of every header: whose message it is, and of when.
    Stamp = "surefoot.Stamp" {
        /// Version of the layouts, LAYOUT_VERSION.
        layout_version: u32,
        /// Zero.
        reserved: u32,
        /// When its publisher took the channel, which tells one life of it from the next [ns].
        epoch_ns: u64,
        /// Counts the messages of one publisher on one channel from 1.
        sequence: u64,
        /// When what it says was true, monotonic [ns].
        valid_at_ns: u64,
        /// When it was sent, monotonic [ns].
        published_at_ns: u64,
    }
}

record! {
    /// A message that another one was made from.
    Source = "surefoot.Source" {
        /// When its publisher began [ns]; 0 = none.
        epoch_ns: u64,
        /// Its sequence number.
        sequence: u64,
    }
}

record! {
    /// Where the cells of a map lie: square, row-major from the south-west corner.
    Grid = "surefoot.Grid" {
        /// Edge of a cell [m].
        resolution_m: f64,
        /// Lattice column and row of the first cell; its south-west corner is origin x resolution_m.
        origin: [i64; 2],
        /// Rows, northwards.
        n_rows: u64,
        /// Columns, eastwards.
        n_cols: u64,
    }
}

record! {
    /// Where the vehicle is and how it moves, at stamp.valid_at_ns.
    OdometryRecord = "surefoot.Odometry" {
        /// Rear axle's centre in the map frame: east, north, up [m].
        position_m: [f64; 3],
        /// Roll, pitch, yaw [rad].
        attitude_rad: [f64; 3],
        /// Forward and leftward velocity in the body frame [m/s].
        velocity_mps: [f64; 2],
        /// Yaw rate [rad/s].
        yaw_rate_radps: f64,
        /// Mean circumferential speed of the driven wheels [m/s].
        wheel_speed_mps: f64,
        /// Measured angle of the front wheels, left positive [rad].
        steering_rad: f64,
        /// Forward speed that the actuators were told last before this was measured [m/s].
        applied_speed_mps: f32,
        /// Angle of the front wheels that they were told, left positive [rad].
        applied_steering_rad: f32,
        /// When they were first told so [ns].
        applied_since_ns: u64,
        /// Who decided it: 0 = the last command, 1 = the vehicle itself, be it its watchdog or an operator.
        applied_by: u64,
    }
}

record! {
    /// One sample of the inertial measurement unit, in the body frame.
    ImuRecord = "surefoot.Imu" {
        /// When it was measured, monotonic [ns].
        valid_at_ns: u64,
        /// Specific force [m/s2]; (0, 0, +9.81) at rest on level ground.
        acceleration_mps2: [f32; 3],
        /// Angular rate [rad/s].
        angular_rate_radps: [f32; 3],
    }
}

record! {
    /// Header of a sweep of the range sensor; the payload is one PointRecord per return.
    ScanHeader = "surefoot.ScanHeader" {
        /// Whose and of when.
        stamp: Stamp,
        /// Where the rays start, in the frame of the points [m].
        origin_m: [f32; 3],
        /// Whose frame the points are of: 0 = the vehicle's body, else the sensor of this number, from 1.
        sensor: u32,
    }
}

record! {
    /// One return of the range sensor.
    PointRecord = "surefoot.Point" {
        /// Place in the frame that the header names [m].
        position_m: [f32; 3],
        /// What it is: 0 open, 1 loose, 2 vegetation, 3 obstacle.
        class_number: u32,
    }
}

record! {
    /// Header of the map of the ground; the payload is eight numbers per cell, see docs/runtime.md.
    SurfaceHeader = "surefoot.SurfaceHeader" {
        /// Whose and of when: valid_at_ns is that of the scan.
        stamp: Stamp,
        /// Where the cells lie.
        grid: Grid,
        /// The scan that was fused last.
        scan: Source,
        /// Where the vehicle was when the scan was taken, or the odometry that showed the jump; nothing of what was applied.
        odometry: OdometryRecord,
        /// When that was [ns].
        odometry_at_ns: u64,
        /// When the odometry was measured in whose frame the map lies: the newest that mapping had taken in [ns].
        frame_at_ns: u64,
        /// The odometry that mapping took in last before this map, usable or not.
        last_odometry: Source,
        /// How many it took in since the map before.
        n_odometry: u64,
        /// XXH3 of these, each its stamp and its record, in the order in which they were taken in.
        odometry_hash: u64,
        /// What happened since the last message: 1 = a scan was fused, 2 = the localisation jumped.
        event: u64,
        /// The jump, if that is what happened: p of before lies at R(jump_yaw_rad) p + jump_m [m].
        jump_m: [f64; 3],
        /// Its turn, counter-clockwise [rad].
        jump_yaw_rad: f64,
        /// All jumps so far together, likewise [m].
        shift_m: [f64; 3],
        /// Their turn [rad].
        shift_yaw_rad: f64,
        /// XXH3 of the payload.
        content_hash: u64,
    }
}

record! {
    /// Header of what moves; the payload is one TrackRecord for each thing, the nearest first, at most TRACKS_MAX.
    TracksHeader = "surefoot.TracksHeader" {
        /// Whose and of when: valid_at_ns is that of the scan.
        stamp: Stamp,
        /// The scan that shows where they are.
        scan: Source,
        /// When the odometry was measured in whose frame they lie [ns].
        frame_at_ns: u64,
    }
}

record! {
    /// A thing that moves.
    TrackRecord = "surefoot.Track" {
        /// Counts the things that mapping has seen, from 1.
        number: u64,
        /// Centre in the map frame, east and north [m].
        position_m: [f64; 2],
        /// Velocity, east and north [m/s].
        velocity_mps: [f64; 2],
        /// Variance of the position along each axis [m2].
        position_m2: f64,
        /// Covariance of position and velocity along each axis [m2/s].
        cross_m2ps: f64,
        /// Variance of the velocity along each axis [m2/s2].
        velocity_m2ps2: f64,
        /// Radius of the thing [m].
        radius_m: f64,
    }
}

record! {
    /// Header of a risk map; the payload is risks, grounds and times to the goal, see docs/runtime.md.
    RiskHeader = "surefoot.RiskHeader" {
        /// Whose and of when: valid_at_ns is that of the scan.
        stamp: Stamp,
        /// Where the cells lie.
        grid: Grid,
        /// Yaw bins; bin k is centred at (k + 1/2) 2 pi / n_yaws.
        n_yaws: u64,
        /// Who judged the ground: 1 = what was learned, 2 = physics alone.
        map_source: u64,
        /// The map of the ground that was judged.
        surface: Source,
        /// When the odometry was measured in whose frame that map lies [ns].
        odometry_at_ns: u64,
        /// Stuck poses that it takes into account.
        stuck: Source,
        /// Where the time to the goal leads [m].
        goal_m: [f64; 2],
        /// Distance from there within which the straight line counts [m].
        tolerance_m: f64,
        /// Headings for which is told what turning adds to it: 16, or 0 for a vehicle that turns on the spot.
        n_headings: u64,
        /// Share of the worst outcomes that was judged for, in (0, 1].
        alpha: f64,
        /// First 8 bytes of the SHA-256 of the networks' weights; 0 = none.
        checkpoint: u64,
        /// XXH3 of the payload.
        content_hash: u64,
    }
}

record! {
    /// What the vehicle shall do. It grows old from when what it was decided on was measured, whenever it is sent.
    CommandRecord = "surefoot.Command" {
        /// Forward speed, negative in reverse [m/s].
        speed_mps: f32,
        /// Angle of the front wheels, left positive [rad].
        steering_rad: f32,
        /// 1 = drive, 2 = hold, 3 = stop; the command counts only when driving.
        decision: u32,
        /// Why, when it is not driving; see docs/runtime.md.
        reason: u32,
        /// When the odometry was measured that it was decided on [ns]; 0 = none.
        odometry_at_ns: u64,
        /// When the scan was measured that the map ends with that it was decided on [ns]; 0 = no map.
        scan_at_ns: u64,
    }
}

record! {
    /// A decision with all that it was made from.
    DecisionRecord = "surefoot.DecisionRecord" {
        /// What was decided.
        command: CommandRecord,
        /// Number of the decision since the process began.
        cycle: u64,
        /// When it was made [ns].
        decided_at_ns: u64,
        /// The odometry that was taken in last.
        odometry: Source,
        /// How many were taken in since the decision before, without a gap up to the last.
        n_odometry: u64,
        /// The risk map; none when there was none.
        risk: Source,
        /// Who made that map: 0 = none, 1 = what was learned, 2 = physics alone.
        map_source: u64,
        /// What was said last of where to go.
        mission: Source,
        /// The newest map of what was learned that there was to choose from.
        learned: Source,
        /// The newest map of physics alone that there was to choose from.
        physics: Source,
        /// What was known last of what moves; none where nothing is tracked.
        tracks: Source,
        /// Where to go [m].
        goal_m: [f64; 2],
        /// How near counts as there [m].
        tolerance_m: f64,
        /// Futures that were sampled.
        n_rollouts: u64,
        /// Time since the decision before [s].
        elapsed_s: f64,
        /// State that it was made for: x, y [m], yaw [rad], speed [m/s], steering [rad].
        state: [f64; 5],
        /// The message of the IMU that was taken in last; none where nobody corrects commands.
        imu: Source,
        /// How many were taken in since the decision before, without a gap up to the last.
        n_imu: u64,
        /// How the command was corrected: 0 = by nobody, else what became of it; see docs/runtime.md.
        correction: u32,
        /// Share that the correction had, 0 to 1.
        correction_share: f32,
        /// Curvature that it added [1/m].
        curvature_change_per_m: f32,
        /// Angle of the front wheels before it [rad].
        planned_steering_rad: f32,
        /// Time that the decision took [ns].
        duration_ns: u64,
        /// By how much the cycle began after its deadline [ns].
        lateness_ns: u64,
    }
}

record! {
    /// A place of the way that is meant to be driven.
    PlanRecord = "surefoot.Plan" {
        /// Rear axle's centre in the frame of the map that it was planned on, east and north [m].
        position_m: [f64; 2],
        /// Heading [rad].
        yaw_rad: f64,
        /// Speed there [m/s].
        speed_mps: f64,
    }
}

record! {
    /// A place of one of the futures that were tried.
    FutureRecord = "surefoot.Future" {
        /// Rear axle's centre in the frame of the map that it was tried on, east and north [m].
        position_m: [f64; 2],
        /// Cost of the whole future [s].
        cost_s: f64,
        /// Which future; the places of one follow one another.
        number: u64,
    }
}

record! {
    /// Where the vehicle got stuck.
    StuckRecord = "surefoot.Stuck" {
        /// Rear axle's centre [m].
        position_m: [f64; 2],
        /// Heading [rad].
        yaw_rad: f64,
    }
}

record! {
    /// What the vehicle is told to do: said again once a second, and at once when it changes. Unless repeated, it is lost.
    MissionRecord = "surefoot.Mission" {
        /// The place in the map frame that is headed for: a goal, or the end of the part of a path that is shown [m].
        goal_m: [f64; 2],
        /// How near counts as there; 0 = to be passed through, because others follow [m].
        tolerance_m: f64,
        /// Time since the mission began [s].
        time_s: f64,
        /// 0 = under way, else how it ended; see docs/runtime.md.
        outcome: u64,
        /// 0 = drive, 1 = there is no mission, 2 = paused, 3 = an operator has the wheel, 4 = emergency stop.
        state: u64,
        /// Missions so far, this one included.
        number: u64,
        /// The point of the route that is headed for, from 0.
        leg: u64,
        /// Points of the route.
        n_legs: u64,
        /// Share of the worst outcomes to plan for, in (0, 1]; 0 = as the run was started.
        alpha: f64,
        /// The order that was judged last.
        order: Source,
        /// What became of it: 0 = taken, else why it was refused; see docs/runtime.md.
        verdict: u64,
        /// Orders refused so far.
        n_refused: u64,
        /// Speed along the path [m/s]; 0 = there is no path, but a goal.
        path_speed_mps: f64,
        /// Corners of the part of the path that is shown.
        n_corners: u64,
        /// Where they lie, east [m].
        corner_x_m: [f64; 32],
        /// Where they lie, north [m].
        corner_y_m: [f64; 32],
    }
}

record! {
    /// Header of an order; the payload is the points of the route, east and north [m], two f64 each.
    OrderHeader = "surefoot.OrderHeader" {
        /// Whose and of when: valid_at_ns is when it was said.
        stamp: Stamp,
        /// 1 goals, 2 path, 3 pause, 4 resume, 5 cancel, 6 take over, 7 emergency stop, 8 reset, 9 share of outcomes.
        kind: u64,
        /// How near to a point counts as there [m]; 0 = as the run was started.
        tolerance_m: f64,
        /// Speed along a path [m/s].
        speed_mps: f64,
        /// Share of the worst outcomes to plan for, in (0, 1].
        alpha: f64,
    }
}

record! {
    /// Header of networks learned while driving; the payload is weights, then sidecar, as the bytes of their files.
    CheckpointHeader = "surefoot.CheckpointHeader" {
        /// Whose and of when.
        stamp: Stamp,
        /// First 8 bytes of the SHA-256 of the weights.
        checkpoint: u64,
        /// Bytes of the weights; the sidecar follows.
        n_weight_bytes: u64,
        /// Footprints learned from, and judged by.
        n_examples: [u64; 2],
        /// EMD2 on held-out footprints of the drive, of the networks before and of these.
        recent_emd2: [f64; 2],
        /// EMD2 on the original validation data, of the original networks and of these.
        original_emd2: [f64; 2],
    }
}

record! {
    /// How a process is doing, twice a second.
    StatusRecord = "surefoot.Status" {
        /// 1 plant, 2 mapping, 3 learning, 4 control, 5 recorder, 6 mission, 7 ros.
        role: u64,
        /// Process id.
        process: u64,
        /// Cycles or messages a second since the last status [Hz].
        rate_hz: f64,
        /// Median and largest lateness since the last status [s].
        lateness_s: [f64; 2],
        /// Age of up to four inputs when they were last used [s]; negative = none yet.
        age_s: [f64; 4],
        /// Deadlines missed since the process began.
        n_missed: u64,
        /// Messages lost on the way, by gaps in their numbers.
        n_lost: u64,
        /// Messages refused.
        n_refused: u64,
        /// Looks at a channel that the transport broke off.
        n_failed: u64,
        /// Figure of the role's own: speed [m/s], jumps made out, futures sampled, recorded bytes, messages of the robot.
        figure: f64,
    }
}

/// All records, each after those that it is made of.
pub fn layouts() -> Vec<RecordLayout> {
    vec![
        Stamp::layout(),
        Source::layout(),
        Grid::layout(),
        OdometryRecord::layout(),
        ImuRecord::layout(),
        ScanHeader::layout(),
        PointRecord::layout(),
        SurfaceHeader::layout(),
        TracksHeader::layout(),
        TrackRecord::layout(),
        RiskHeader::layout(),
        CommandRecord::layout(),
        DecisionRecord::layout(),
        PlanRecord::layout(),
        FutureRecord::layout(),
        StuckRecord::layout(),
        MissionRecord::layout(),
        OrderHeader::layout(),
        CheckpointHeader::layout(),
        StatusRecord::layout(),
    ]
}
