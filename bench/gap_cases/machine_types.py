"""Records that the compiled machines work on: what a machine is, what was added to it, and its state.

A machine is one row of numbers, so that a kind is a set of ranges and a vehicle a draw from them.
"""

import numpy as np

GRAVITY_MPS2 = 9.81
TICK_S = 0.02
DRIVE_TICKS, LEAD_TICKS = 2000, 150
ALL_TICKS = DRIVE_TICKS + LEAD_TICKS

MACHINE = np.dtype(
    [("tyre_kind", "i8"), ("drive_kind", "i8"), ("steer_kind", "i8"), ("articulated", "i8"), ("substeps", "i8")]
    + [
        (name, "f8")
        for name in """
        mass_kg inertia_kgm2 front_m rear_m track_m height_m
        roll_rate_radps roll_damping roll_gain pitch_rate_radps pitch_damping pitch_gain
        front_roll_share transfer_s roll_steer camber_thrust
        mu stiff_long stiff_lat rear_stiff_ratio shape curvature load_sensitivity relax_long_m relax_lat_m
        compliance_radps2pm soil_sinkage soil_shear_m soil_slip_sinkage
        radius_m wheel_inertia_kgm2 roll_resistance aero_pm loose_mu loose_drag_mps2 veg_drag_mps2
        front_share diff_lock_ps kp ki feed_forward accel_max_mps2 brake_max_mps2 actuator_s
        drive_a drive_b drive_c hill_comp hill_lag_s
        steer_natural_radps steer_damping steer_rate_radps steer_dead_rad rear_steer max_steer_rad
        steer_delay_s speed_delay_s ackermann front_swing_share
        min_speed_mps max_speed_mps lateral_mps2
        """.split()
    ]
)

ADDED = np.dtype(
    [
        (name, "f8")
        for name in """
        steer_lag_s steer_rate_radps steer_delay_s steer_bias_rad steer_gain understeer_route front_stiffness
        compliance_radps2pm friction backlash_rad speed_lag_s speed_delay_s accel_limit_mps2 radius deadband_mps
        rolling_drag_mps2 quad_drag_pm veg_drag_mps2 slope_extra cross_extra wind_x_mps2 wind_y_mps2 mass
        pose_latency_s odom_scale gyro_bias_radps yaw_misalign_rad
        dropout_share asymmetry wobble_rad shimmy_radps2 shimmy_hz sag_per_s fade payload gps_jump_m clock_drift
        weak_corner trailer heat quantum_rad ratio_fall_s2pm2 loose_drag_mps2 crab_rad locked_ps sticky_mps limp
        """.split()
    ]
)

STATE = np.dtype(
    [
        (name, "f8")
        for name in """
        x_m y_m yaw_rad vx_mps vy_mps wz_radps roll_rad roll_rate_radps squat_rad squat_rate_radps
        ax_mps2 ay_mps2 force_x_mps2 force_y_mps2
        steer_rad steer_rate_radps rear_steer_rad wheel_steer_rad lagged_steer_rad play_rad
        speed_lag1_mps speed_lag2_mps hill_pitch_rad pitch_rad roll_ground_rad height_m terrain_class
        dead_on heat trailer_rad front_force_mps2 held_speed_mps held_steer_rad read_steer_tick read_speed_tick turn_rad
        """.split()
    ]
    + [("omega", "f8", (4,)), ("slip_x", "f8", (4,)), ("slip_y", "f8", (4,)), ("load", "f8", (4,))]
    + [("torque", "f8", (4,)), ("brake", "f8", (4,)), ("integral", "f8", (4,)), ("memory", "f8", (8,))]
)

NEUTRAL = {
    "steer_rate_radps": 1e6,
    "accel_limit_mps2": 1e6,
    "steer_gain": 1.0,
    "front_stiffness": 1.0,
    "friction": 1.0,
    "radius": 1.0,
    "mass": 1.0,
    "odom_scale": 1.0,
}


def record(dtype: np.dtype, values: dict) -> np.ndarray:
    """One row of a record type; what is not named is zero."""
    row = np.zeros(1, dtype)
    for name, value in values.items():
        row[name] = value
    return row


def added(values: dict) -> np.ndarray:
    """What was added to a machine; nothing where `values` is empty."""
    return record(ADDED, NEUTRAL | values)
