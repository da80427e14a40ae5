/* Messages of Surefoot, layout version 8. Written from its types; do not edit. */
#ifndef SUREFOOT_LAYOUT_H
#define SUREFOOT_LAYOUT_H

#include <assert.h>
#include <stddef.h>
#include <stdint.h>

#define SUREFOOT_LAYOUT_VERSION 8u

/* First field of every header: whose message it is, and of when. Known to the channels as surefoot.Stamp. */
typedef struct SurefootStamp {
    /* Version of the layouts, LAYOUT_VERSION. */
    uint32_t layout_version;
    /* Zero. */
    uint32_t reserved;
    /* When its publisher took the channel, which tells one life of it from the next [ns]. */
    uint64_t epoch_ns;
    /* Counts the messages of one publisher on one channel from 1. */
    uint64_t sequence;
    /* When what it says was true, monotonic [ns]. */
    uint64_t valid_at_ns;
    /* When it was sent, monotonic [ns]. */
    uint64_t published_at_ns;
} SurefootStamp;
static_assert(sizeof(SurefootStamp) == 40, "Stamp");
static_assert(offsetof(SurefootStamp, layout_version) == 0, "Stamp.layout_version");
static_assert(offsetof(SurefootStamp, reserved) == 4, "Stamp.reserved");
static_assert(offsetof(SurefootStamp, epoch_ns) == 8, "Stamp.epoch_ns");
static_assert(offsetof(SurefootStamp, sequence) == 16, "Stamp.sequence");
static_assert(offsetof(SurefootStamp, valid_at_ns) == 24, "Stamp.valid_at_ns");
static_assert(offsetof(SurefootStamp, published_at_ns) == 32, "Stamp.published_at_ns");

/* A message that another one was made from. Known to the channels as surefoot.Source. */
typedef struct SurefootSource {
    /* When its publisher began [ns]; 0 = none. */
    uint64_t epoch_ns;
    /* Its sequence number. */
    uint64_t sequence;
} SurefootSource;
static_assert(sizeof(SurefootSource) == 16, "Source");
static_assert(offsetof(SurefootSource, epoch_ns) == 0, "Source.epoch_ns");
static_assert(offsetof(SurefootSource, sequence) == 8, "Source.sequence");

/* Where the cells of a map lie: square, row-major from the south-west corner. Known to the channels as surefoot.Grid. */
typedef struct SurefootGrid {
    /* Edge of a cell [m]. */
    double resolution_m;
    /* Lattice column and row of the first cell; its south-west corner is origin x resolution_m. */
    int64_t origin[2];
    /* Rows, northwards. */
    uint64_t n_rows;
    /* Columns, eastwards. */
    uint64_t n_cols;
} SurefootGrid;
static_assert(sizeof(SurefootGrid) == 40, "Grid");
static_assert(offsetof(SurefootGrid, resolution_m) == 0, "Grid.resolution_m");
static_assert(offsetof(SurefootGrid, origin) == 8, "Grid.origin");
static_assert(offsetof(SurefootGrid, n_rows) == 24, "Grid.n_rows");
static_assert(offsetof(SurefootGrid, n_cols) == 32, "Grid.n_cols");

