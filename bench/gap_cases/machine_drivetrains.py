"""Twelve ways to regulate the speed: from a wanted speed to the torque and the brakes of four wheels.

Demands are accelerations of the nominal machine [m/s2]: torque = demand x mass x wheel radius, whatever the load is.
"""

import math

from numba import njit

(
    FORCE_PI, VOLTAGE, TORQUE_MAP, HYDROSTATIC, HOBBY_CONTROLLER, GEARBOX,
    HUB_MOTORS, SCHEDULED, CASCADE, CLUTCH, SAMPLED, GOVERNED_CVT,
) = range(12)  # fmt: skip


@njit(cache=True)
def clip(value, low, high):
    """The value within its bounds."""
    return min(max(value, low), high)


@njit(cache=True)
def wheel_speed(machine, state):
    """Speed that the control unit reads from the driven wheels [m/s]."""
    front = 0.5 * (state.omega[0] + state.omega[1])
    rear = 0.5 * (state.omega[2] + state.omega[3])
    return machine.radius_m * (machine.front_share * front + (1.0 - machine.front_share) * rear)


@njit(cache=True)
def _known_resistance(machine, speed):
    """Feed-forward of the resistance that the maker measured [m/s2]."""
    return machine.feed_forward * (machine.roll_resistance * 9.81 + machine.aero_pm * speed**2) * math.tanh(speed / 0.2)


@njit(cache=True)
def _pi(machine, state, error, gain, integral_gain, base, step_s):
    """Proportional and integral part; the integral waits while the demand is at its limit."""
    raw = gain * error + state.integral[0] + base
    demand = clip(raw, -machine.brake_max_mps2, machine.accel_max_mps2)
    if raw == demand or raw * error < 0.0:
        state.integral[0] += integral_gain * error * step_s
    return demand


@njit(cache=True)
def _lag(state, index, target, time_s, step_s):
    """First-order memory."""
    state.memory[index] += min(step_s / max(time_s, step_s), 1.0) * (target - state.memory[index])
    return state.memory[index]


@njit(cache=True)
def _force_pi(machine, state, wanted, speed, hill, step_s):
    """PI with feed-forward; engine and friction brakes have lags of their own, brakes a dead zone."""
    base = _known_resistance(machine, speed) + hill
    demand = _pi(machine, state, wanted - speed, machine.kp, machine.ki, base, step_s)
    drive = _lag(state, 0, max(demand, -machine.drive_a), machine.actuator_s, step_s)
    return drive, _lag(state, 1, max(-demand - machine.drive_a, 0.0), machine.drive_b, step_s)


@njit(cache=True)
def _voltage(machine, state, wanted, speed, step_s):
    """Voltage in units of no-load speed: feed-forward and P, a battery that sags, back EMF."""
    battery = machine.drive_a - machine.drive_b * abs(state.memory[0])
    voltage = clip(machine.feed_forward * wanted + machine.kp * (wanted - speed), -battery, battery)
    current = clip((voltage - speed) / machine.drive_c, -machine.brake_max_mps2, machine.accel_max_mps2)
    return _lag(state, 0, current, machine.actuator_s, step_s), 0.0


@njit(cache=True)
def _shaped(machine, state, wanted, up, down, jerk, step_s):
    """Speed reference with limited acceleration and jerk; memory 2 is the speed, 3 its slope."""
    slope = clip(3.0 * (wanted - state.memory[2]), -down, up)
    change = clip(slope - state.memory[3], -jerk * step_s, jerk * step_s)
    state.memory[3] += change
    state.memory[2] += state.memory[3] * step_s
    return state.memory[2]


@njit(cache=True)
def _torque_map(machine, state, wanted, speed, hill, step_s):
    """Accelerator along a falling torque map; lifting it brakes by the motor, which braking adds to."""
    up, down = machine.accel_max_mps2, machine.brake_max_mps2
    reference = _shaped(machine, state, wanted, 0.8 * up, 0.8 * down, machine.drive_c, step_s)
    pedal = machine.kp * (reference - speed) + state.memory[3] * machine.feed_forward + hill
    engine_brake = machine.drive_a * speed / machine.max_speed_mps
    if pedal > 0.0:
        falling = min(1.0, 0.5 * machine.max_speed_mps / max(speed, 0.01))
        return _lag(state, 0, min(pedal, up * falling) - 0.3 * engine_brake, machine.actuator_s, step_s), 0.0
    return _lag(state, 0, max(pedal, -down) - engine_brake, machine.drive_b, step_s), 0.0


@njit(cache=True)
def _hydrostatic(machine, state, wanted, speed, step_s):
    """The swash plate sets the flow and so, but for leaks, the speed; a relief valve bounds the pressure."""
    change = (wanted / machine.max_speed_mps - state.memory[0]) / machine.actuator_s
    state.memory[0] += clip(change, -machine.drive_a, machine.drive_a) * step_s
    flow = state.memory[0] * machine.max_speed_mps - machine.drive_b * state.memory[1]
    pressure = clip(machine.kp * (flow - speed), -machine.brake_max_mps2, machine.accel_max_mps2)
    return _lag(state, 1, pressure, 0.03, step_s), 0.0


