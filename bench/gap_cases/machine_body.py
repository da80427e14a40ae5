"""One step of a machine: ground, commands, steering, drive, four wheels, and the body they push."""

import math

from numba import njit

from machine_drivetrains import drive_wheels
from machine_steering import delayed_tick, servo, shaped_steer, wheel_steer
from machine_tyres import rolling_resistance, tyre_force
from machine_types import GRAVITY_MPS2, TICK_S

STEER_JITTER, SPEED_JITTER, DROPOUT, GUST, PATCH = range(5)


@njit(cache=True)
def height_at(ground, half_m, resolution_m, x_m, y_m):
    """Bilinear height; held at the edge of the map."""
    last = ground.shape[0] - 1.001
    along = min(max((x_m + half_m) / resolution_m, 0.0), last)
    across = min(max((y_m + half_m) / resolution_m, 0.0), last)
    i, j = int(along), int(across)
    u, v = along - i, across - j
    low = ground[i, j] * (1 - u) + ground[i + 1, j] * u
    high = ground[i, j + 1] * (1 - u) + ground[i + 1, j + 1] * u
    return low * (1 - v) + high * v


@njit(cache=True)
def _stand(machine, state, ground, classes, half_m, resolution_m):
    """Attitude from the ground under axles and sides; pitch > 0 nose down, roll > 0 left side up."""
    cos, sin = math.cos(state.yaw_rad), math.sin(state.yaw_rad)
    x, y, side = state.x_m, state.y_m, 0.5 * machine.track_m
    front = height_at(ground, half_m, resolution_m, x + machine.front_m * cos, y + machine.front_m * sin)
    rear = height_at(ground, half_m, resolution_m, x - machine.rear_m * cos, y - machine.rear_m * sin)
    left = height_at(ground, half_m, resolution_m, x - side * sin, y + side * cos)
    right = height_at(ground, half_m, resolution_m, x + side * sin, y - side * cos)
    state.pitch_rad = -math.atan((front - rear) / (machine.front_m + machine.rear_m))
    state.roll_ground_rad = math.atan((left - right) / machine.track_m)
    state.height_m = rear
    i = int(min(max((x + half_m) / resolution_m + 0.5, 0.0), classes.shape[0] - 1.0))
    j = int(min(max((y + half_m) / resolution_m + 0.5, 0.0), classes.shape[0] - 1.0))
    state.terrain_class = classes[i, j]


@njit(cache=True)
def _arrived(machine, more, state, commands, tables, tick, part):
    """Commands that have reached the machine by now."""
    late = machine.steer_delay_s + more.steer_delay_s * (1.0 + tables[tick, STEER_JITTER])
    state.read_steer_tick = delayed_tick(tick, part, late, 0.0, state.read_steer_tick)
    late = machine.speed_delay_s + more.speed_delay_s * (1.0 + tables[tick, SPEED_JITTER])
    state.read_speed_tick = delayed_tick(tick, part, late, 0.0, state.read_speed_tick)
    if tables[tick, DROPOUT] >= more.dropout_share:
        state.held_steer_rad = commands[int(state.read_steer_tick), 1]
        speed = commands[int(state.read_speed_tick), 0]
        if abs(speed - state.held_speed_mps) > more.sticky_mps:
            state.held_speed_mps = speed
    return state.held_speed_mps, state.held_steer_rad


@njit(cache=True)
def _wanted_speed(machine, more, state, speed, tick, step_s):
    """Dead band, flat battery, limp mode and two lags between the command and the control unit."""
    seconds = max(tick - 150, 0) * TICK_S
    threshold = more.deadband_mps * (1.0 if state.dead_on < 0.5 else 0.9)
    state.dead_on = 1.0 if abs(speed) >= threshold else 0.0
    speed *= state.dead_on * (1.0 - more.sag_per_s * seconds)
    if seconds % 11.0 > 7.5:
        speed *= 1.0 - more.limp
    share = min(step_s / max(0.5 * more.speed_lag_s, step_s), 1.0)
    state.speed_lag1_mps += share * (speed - state.speed_lag1_mps)
    state.speed_lag2_mps += share * (state.speed_lag1_mps - state.speed_lag2_mps)
    return state.speed_lag2_mps


