"""Five ways in which a wheel meets the ground: force per slip of one tyre, all with relaxed slips as input."""

import math

from numba import njit

MAGIC, BRUSH, HARD_FLOOR, SOIL, CAMBERED = range(5)


@njit(cache=True)
def _magic(machine, slip, grip_n, load_n, stiffness):
    """Pacejka's formula over the resultant slip [N]."""
    factor = stiffness * load_n / (machine.shape * max(grip_n, 1e-6))
    bent = factor * slip - machine.curvature * (factor * slip - math.atan(factor * slip))
    return grip_n * math.sin(machine.shape * math.atan(bent))


@njit(cache=True)
def _brush(slip, grip_n, load_n, stiffness):
    """Bristles with parabolic pressure: adhesion, then sliding [N]."""
    share = stiffness * load_n * slip / (3.0 * max(grip_n, 1e-6))
    return grip_n if share >= 1.0 else grip_n * (3.0 * share - 3.0 * share**2 + share**3)


@njit(cache=True)
def _hard_floor(slip, grip_n, load_n, stiffness, fall):
    """Burckhardt's exponential with a fall after the peak [N]."""
    rise = 1.0 - math.exp(-stiffness * load_n * slip / max(grip_n, 1e-6))
    return grip_n * max(rise - fall * slip, 0.3 * rise)


@njit(cache=True)
def _soil(machine, slip, grip_n):
    """Janosi-Hanamoto shear of the soil under the contact patch [N]."""
    path = slip * 0.5 * machine.radius_m / machine.soil_shear_m
    return 0.0 if path < 1e-9 else grip_n * (1.0 - (1.0 - math.exp(-path)) / path)


@njit(cache=True)
def tyre_force(machine, slip_x, slip_y, load_n, mu, stiffness_factor):
    """Forces along and across one wheel from its relaxed slips [N]."""
    nominal_n = 0.25 * machine.mass_kg * 9.81
    grip_n = mu * load_n * max(1.0 - machine.load_sensitivity * (load_n / nominal_n - 1.0), 0.4)
    ratio = machine.stiff_lat / machine.stiff_long * stiffness_factor
    scaled_y = slip_y * ratio
    slip = math.sqrt(slip_x**2 + scaled_y**2)
    if slip < 1e-9:
        return 0.0, 0.0
    if machine.tyre_kind == MAGIC:
        force_n = _magic(machine, slip, grip_n, load_n, machine.stiff_long)
    elif machine.tyre_kind == BRUSH:
        force_n = _brush(slip, grip_n, load_n, machine.stiff_long)
    elif machine.tyre_kind == HARD_FLOOR:
        force_n = _hard_floor(slip, grip_n, load_n, machine.stiff_long, machine.curvature)
    elif machine.tyre_kind == SOIL:
        force_n = _soil(machine, slip, grip_n)
    else:
        force_n = grip_n * math.tanh(machine.stiff_long * load_n * slip / max(grip_n, 1e-6))
    return force_n * slip_x / slip, force_n * scaled_y / slip


@njit(cache=True)
def rolling_resistance(machine, slip_x, load_n):
    """Resistance of one wheel: a share of its load, more where it sinks, and more where it digs itself in [N]."""
    resistance = machine.roll_resistance * load_n
    if machine.tyre_kind == SOIL:
        pressed = load_n / (0.25 * machine.mass_kg * 9.81)
        digging = 1.0 + machine.soil_slip_sinkage * min(abs(slip_x), 1.0)
        resistance += machine.soil_sinkage * load_n * pressed**0.5 * digging
    return resistance