@njit(cache=True)
def _hobby_controller(machine, state, wanted, speed, step_s):
    """PI at 100 Hz on a coarse shaft encoder, a dead zone around neutral, a brushless motor's back EMF."""
    state.memory[1] += step_s
    if state.memory[1] >= 0.0099:
        state.memory[1] = 0.0
        error = wanted - machine.drive_a * round(speed / machine.drive_a)
        state.integral[0] = clip(state.integral[0] + machine.ki * error * 0.01, -0.5 * wanted - 0.3, 0.5 * wanted + 0.3)
        duty = wanted * machine.feed_forward + machine.kp * error + state.integral[0]
        state.memory[2] = 0.0 if abs(duty) < machine.drive_b else duty
    current = (state.memory[2] - speed) / machine.drive_c
    return _lag(
        state, 0, clip(current, -machine.brake_max_mps2, machine.accel_max_mps2), machine.actuator_s, step_s
    ), 0.0


@njit(cache=True)
def _gearbox(machine, state, wanted, speed, hill, step_s):
    """Governor over five gears with the torque cut while shifting; retarder first, then service brakes."""
    gear = state.memory[2]
    share = speed / machine.max_speed_mps
    state.memory[3] = max(state.memory[3] - step_s, 0.0)
    if state.memory[3] <= 0.0:
        better = gear + 1.0 if share > 0.2 * (gear + 1.0) else gear - 1.0 if share < 0.2 * gear - 0.06 else gear
        better = clip(better, 0.0, 4.0)
        if better != gear:
            state.memory[2], state.memory[3] = better, machine.drive_a
    demand = _pi(machine, state, wanted - speed, machine.kp, machine.ki, hill, step_s)
    strongest = machine.accel_max_mps2 / (1.0 + 0.45 * state.memory[2])
    engine = 0.0 if state.memory[3] > 0.0 else clip(demand, -0.15, strongest)
    drive = _lag(state, 0, engine, 0.08 if state.memory[3] > 0.0 else machine.actuator_s, step_s)
    slowing = max(-demand, 0.0)
    retarder = _lag(state, 1, min(slowing, machine.drive_b * share), 0.4, step_s)
    service = _lag(state, 4, max(slowing - machine.drive_b * share - 0.2, 0.0), machine.drive_c, step_s)
    return drive - retarder, service


@njit(cache=True)
def _scheduled(machine, state, wanted, speed, hill, slip, step_s):
    """PI whose gains fall with the speed, feed-forward of the air, traction control."""
    softer = 1.0 / (1.0 + machine.drive_a * speed / machine.max_speed_mps)
    base = _known_resistance(machine, wanted) + hill
    demand = _pi(machine, state, wanted - speed, machine.kp * softer, machine.ki * softer, base, step_s)
    change = -6.0 if slip > machine.drive_b else machine.drive_c
    state.memory[2] = clip(state.memory[2] + change * step_s, -0.8, 0.0)
    drive = _lag(state, 0, max(demand, -0.4) * (1.0 + state.memory[2]), machine.actuator_s, step_s)
    return drive, _lag(state, 1, max(-demand - 0.4, 0.0), 0.06, step_s)


@njit(cache=True)
def _cascade(machine, state, wanted, speed, hill, step_s):
    """S-curve, speed loop, current loop; a brake holds the machine at rest."""
    up = machine.accel_max_mps2
    reference = _shaped(machine, state, wanted, 0.6 * up, 0.7 * up, machine.drive_b, step_s)
    base = machine.feed_forward * state.memory[3] + hill
    demand = _pi(machine, state, reference - speed, machine.kp, machine.ki, base, step_s)
    hold = machine.drive_a if abs(speed) < 0.03 and abs(demand) < machine.drive_a else 0.0
    return _lag(state, 0, demand, machine.actuator_s, step_s), hold


@njit(cache=True)
def _clutch(machine, state, wanted, speed, hill, step_s):
    """Throttle with a rate limit behind a centrifugal clutch, foot brake, hill hold."""
    demand = _pi(machine, state, wanted - speed, machine.kp, machine.ki, hill, step_s)
    change = max(demand, 0.0) - state.memory[1]
    state.memory[1] += clip(change, -2.0 * machine.drive_a * step_s, machine.drive_a * step_s)
    gripping = clip(0.6 + speed / (0.3 * machine.max_speed_mps), 0.6, 1.0)
    engine_brake = machine.drive_b * clip(speed / machine.max_speed_mps - 0.1, 0.0, 1.0)
    drive = _lag(state, 0, state.memory[1] * gripping - engine_brake, machine.actuator_s, step_s)
    holding = 3.0 if wanted < 0.05 and abs(speed) < 0.15 else 0.0
    return drive, _lag(state, 4, max(-demand - engine_brake, holding), machine.drive_c, step_s)