/* Where the vehicle is and how it moves, at stamp.valid_at_ns. Known to the channels as surefoot.Odometry. */
typedef struct SurefootOdometryRecord {
    /* Rear axle's centre in the map frame: east, north, up [m]. */
    double position_m[3];
    /* Roll, pitch, yaw [rad]. */
    double attitude_rad[3];
    /* Forward and leftward velocity in the body frame [m/s]. */
    double velocity_mps[2];
    /* Yaw rate [rad/s]. */
    double yaw_rate_radps;
    /* Mean circumferential speed of the driven wheels [m/s]. */
    double wheel_speed_mps;
    /* Measured angle of the front wheels, left positive [rad]. */
    double steering_rad;
    /* Forward speed that the actuators were told last before this was measured [m/s]. */
    float applied_speed_mps;
    /* Angle of the front wheels that they were told, left positive [rad]. */
    float applied_steering_rad;
    /* When they were first told so [ns]. */
    uint64_t applied_since_ns;
    /* Who decided it: 0 = the last command, 1 = the vehicle itself, be it its watchdog or an operator. */
    uint64_t applied_by;
} SurefootOdometryRecord;
static_assert(sizeof(SurefootOdometryRecord) == 112, "OdometryRecord");
static_assert(offsetof(SurefootOdometryRecord, position_m) == 0, "OdometryRecord.position_m");
static_assert(offsetof(SurefootOdometryRecord, attitude_rad) == 24, "OdometryRecord.attitude_rad");
static_assert(offsetof(SurefootOdometryRecord, velocity_mps) == 48, "OdometryRecord.velocity_mps");
static_assert(offsetof(SurefootOdometryRecord, yaw_rate_radps) == 64, "OdometryRecord.yaw_rate_radps");
static_assert(offsetof(SurefootOdometryRecord, wheel_speed_mps) == 72, "OdometryRecord.wheel_speed_mps");
static_assert(offsetof(SurefootOdometryRecord, steering_rad) == 80, "OdometryRecord.steering_rad");
static_assert(offsetof(SurefootOdometryRecord, applied_speed_mps) == 88, "OdometryRecord.applied_speed_mps");
static_assert(offsetof(SurefootOdometryRecord, applied_steering_rad) == 92, "OdometryRecord.applied_steering_rad");
static_assert(offsetof(SurefootOdometryRecord, applied_since_ns) == 96, "OdometryRecord.applied_since_ns");
static_assert(offsetof(SurefootOdometryRecord, applied_by) == 104, "OdometryRecord.applied_by");

/* One sample of the inertial measurement unit, in the body frame. Known to the channels as surefoot.Imu. */
typedef struct SurefootImuRecord {
    /* When it was measured, monotonic [ns]. */
    uint64_t valid_at_ns;
    /* Specific force [m/s2]; (0, 0, +9.81) at rest on level ground. */
    float acceleration_mps2[3];
    /* Angular rate [rad/s]. */
    float angular_rate_radps[3];
} SurefootImuRecord;
static_assert(sizeof(SurefootImuRecord) == 32, "ImuRecord");
static_assert(offsetof(SurefootImuRecord, valid_at_ns) == 0, "ImuRecord.valid_at_ns");
static_assert(offsetof(SurefootImuRecord, acceleration_mps2) == 8, "ImuRecord.acceleration_mps2");
static_assert(offsetof(SurefootImuRecord, angular_rate_radps) == 20, "ImuRecord.angular_rate_radps");

/* Header of a sweep of the range sensor; the payload is one PointRecord per return. Known to the channels as surefoot.ScanHeader. */
typedef struct SurefootScanHeader {
    /* Whose and of when. */
    SurefootStamp stamp;
    /* Where the rays start, in the frame of the points [m]. */
    float origin_m[3];
    /* Whose frame the points are of: 0 = the vehicle's body, else the sensor of this number, from 1. */
    uint32_t sensor;
} SurefootScanHeader;
static_assert(sizeof(SurefootScanHeader) == 56, "ScanHeader");
static_assert(offsetof(SurefootScanHeader, stamp) == 0, "ScanHeader.stamp");
static_assert(offsetof(SurefootScanHeader, origin_m) == 40, "ScanHeader.origin_m");
static_assert(offsetof(SurefootScanHeader, sensor) == 52, "ScanHeader.sensor");

/* One return of the range sensor. Known to the channels as surefoot.Point. */
typedef struct SurefootPointRecord {
    /* Place in the frame that the header names [m]. */
    float position_m[3];
    /* What it is: 0 open, 1 loose, 2 vegetation, 3 obstacle. */
    uint32_t class_number;
} SurefootPointRecord;
static_assert(sizeof(SurefootPointRecord) == 16, "PointRecord");
static_assert(offsetof(SurefootPointRecord, position_m) == 0, "PointRecord.position_m");
static_assert(offsetof(SurefootPointRecord, class_number) == 12, "PointRecord.class_number");