@njit(cache=True)
def _loads(machine, state, mass_kg):
    """Loads of the wheels from weight, braking and leaning [N]; the springs are those of the empty machine."""
    length = machine.front_m + machine.rear_m
    weight = mass_kg * GRAVITY_MPS2
    along = mass_kg * machine.height_m * state.ax_mps2 / length
    lean = state.roll_rad * machine.roll_rate_radps**2 + machine.roll_damping * state.roll_rate_radps
    across = machine.mass_kg * machine.height_m * lean / machine.roll_gain / machine.track_m
    front = 0.5 * (weight * machine.rear_m / length - along)
    rear = 0.5 * (weight * machine.front_m / length + along)
    twist = across * machine.front_roll_share
    state.load[0], state.load[1] = max(front - twist, 0.0), max(front + twist, 0.0)
    twist = across * (1.0 - machine.front_roll_share)
    state.load[2], state.load[3] = max(rear - twist, 0.0), max(rear + twist, 0.0)


@njit(cache=True)
def _place(machine, more, state, wheel, angle):
    """Position of a wheel in the body, the way it points, and the speed its axle swings at."""
    left = wheel % 2 == 0
    side = 0.5 * machine.track_m if left else -0.5 * machine.track_m
    if wheel >= 2:
        return -machine.rear_m, side, state.rear_steer_rad + more.crab_rad, 0.0, 0.0
    length = machine.front_m + machine.rear_m
    if machine.articulated == 1:
        arm, cos, sin = 0.5 * length, math.cos(angle), math.sin(angle)
        swing = state.steer_rate_radps * arm
        x = machine.front_m - arm + arm * cos - side * sin
        return x, arm * sin + side * cos, angle, -swing * sin, swing * cos
    tangent = math.tan(angle)
    inner = math.atan(tangent / (1.0 - machine.ackermann * side * tangent / length))
    return machine.front_m, side, inner, 0.0, 0.0


@njit(cache=True)
def _spin(machine, more, state, wheel, force_n, load_n, step_s):
    """Turns a wheel: drive, tyre, then Coulomb brakes that may stop it."""
    radius = machine.radius_m * more.radius
    inertia = machine.wheel_inertia_kgm2
    torque = state.torque[wheel] - radius * force_n
    other = wheel + 1 if wheel % 2 == 0 else wheel - 1
    coupling = more.locked_ps if wheel >= 2 else 0.0
    if wheel >= 2 or machine.front_share > 0.0:
        coupling += machine.diff_lock_ps
    torque -= coupling * inertia * (state.omega[wheel] - state.omega[other])
    omega = state.omega[wheel] + torque / inertia * step_s
    resistance = radius * rolling_resistance(machine, state.slip_x[wheel], load_n) + state.brake[wheel]
    if wheel == 0:
        resistance += 0.06 * more.weak_corner * radius * load_n
    stop = resistance / inertia * step_s
    state.omega[wheel] = 0.0 if abs(omega) <= stop else omega - math.copysign(stop, omega)


@njit(cache=True)
def _wheel_force(machine, more, state, wheel, angle, mu, step_s):
    """Force of one wheel on the body in the body's axes, and its arm for the yaw moment."""
    x, y, heading, swing_x, swing_y = _place(machine, more, state, wheel, angle)
    along = state.vx_mps - state.wz_radps * y + swing_x
    across = state.vy_mps + state.wz_radps * x + swing_y
    cos, sin = math.cos(heading), math.sin(heading)
    rolling, sliding = along * cos + across * sin, across * cos - along * sin
    radius = machine.radius_m * more.radius
    slipping = radius * state.omega[wheel] - rolling
    speed = abs(rolling) + 0.02
    relaxed = min(step_s * speed / machine.relax_long_m, 0.9)
    state.slip_x[wheel] += relaxed * (slipping / speed - state.slip_x[wheel])
    relaxed = min(step_s * speed / machine.relax_lat_m, 0.9)
    lean = machine.camber_thrust * state.roll_rad
    state.slip_y[wheel] += relaxed * (-sliding / speed - lean - state.slip_y[wheel])
    state.slip_x[wheel] = min(max(state.slip_x[wheel], -1.0), 1.0)
    state.slip_y[wheel] = min(max(state.slip_y[wheel], -1.0), 1.0)
    load, stiffness = state.load[wheel], machine.rear_stiff_ratio if wheel >= 2 else more.front_stiffness
    if wheel == 0:
        stiffness *= 1.0 - more.weak_corner
    force_x, force_y = tyre_force(machine, state.slip_x[wheel], state.slip_y[wheel], load, mu, stiffness)
    damping = 0.02 * machine.stiff_long * load / max(machine.max_speed_mps, 1.0)
    _spin(machine, more, state, wheel, force_x + damping * slipping, load, step_s)
    force_x += damping * slipping
    force_y -= damping * sliding
    body_x, body_y = force_x * cos - force_y * sin, force_x * sin + force_y * cos
    return body_x, body_y, x * body_y - y * body_x


