"""Seven ways to turn a steering command into an angle, and the effects that act inside them."""

import math

from numba import njit

from machine_types import TICK_S

DEAD_ZONE, FIRST_ORDER, SECOND_ORDER, VARIABLE_RATIO, STICTION, ARTICULATED, FOUR_WHEELS = range(7)


@njit(cache=True)
def delayed_tick(tick, part, delay_s, jitter, last_tick):
    """Command row that has arrived by now; rows never arrive out of order."""
    seen = tick + part - delay_s * (1.0 + jitter) / TICK_S
    return max(math.floor(seen), last_tick, 0.0)


@njit(cache=True)
def shaped_steer(machine, more, state, steer_rad):
    """Ratio, steps and play of sides: what reaches the servo [rad]."""
    full = min(abs(steer_rad) / machine.max_steer_rad, 1.0)
    steer_rad *= 1.0 + (more.steer_gain - 1.0) * (1.0 - 0.25 * full)
    if steer_rad > 0.0:
        steer_rad *= 1.0 - more.asymmetry
    steer_rad /= 1.0 + more.ratio_fall_s2pm2 * state.vx_mps**2
    if more.quantum_rad > 0.0:
        steer_rad = more.quantum_rad * round(steer_rad / more.quantum_rad)
    if machine.steer_kind == VARIABLE_RATIO:
        steer_rad *= 0.9 + 0.2 * full
    elif machine.steer_kind == FOUR_WHEELS:
        steer_rad /= 1.0 + machine.rear_steer
    return min(max(steer_rad, -1.15 * machine.max_steer_rad), 1.15 * machine.max_steer_rad)


@njit(cache=True)
def _second_order(machine, state, target_rad, own_lag_s, rate_limit, step_s):
    """A servo with inertia, may overshoot."""
    natural = 2.0 * machine.steer_damping / own_lag_s
    pull = natural**2 * (target_rad - state.steer_rad) - 2.0 * machine.steer_damping * natural * state.steer_rate_radps
    rate = state.steer_rate_radps + pull * step_s
    state.steer_rate_radps = min(max(rate, -rate_limit), rate_limit)


@njit(cache=True)
def servo(machine, more, state, target_rad, step_s):
    """Moves the steering for one step."""
    own_lag_s = 2.0 * machine.steer_damping / machine.steer_natural_radps + more.steer_lag_s
    rate_limit = min(machine.steer_rate_radps, more.steer_rate_radps)
    error = target_rad - state.steer_rad
    if machine.steer_kind == SECOND_ORDER:
        _second_order(machine, state, target_rad, own_lag_s, rate_limit, step_s)
    else:
        dead = machine.steer_dead_rad
        if machine.steer_kind == STICTION:
            moving = state.memory[7] > 0.5
            moving = abs(error) > (0.2 * dead if moving else dead)
            state.memory[7] = 1.0 if moving else 0.0
            beyond = error if moving else 0.0
        else:
            beyond = math.copysign(max(abs(error) - dead, 0.0), error)
        wanted = beyond / own_lag_s
        wanted = min(max(wanted, -rate_limit), rate_limit)
        swiftness = min(step_s * 60.0, 1.0)
        state.steer_rate_radps += swiftness * (wanted - state.steer_rate_radps)
    state.steer_rad += state.steer_rate_radps * step_s
    if machine.steer_kind == FOUR_WHEELS:
        rear = -machine.rear_steer * state.steer_rad
        state.rear_steer_rad += min(step_s / (1.5 * own_lag_s), 1.0) * (rear - state.rear_steer_rad)


@njit(cache=True)
def wheel_steer(machine, more, state, step_s):
    """Angle of the front wheels after play, trim, twist of the linkage, roll steer and a wobbling wheel [rad]."""
    half = more.backlash_rad
    play = state.play_rad * (1.0 - 0.3 * step_s) + state.steer_rad * 0.3 * step_s
    state.play_rad = min(max(play, state.steer_rad - half), state.steer_rad + half)
    angle = state.play_rad + more.steer_bias_rad
    twist = machine.compliance_radps2pm + more.compliance_radps2pm
    angle -= twist * state.front_force_mps2
    angle += machine.roll_steer * state.roll_rad
    return angle + more.wobble_rad * math.sin(state.turn_rad)