/* Header of the map of the ground; the payload is eight numbers per cell, see docs/runtime.md. Known to the channels as surefoot.SurfaceHeader. */
typedef struct SurefootSurfaceHeader {
    /* Whose and of when: valid_at_ns is that of the scan. */
    SurefootStamp stamp;
    /* Where the cells lie. */
    SurefootGrid grid;
    /* The scan that was fused last. */
    SurefootSource scan;
    /* Where the vehicle was when the scan was taken, or the odometry that showed the jump; nothing of what was applied. */
    SurefootOdometryRecord odometry;
    /* When that was [ns]. */
    uint64_t odometry_at_ns;
    /* When the odometry was measured in whose frame the map lies: the newest that mapping had taken in [ns]. */
    uint64_t frame_at_ns;
    /* The odometry that mapping took in last before this map, usable or not. */
    SurefootSource last_odometry;
    /* How many it took in since the map before. */
    uint64_t n_odometry;
    /* XXH3 of these, each its stamp and its record, in the order in which they were taken in. */
    uint64_t odometry_hash;
    /* What happened since the last message: 1 = a scan was fused, 2 = the localisation jumped. */
    uint64_t event;
    /* The jump, if that is what happened: p of before lies at R(jump_yaw_rad) p + jump_m [m]. */
    double jump_m[3];
    /* Its turn, counter-clockwise [rad]. */
    double jump_yaw_rad;
    /* All jumps so far together, likewise [m]. */
    double shift_m[3];
    /* Their turn [rad]. */
    double shift_yaw_rad;
    /* XXH3 of the payload. */
    uint64_t content_hash;
} SurefootSurfaceHeader;
static_assert(sizeof(SurefootSurfaceHeader) == 336, "SurfaceHeader");
static_assert(offsetof(SurefootSurfaceHeader, stamp) == 0, "SurfaceHeader.stamp");
static_assert(offsetof(SurefootSurfaceHeader, grid) == 40, "SurfaceHeader.grid");
static_assert(offsetof(SurefootSurfaceHeader, scan) == 80, "SurfaceHeader.scan");
static_assert(offsetof(SurefootSurfaceHeader, odometry) == 96, "SurfaceHeader.odometry");
static_assert(offsetof(SurefootSurfaceHeader, odometry_at_ns) == 208, "SurfaceHeader.odometry_at_ns");
static_assert(offsetof(SurefootSurfaceHeader, frame_at_ns) == 216, "SurfaceHeader.frame_at_ns");
static_assert(offsetof(SurefootSurfaceHeader, last_odometry) == 224, "SurfaceHeader.last_odometry");
static_assert(offsetof(SurefootSurfaceHeader, n_odometry) == 240, "SurfaceHeader.n_odometry");
static_assert(offsetof(SurefootSurfaceHeader, odometry_hash) == 248, "SurfaceHeader.odometry_hash");
static_assert(offsetof(SurefootSurfaceHeader, event) == 256, "SurfaceHeader.event");
static_assert(offsetof(SurefootSurfaceHeader, jump_m) == 264, "SurfaceHeader.jump_m");
static_assert(offsetof(SurefootSurfaceHeader, jump_yaw_rad) == 288, "SurfaceHeader.jump_yaw_rad");
static_assert(offsetof(SurefootSurfaceHeader, shift_m) == 296, "SurfaceHeader.shift_m");
static_assert(offsetof(SurefootSurfaceHeader, shift_yaw_rad) == 320, "SurfaceHeader.shift_yaw_rad");
static_assert(offsetof(SurefootSurfaceHeader, content_hash) == 328, "SurfaceHeader.content_hash");

/* Header of what moves; the payload is one TrackRecord for each thing, the nearest first, at most TRACKS_MAX. Known to the channels as surefoot.TracksHeader. */
typedef struct SurefootTracksHeader {
    /* Whose and of when: valid_at_ns is that of the scan. */
    SurefootStamp stamp;
    /* The scan that shows where they are. */
    SurefootSource scan;
    /* When the odometry was measured in whose frame they lie [ns]. */
    uint64_t frame_at_ns;
} SurefootTracksHeader;
static_assert(sizeof(SurefootTracksHeader) == 64, "TracksHeader");
static_assert(offsetof(SurefootTracksHeader, stamp) == 0, "TracksHeader.stamp");
static_assert(offsetof(SurefootTracksHeader, scan) == 40, "TracksHeader.scan");
static_assert(offsetof(SurefootTracksHeader, frame_at_ns) == 56, "TracksHeader.frame_at_ns");