@njit(cache=True)
def _resistance(machine, more, state, tables, tick, fading):
    """Drag of air, classes, bearings and hot brakes [m/s2], against the motion."""
    speed = abs(state.vx_mps)
    drag = (machine.aero_pm + more.quad_drag_pm) * speed**2
    drag += more.rolling_drag_mps2 * (1.0 + 0.15 * speed / machine.max_speed_mps)
    drag += more.heat * state.heat + 0.8 * more.payload * fading + 0.35 * more.trailer
    if state.terrain_class == 2:
        patchy = 1.0 + 0.2 * tables[tick, PATCH]
        drag += machine.veg_drag_mps2
        drag += more.veg_drag_mps2 * patchy * (0.85 + 0.3 * speed / machine.max_speed_mps)
    elif state.terrain_class == 1:
        drag += machine.loose_drag_mps2 + more.loose_drag_mps2
    return -drag * math.tanh(state.vx_mps / (0.02 * machine.max_speed_mps))


@njit(cache=True)
def _outer(machine, more, state, tables, tick, fading):
    """Accelerations from gravity, wind and drag in the body's axes [m/s2]."""
    cos, sin = math.cos(state.yaw_rad), math.sin(state.yaw_rad)
    down = GRAVITY_MPS2 * math.sin(state.pitch_rad)
    side = -GRAVITY_MPS2 * math.sin(state.roll_ground_rad) * (1.0 + more.cross_extra)
    if machine.hill_comp == 0.0:
        down *= 1.0 + more.slope_extra
    gust = 1.0 + 0.2 * tables[tick, GUST]
    ahead = gust * (more.wind_x_mps2 * cos + more.wind_y_mps2 * sin)
    across = 1.2 * gust * (more.wind_y_mps2 * cos - more.wind_x_mps2 * sin)
    return down + ahead + _resistance(machine, more, state, tables, tick, fading), side + across


@njit(cache=True)
def _trailer(machine, more, state, step_s):
    """Side pull of a trailer at the hitch [m/s2 of the machine]."""
    length = 1.2 * (machine.front_m + machine.rear_m)
    state.trailer_rad += step_s * (-state.wz_radps - state.vx_mps * math.sin(state.trailer_rad) / length)
    pull = more.trailer * (state.ax_mps2 + 0.5 - GRAVITY_MPS2 * math.sin(state.pitch_rad))
    return -pull * math.sin(state.trailer_rad)


@njit(cache=True)
def _push(machine, more, state, tables, tick, angle, step_s):
    """All forces on the body, integrated for one step."""
    seconds = max(tick - 150, 0) * TICK_S
    fading = max(1.0 - seconds / 36.0, 0.0)
    mass = machine.mass_kg * more.mass * (1.0 + more.payload * fading)
    inertia = machine.inertia_kgm2 * more.mass * (1.0 + more.payload * fading)
    mu = machine.mu * more.friction * (1.0 - more.fade * min(max((seconds - 8.0) / 14.0, 0.0), 1.0))
    if state.terrain_class == 1:
        mu *= machine.loose_mu
    _loads(machine, state, mass)
    force_x, force_y, moment, front_y = 0.0, 0.0, 0.0, 0.0
    for wheel in range(4):
        wheel_x, wheel_y, turning = _wheel_force(machine, more, state, wheel, angle, mu, step_s)
        force_x, force_y, moment = force_x + wheel_x, force_y + wheel_y, moment + turning
        front_y += wheel_y if wheel < 2 else 0.0
    outer_x, outer_y = _outer(machine, more, state, tables, tick, fading)
    hitch_y = _trailer(machine, more, state, step_s) if more.trailer > 0.0 else 0.0
    own_x = force_x / (mass * (1.0 + more.trailer)) + outer_x
    own_y = force_y / mass + outer_y + hitch_y
    turn = moment / inertia - hitch_y * machine.rear_m * mass / inertia
    turn += more.shimmy_radps2 * math.sin(6.2832 * more.shimmy_hz * seconds)
    state.front_force_mps2 += min(step_s / 0.02, 1.0) * (front_y / machine.mass_kg - state.front_force_mps2)
    smooth = min(step_s / machine.transfer_s, 1.0)
    state.ax_mps2 += smooth * (force_x / mass - state.ax_mps2)
    _lean(machine, more, state, force_x, force_y, step_s)
    _integrate(state, own_x, own_y, turn, step_s)