@njit(cache=True)
def _sampled(machine, state, wanted, speed, hill, step_s):
    """PI at 20 Hz on an averaged encoder; the demand is held in between."""
    averaged = _lag(state, 2, speed, 0.04, step_s)
    state.memory[1] += step_s
    if state.memory[1] >= machine.drive_a:
        state.memory[1] = 0.0
        state.memory[3] = _pi(machine, state, wanted - averaged, machine.kp, machine.ki, hill, machine.drive_a)
    return _lag(state, 0, state.memory[3], machine.actuator_s, step_s), 0.0


@njit(cache=True)
def _governed_cvt(machine, state, wanted, speed, step_s):
    """A diesel that droops under load behind a slowly changing ratio."""
    change = (wanted / machine.max_speed_mps - state.memory[0]) / machine.actuator_s
    state.memory[0] += clip(change, -machine.drive_b, machine.drive_b) * step_s
    load = clip(state.memory[1] / machine.accel_max_mps2, -0.5, 1.0)
    droop = _lag(state, 2, machine.drive_a * load * (0.3 + state.memory[0]), 0.35, step_s)
    shaft = state.memory[0] * machine.max_speed_mps * (1.0 - droop)
    limit = machine.accel_max_mps2 / (0.5 + speed / machine.max_speed_mps)
    return _lag(state, 1, clip(machine.kp * (shaft - speed), -machine.brake_max_mps2, limit), 0.06, step_s), 0.0


@njit(cache=True)
def _hub_motors(machine, more, state, wanted, step_s):
    """A PI per wheel on its own encoder; targets follow from the steering that was asked for."""
    scale = machine.mass_kg * machine.radius_m / 4.0
    turning = (math.tan(state.steer_rad) - math.tan(state.rear_steer_rad)) / (machine.front_m + machine.rear_m)
    limit = min(machine.accel_max_mps2, more.accel_limit_mps2)
    for wheel in range(4):
        side = -0.5 * machine.track_m if wheel % 2 == 0 else 0.5 * machine.track_m
        read = machine.drive_a * round(state.omega[wheel] * machine.radius_m / machine.drive_a)
        error = wanted * (1.0 + side * turning) - read
        raw = machine.kp * error + state.integral[wheel]
        demand = clip(raw, -limit, limit)
        if raw == demand or raw * error < 0.0:
            state.integral[wheel] += machine.ki * error * step_s
        smooth = min(step_s / machine.actuator_s, 1.0)
        state.torque[wheel] += smooth * (demand * scale - state.torque[wheel])
        state.brake[wheel] = 0.0


@njit(cache=True)
def _demand(machine, state, wanted, hill, slip, step_s):
    """Drive and brake demand of the machine's own control unit [m/s2]."""
    speed, kind = wheel_speed(machine, state), machine.drive_kind
    if kind == FORCE_PI:
        return _force_pi(machine, state, wanted, speed, hill, step_s)
    if kind == VOLTAGE:
        return _voltage(machine, state, wanted, speed, step_s)
    if kind == TORQUE_MAP:
        return _torque_map(machine, state, wanted, speed, hill, step_s)
    if kind == HYDROSTATIC:
        return _hydrostatic(machine, state, wanted, speed, step_s)
    if kind == HOBBY_CONTROLLER:
        return _hobby_controller(machine, state, wanted, speed, step_s)
    if kind == GEARBOX:
        return _gearbox(machine, state, wanted, speed, hill, step_s)
    if kind == SCHEDULED:
        return _scheduled(machine, state, wanted, speed, hill, slip, step_s)
    if kind == CASCADE:
        return _cascade(machine, state, wanted, speed, hill, step_s)
    if kind == CLUTCH:
        return _clutch(machine, state, wanted, speed, hill, step_s)
    if kind == SAMPLED:
        return _sampled(machine, state, wanted, speed, hill, step_s)
    return _governed_cvt(machine, state, wanted, speed, step_s)


@njit(cache=True)
def drive_wheels(machine, more, state, wanted, hill, slip, step_s):
    """Sets the torque and the brake of each wheel."""
    if machine.drive_kind == HUB_MOTORS:
        _hub_motors(machine, more, state, wanted, step_s)
        return
    drive, brake = _demand(machine, state, wanted, hill, slip, step_s)
    limit = more.accel_limit_mps2 * (1.0 - 0.2 * min(abs(state.vx_mps) / machine.max_speed_mps, 1.0))
    drive, brake = clip(drive, -limit, limit), min(brake, limit)
    scale = machine.mass_kg * machine.radius_m
    for wheel in range(4):
        share = 0.5 * (machine.front_share if wheel < 2 else 1.0 - machine.front_share)
        state.torque[wheel] = drive * scale * share
        state.brake[wheel] = brake * scale * (0.3 if wheel < 2 else 0.2)