/* A thing that moves. Known to the channels as surefoot.Track. */
typedef struct SurefootTrackRecord {
    /* Counts the things that mapping has seen, from 1. */
    uint64_t number;
    /* Centre in the map frame, east and north [m]. */
    double position_m[2];
    /* Velocity, east and north [m/s]. */
    double velocity_mps[2];
    /* Variance of the position along each axis [m2]. */
    double position_m2;
    /* Covariance of position and velocity along each axis [m2/s]. */
    double cross_m2ps;
    /* Variance of the velocity along each axis [m2/s2]. */
    double velocity_m2ps2;
    /* Radius of the thing [m]. */
    double radius_m;
} SurefootTrackRecord;
static_assert(sizeof(SurefootTrackRecord) == 72, "TrackRecord");
static_assert(offsetof(SurefootTrackRecord, number) == 0, "TrackRecord.number");
static_assert(offsetof(SurefootTrackRecord, position_m) == 8, "TrackRecord.position_m");
static_assert(offsetof(SurefootTrackRecord, velocity_mps) == 24, "TrackRecord.velocity_mps");
static_assert(offsetof(SurefootTrackRecord, position_m2) == 40, "TrackRecord.position_m2");
static_assert(offsetof(SurefootTrackRecord, cross_m2ps) == 48, "TrackRecord.cross_m2ps");
static_assert(offsetof(SurefootTrackRecord, velocity_m2ps2) == 56, "TrackRecord.velocity_m2ps2");
static_assert(offsetof(SurefootTrackRecord, radius_m) == 64, "TrackRecord.radius_m");

/* Header of a risk map; the payload is risks, grounds and times to the goal, see docs/runtime.md. Known to the channels as surefoot.RiskHeader. */
typedef struct SurefootRiskHeader {
    /* Whose and of when: valid_at_ns is that of the scan. */
    SurefootStamp stamp;
    /* Where the cells lie. */
    SurefootGrid grid;
    /* Yaw bins; bin k is centred at (k + 1/2) 2 pi / n_yaws. */
    uint64_t n_yaws;
    /* Who judged the ground: 1 = what was learned, 2 = physics alone. */
    uint64_t map_source;
    /* The map of the ground that was judged. */
    SurefootSource surface;
    /* When the odometry was measured in whose frame that map lies [ns]. */
    uint64_t odometry_at_ns;
    /* Stuck poses that it takes into account. */
    SurefootSource stuck;
    /* Where the time to the goal leads [m]. */
    double goal_m[2];
    /* Distance from there within which the straight line counts [m]. */
    double tolerance_m;
    /* Headings for which is told what turning adds to it: 16, or 0 for a vehicle that turns on the spot. */
    uint64_t n_headings;
    /* Share of the worst outcomes that was judged for, in (0, 1]. */
    double alpha;
    /* First 8 bytes of the SHA-256 of the networks' weights; 0 = none. */
    uint64_t checkpoint;
    /* XXH3 of the payload. */
    uint64_t content_hash;
} SurefootRiskHeader;
static_assert(sizeof(SurefootRiskHeader) == 192, "RiskHeader");
static_assert(offsetof(SurefootRiskHeader, stamp) == 0, "RiskHeader.stamp");
static_assert(offsetof(SurefootRiskHeader, grid) == 40, "RiskHeader.grid");
static_assert(offsetof(SurefootRiskHeader, n_yaws) == 80, "RiskHeader.n_yaws");
static_assert(offsetof(SurefootRiskHeader, map_source) == 88, "RiskHeader.map_source");
static_assert(offsetof(SurefootRiskHeader, surface) == 96, "RiskHeader.surface");
static_assert(offsetof(SurefootRiskHeader, odometry_at_ns) == 112, "RiskHeader.odometry_at_ns");
static_assert(offsetof(SurefootRiskHeader, stuck) == 120, "RiskHeader.stuck");
static_assert(offsetof(SurefootRiskHeader, goal_m) == 136, "RiskHeader.goal_m");
static_assert(offsetof(SurefootRiskHeader, tolerance_m) == 152, "RiskHeader.tolerance_m");
static_assert(offsetof(SurefootRiskHeader, n_headings) == 160, "RiskHeader.n_headings");
static_assert(offsetof(SurefootRiskHeader, alpha) == 168, "RiskHeader.alpha");
static_assert(offsetof(SurefootRiskHeader, checkpoint) == 176, "RiskHeader.checkpoint");
static_assert(offsetof(SurefootRiskHeader, content_hash) == 184, "RiskHeader.content_hash");