@njit(cache=True)
def _lean(machine, more, state, force_x, force_y, step_s):
    """The body on its springs, which the tyres tilt; a weak one lets its corner down, front left."""
    sag = 0.02 * more.weak_corner
    pushed = force_y / machine.mass_kg * machine.roll_gain
    leaning = pushed - machine.roll_rate_radps**2 * (state.roll_rad + sag)
    state.roll_rate_radps += step_s * (leaning - machine.roll_damping * state.roll_rate_radps)
    state.roll_rad += step_s * state.roll_rate_radps
    pushed = -force_x / machine.mass_kg * machine.pitch_gain
    squatting = pushed - machine.pitch_rate_radps**2 * (state.squat_rad - 0.7 * sag)
    state.squat_rate_radps += step_s * (squatting - machine.pitch_damping * state.squat_rate_radps)
    state.squat_rad += step_s * state.squat_rate_radps


@njit(cache=True)
def _integrate(state, own_x, own_y, turn, step_s):
    """Semi-implicit step of the planar motion over the ground."""
    before = state.vx_mps
    state.vx_mps += step_s * (own_x + state.vy_mps * state.wz_radps)
    state.vy_mps += step_s * (own_y - before * state.wz_radps)
    state.wz_radps += step_s * turn
    state.yaw_rad += step_s * state.wz_radps
    cos, sin = math.cos(state.yaw_rad), math.sin(state.yaw_rad)
    ahead = state.vx_mps * math.cos(state.pitch_rad)
    side = state.vy_mps * math.cos(state.roll_ground_rad)
    state.x_m += step_s * (ahead * cos - side * sin)
    state.y_m += step_s * (ahead * sin + side * cos)


@njit(cache=True)
def advance(machine, more, state, commands, tables, tick, ground, classes, half_m, resolution_m):
    """Moves a machine on by one row of the log."""
    step_s = TICK_S / machine.substeps
    slip = 0.0
    for part in range(machine.substeps):
        _stand(machine, state, ground, classes, half_m, resolution_m)
        speed, steer = _arrived(machine, more, state, commands, tables, tick, part / machine.substeps)
        target = shaped_steer(machine, more, state, steer)
        turned = state.steer_rate_radps
        servo(machine, more, state, target, step_s)
        if machine.articulated == 1:
            state.wz_radps -= machine.front_swing_share * (state.steer_rate_radps - turned)
        angle = wheel_steer(machine, more, state, step_s)
        wanted = _wanted_speed(machine, more, state, speed, tick, step_s)
        late = min(step_s / max(machine.hill_lag_s, step_s), 1.0)
        state.hill_pitch_rad += late * (state.pitch_rad - state.hill_pitch_rad)
        comp = machine.hill_comp - more.slope_extra if machine.hill_comp > 0.0 else 0.0
        hill = -comp * GRAVITY_MPS2 * math.sin(state.hill_pitch_rad)
        slip = max(state.slip_x[2], state.slip_x[3])
        drive_wheels(machine, more, state, wanted, hill, slip, step_s)
        state.heat += step_s / 12.0 * (abs(state.ax_mps2) / machine.accel_max_mps2 - state.heat)
        state.turn_rad += step_s * state.omega[0]
        _push(machine, more, state, tables, tick, angle, step_s)