/* What the vehicle shall do. It grows old from when what it was decided on was measured, whenever it is sent. Known to the channels as surefoot.Command. */
typedef struct SurefootCommandRecord {
    /* Forward speed, negative in reverse [m/s]. */
    float speed_mps;
    /* Angle of the front wheels, left positive [rad]. */
    float steering_rad;
    /* 1 = drive, 2 = hold, 3 = stop; the command counts only when driving. */
    uint32_t decision;
    /* Why, when it is not driving; see docs/runtime.md. */
    uint32_t reason;
    /* When the odometry was measured that it was decided on [ns]; 0 = none. */
    uint64_t odometry_at_ns;
    /* When the scan was measured that the map ends with that it was decided on [ns]; 0 = no map. */
    uint64_t scan_at_ns;
} SurefootCommandRecord;
static_assert(sizeof(SurefootCommandRecord) == 32, "CommandRecord");
static_assert(offsetof(SurefootCommandRecord, speed_mps) == 0, "CommandRecord.speed_mps");
static_assert(offsetof(SurefootCommandRecord, steering_rad) == 4, "CommandRecord.steering_rad");
static_assert(offsetof(SurefootCommandRecord, decision) == 8, "CommandRecord.decision");
static_assert(offsetof(SurefootCommandRecord, reason) == 12, "CommandRecord.reason");
static_assert(offsetof(SurefootCommandRecord, odometry_at_ns) == 16, "CommandRecord.odometry_at_ns");
static_assert(offsetof(SurefootCommandRecord, scan_at_ns) == 24, "CommandRecord.scan_at_ns");

/* A decision with all that it was made from. Known to the channels as surefoot.DecisionRecord. */
typedef struct SurefootDecisionRecord {
    /* What was decided. */
    SurefootCommandRecord command;
    /* Number of the decision since the process began. */
    uint64_t cycle;
    /* When it was made [ns]. */
    uint64_t decided_at_ns;
    /* The odometry that was taken in last. */
    SurefootSource odometry;
    /* How many were taken in since the decision before, without a gap up to the last. */
    uint64_t n_odometry;
    /* The risk map; none when there was none. */
    SurefootSource risk;
    /* Who made that map: 0 = none, 1 = what was learned, 2 = physics alone. */
    uint64_t map_source;
    /* What was said last of where to go. */
    SurefootSource mission;
    /* The newest map of what was learned that there was to choose from. */
    SurefootSource learned;
    /* The newest map of physics alone that there was to choose from. */
    SurefootSource physics;
    /* What was known last of what moves; none where nothing is tracked. */
    SurefootSource tracks;
    /* Where to go [m]. */
    double goal_m[2];
    /* How near counts as there [m]. */
    double tolerance_m;
    /* Futures that were sampled. */
    uint64_t n_rollouts;
    /* Time since the decision before [s]. */
    double elapsed_s;
    /* State that it was made for: x, y [m], yaw [rad], speed [m/s], steering [rad]. */
    double state[5];
    /* The message of the IMU that was taken in last; none where nobody corrects commands. */
    SurefootSource imu;
    /* How many were taken in since the decision before, without a gap up to the last. */
    uint64_t n_imu;
    /* How the command was corrected: 0 = by nobody, else what became of it; see docs/runtime.md. */
    uint32_t correction;
    /* Share that the correction had, 0 to 1. */
    float correction_share;
    /* Curvature that it added [1/m]. */
    float curvature_change_per_m;
    /* Angle of the front wheels before it [rad]. */
    float planned_steering_rad;
    /* Time that the decision took [ns]. */
    uint64_t duration_ns;
    /* By how much the cycle began after its deadline [ns]. */
    uint64_t lateness_ns;
} SurefootDecisionRecord;
static_assert(sizeof(SurefootDecisionRecord) == 296, "DecisionRecord");
static_assert(offsetof(SurefootDecisionRecord, command) == 0, "DecisionRecord.command");
static_assert(offsetof(SurefootDecisionRecord, cycle) == 32, "DecisionRecord.cycle");
static_assert(offsetof(SurefootDecisionRecord, decided_at_ns) == 40, "DecisionRecord.decided_at_ns");
static_assert(offsetof(SurefootDecisionRecord, odometry) == 48, "DecisionRecord.odometry");
static_assert(offsetof(SurefootDecisionRecord, n_odometry) == 64, "DecisionRecord.n_odometry");
static_assert(offsetof(SurefootDecisionRecord, risk) == 72, "DecisionRecord.risk");
static_assert(offsetof(SurefootDecisionRecord, map_source) == 88, "DecisionRecord.map_source");
static_assert(offsetof(SurefootDecisionRecord, mission) == 96, "DecisionRecord.mission");
static_assert(offsetof(SurefootDecisionRecord, learned) == 112, "DecisionRecord.learned");
static_assert(offsetof(SurefootDecisionRecord, physics) == 128, "DecisionRecord.physics");
static_assert(offsetof(SurefootDecisionRecord, tracks) == 144, "DecisionRecord.tracks");
static_assert(offsetof(SurefootDecisionRecord, goal_m) == 160, "DecisionRecord.goal_m");
static_assert(offsetof(SurefootDecisionRecord, tolerance_m) == 176, "DecisionRecord.tolerance_m");
static_assert(offsetof(SurefootDecisionRecord, n_rollouts) == 184, "DecisionRecord.n_rollouts");
static_assert(offsetof(SurefootDecisionRecord, elapsed_s) == 192, "DecisionRecord.elapsed_s");
static_assert(offsetof(SurefootDecisionRecord, state) == 200, "DecisionRecord.state");
static_assert(offsetof(SurefootDecisionRecord, imu) == 240, "DecisionRecord.imu");
static_assert(offsetof(SurefootDecisionRecord, n_imu) == 256, "DecisionRecord.n_imu");
static_assert(offsetof(SurefootDecisionRecord, correction) == 264, "DecisionRecord.correction");
static_assert(offsetof(SurefootDecisionRecord, correction_share) == 268, "DecisionRecord.correction_share");
static_assert(offsetof(SurefootDecisionRecord, curvature_change_per_m) == 272, "DecisionRecord.curvature_change_per_m");
static_assert(offsetof(SurefootDecisionRecord, planned_steering_rad) == 276, "DecisionRecord.planned_steering_rad");
static_assert(offsetof(SurefootDecisionRecord, duration_ns) == 280, "DecisionRecord.duration_ns");
static_assert(offsetof(SurefootDecisionRecord, lateness_ns) == 288, "DecisionRecord.lateness_ns");

/* A place of the way that is meant to be driven. Known to the channels as surefoot.Plan. */
typedef struct SurefootPlanRecord {
    /* Rear axle's centre in the frame of the map that it was planned on, east and north [m]. */
    double position_m[2];
    /* Heading [rad]. */
    double yaw_rad;
    /* Speed there [m/s]. */
    double speed_mps;
} SurefootPlanRecord;
static_assert(sizeof(SurefootPlanRecord) == 32, "PlanRecord");
static_assert(offsetof(SurefootPlanRecord, position_m) == 0, "PlanRecord.position_m");
static_assert(offsetof(SurefootPlanRecord, yaw_rad) == 16, "PlanRecord.yaw_rad");
static_assert(offsetof(SurefootPlanRecord, speed_mps) == 24, "PlanRecord.speed_mps");

/* A place of one of the futures that were tried. Known to the channels as surefoot.Future. */
typedef struct SurefootFutureRecord {
    /* Rear axle's centre in the frame of the map that it was tried on, east and north [m]. */
    double position_m[2];
    /* Cost of the whole future [s]. */
    double cost_s;
    /* Which future; the places of one follow one another. */
    uint64_t number;
} SurefootFutureRecord;
static_assert(sizeof(SurefootFutureRecord) == 32, "FutureRecord");
static_assert(offsetof(SurefootFutureRecord, position_m) == 0, "FutureRecord.position_m");
static_assert(offsetof(SurefootFutureRecord, cost_s) == 16, "FutureRecord.cost_s");
static_assert(offsetof(SurefootFutureRecord, number) == 24, "FutureRecord.number");

/* Where the vehicle got stuck. Known to the channels as surefoot.Stuck. */
typedef struct SurefootStuckRecord {
    /* Rear axle's centre [m]. */
    double position_m[2];
    /* Heading [rad]. */
    double yaw_rad;
} SurefootStuckRecord;
static_assert(sizeof(SurefootStuckRecord) == 24, "StuckRecord");
static_assert(offsetof(SurefootStuckRecord, position_m) == 0, "StuckRecord.position_m");
static_assert(offsetof(SurefootStuckRecord, yaw_rad) == 16, "StuckRecord.yaw_rad");

/* What the vehicle is told to do: said again once a second, and at once when it changes. Unless repeated, it is lost. Known to the channels as surefoot.Mission. */
typedef struct SurefootMissionRecord {
    /* The place in the map frame that is headed for: a goal, or the end of the part of a path that is shown [m]. */
    double goal_m[2];
    /* How near counts as there; 0 = to be passed through, because others follow [m]. */
    double tolerance_m;
    /* Time since the mission began [s]. */
    double time_s;
    /* 0 = under way, else how it ended; see docs/runtime.md. */
    uint64_t outcome;
    /* 0 = drive, 1 = there is no mission, 2 = paused, 3 = an operator has the wheel, 4 = emergency stop. */
    uint64_t state;
    /* Missions so far, this one included. */
    uint64_t number;
    /* The point of the route that is headed for, from 0. */
    uint64_t leg;
    /* Points of the route. */
    uint64_t n_legs;
    /* Share of the worst outcomes to plan for, in (0, 1]; 0 = as the run was started. */
    double alpha;
    /* The order that was judged last. */
    SurefootSource order;
    /* What became of it: 0 = taken, else why it was refused; see docs/runtime.md. */
    uint64_t verdict;
    /* Orders refused so far. */
    uint64_t n_refused;
    /* Speed along the path [m/s]; 0 = there is no path, but a goal. */
    double path_speed_mps;
    /* Corners of the part of the path that is shown. */
    uint64_t n_corners;
    /* Where they lie, east [m]. */
    double corner_x_m[32];
    /* Where they lie, north [m]. */
    double corner_y_m[32];
} SurefootMissionRecord;
static_assert(sizeof(SurefootMissionRecord) == 640, "MissionRecord");
static_assert(offsetof(SurefootMissionRecord, goal_m) == 0, "MissionRecord.goal_m");
static_assert(offsetof(SurefootMissionRecord, tolerance_m) == 16, "MissionRecord.tolerance_m");
static_assert(offsetof(SurefootMissionRecord, time_s) == 24, "MissionRecord.time_s");
static_assert(offsetof(SurefootMissionRecord, outcome) == 32, "MissionRecord.outcome");
static_assert(offsetof(SurefootMissionRecord, state) == 40, "MissionRecord.state");
static_assert(offsetof(SurefootMissionRecord, number) == 48, "MissionRecord.number");
static_assert(offsetof(SurefootMissionRecord, leg) == 56, "MissionRecord.leg");
static_assert(offsetof(SurefootMissionRecord, n_legs) == 64, "MissionRecord.n_legs");
static_assert(offsetof(SurefootMissionRecord, alpha) == 72, "MissionRecord.alpha");
static_assert(offsetof(SurefootMissionRecord, order) == 80, "MissionRecord.order");
static_assert(offsetof(SurefootMissionRecord, verdict) == 96, "MissionRecord.verdict");
static_assert(offsetof(SurefootMissionRecord, n_refused) == 104, "MissionRecord.n_refused");
static_assert(offsetof(SurefootMissionRecord, path_speed_mps) == 112, "MissionRecord.path_speed_mps");
static_assert(offsetof(SurefootMissionRecord, n_corners) == 120, "MissionRecord.n_corners");
static_assert(offsetof(SurefootMissionRecord, corner_x_m) == 128, "MissionRecord.corner_x_m");
static_assert(offsetof(SurefootMissionRecord, corner_y_m) == 384, "MissionRecord.corner_y_m");

/* Header of an order; the payload is the points of the route, east and north [m], two f64 each. Known to the channels as surefoot.OrderHeader. */
typedef struct SurefootOrderHeader {
    /* Whose and of when: valid_at_ns is when it was said. */
    SurefootStamp stamp;
    /* 1 goals, 2 path, 3 pause, 4 resume, 5 cancel, 6 take over, 7 emergency stop, 8 reset, 9 share of outcomes. */
    uint64_t kind;
    /* How near to a point counts as there [m]; 0 = as the run was started. */
    double tolerance_m;
    /* Speed along a path [m/s]. */
    double speed_mps;
    /* Share of the worst outcomes to plan for, in (0, 1]. */
    double alpha;
} SurefootOrderHeader;
static_assert(sizeof(SurefootOrderHeader) == 72, "OrderHeader");
static_assert(offsetof(SurefootOrderHeader, stamp) == 0, "OrderHeader.stamp");
static_assert(offsetof(SurefootOrderHeader, kind) == 40, "OrderHeader.kind");
static_assert(offsetof(SurefootOrderHeader, tolerance_m) == 48, "OrderHeader.tolerance_m");
static_assert(offsetof(SurefootOrderHeader, speed_mps) == 56, "OrderHeader.speed_mps");
static_assert(offsetof(SurefootOrderHeader, alpha) == 64, "OrderHeader.alpha");

/* Header of networks learned while driving; the payload is weights, then sidecar, as the bytes of their files. Known to the channels as surefoot.CheckpointHeader. */
typedef struct SurefootCheckpointHeader {
    /* Whose and of when. */
    SurefootStamp stamp;
    /* First 8 bytes of the SHA-256 of the weights. */
    uint64_t checkpoint;
    /* Bytes of the weights; the sidecar follows. */
    uint64_t n_weight_bytes;
    /* Footprints learned from, and judged by. */
    uint64_t n_examples[2];
    /* EMD2 on held-out footprints of the drive, of the networks before and of these. */
    double recent_emd2[2];
    /* EMD2 on the original validation data, of the original networks and of these. */
    double original_emd2[2];
} SurefootCheckpointHeader;
static_assert(sizeof(SurefootCheckpointHeader) == 104, "CheckpointHeader");
static_assert(offsetof(SurefootCheckpointHeader, stamp) == 0, "CheckpointHeader.stamp");
static_assert(offsetof(SurefootCheckpointHeader, checkpoint) == 40, "CheckpointHeader.checkpoint");
static_assert(offsetof(SurefootCheckpointHeader, n_weight_bytes) == 48, "CheckpointHeader.n_weight_bytes");
static_assert(offsetof(SurefootCheckpointHeader, n_examples) == 56, "CheckpointHeader.n_examples");
static_assert(offsetof(SurefootCheckpointHeader, recent_emd2) == 72, "CheckpointHeader.recent_emd2");
static_assert(offsetof(SurefootCheckpointHeader, original_emd2) == 88, "CheckpointHeader.original_emd2");

/* How a process is doing, twice a second. Known to the channels as surefoot.Status. */
typedef struct SurefootStatusRecord {
    /* 1 plant, 2 mapping, 3 learning, 4 control, 5 recorder, 6 mission, 7 ros. */
    uint64_t role;
    /* Process id. */
    uint64_t process;
    /* Cycles or messages a second since the last status [Hz]. */
    double rate_hz;
    /* Median and largest lateness since the last status [s]. */
    double lateness_s[2];
    /* Age of up to four inputs when they were last used [s]; negative = none yet. */
    double age_s[4];
    /* Deadlines missed since the process began. */
    uint64_t n_missed;
    /* Messages lost on the way, by gaps in their numbers. */
    uint64_t n_lost;
    /* Messages refused. */
    uint64_t n_refused;
    /* Looks at a channel that the transport broke off. */
    uint64_t n_failed;
    /* Figure of the role's own: speed [m/s], jumps made out, futures sampled, recorded bytes, messages of the robot. */
    double figure;
} SurefootStatusRecord;
static_assert(sizeof(SurefootStatusRecord) == 112, "StatusRecord");
static_assert(offsetof(SurefootStatusRecord, role) == 0, "StatusRecord.role");
static_assert(offsetof(SurefootStatusRecord, process) == 8, "StatusRecord.process");
static_assert(offsetof(SurefootStatusRecord, rate_hz) == 16, "StatusRecord.rate_hz");
static_assert(offsetof(SurefootStatusRecord, lateness_s) == 24, "StatusRecord.lateness_s");
static_assert(offsetof(SurefootStatusRecord, age_s) == 40, "StatusRecord.age_s");
static_assert(offsetof(SurefootStatusRecord, n_missed) == 72, "StatusRecord.n_missed");
static_assert(offsetof(SurefootStatusRecord, n_lost) == 80, "StatusRecord.n_lost");
static_assert(offsetof(SurefootStatusRecord, n_refused) == 88, "StatusRecord.n_refused");
static_assert(offsetof(SurefootStatusRecord, n_failed) == 96, "StatusRecord.n_failed");
static_assert(offsetof(SurefootStatusRecord, figure) == 104, "StatusRecord.figure");

#endif
