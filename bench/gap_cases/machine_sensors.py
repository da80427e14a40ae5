"""From the true motion of a machine to its log: sensors that differ from kind to kind."""

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import lfilter

from machine_drive import Truth, measured
from machine_types import LEAD_TICKS, TICK_S

OUTLIER_SHARE = 0.0035


def _wander(deviation: float, time_s: float, rows: int, generator: np.random.Generator) -> np.ndarray:
    """An Ornstein-Uhlenbeck walk."""
    keep = 1.0 - TICK_S / time_s
    kicks = deviation * (1.0 - keep**2) ** 0.5 * generator.standard_normal(rows)
    kicks[0] = deviation * generator.standard_normal()
    return lfilter([1.0], [1.0, -keep], kicks)


def _coloured(deviation: float, colour: float, rows: int, generator: np.random.Generator) -> np.ndarray:
    """Noise of a deviation whose neighbours correlate."""
    kicks = deviation * (1.0 - colour**2) ** 0.5 * generator.standard_normal(rows)
    return lfilter([1.0], [1.0, -colour], kicks)


def _spoil(columns: np.ndarray, noise: dict, generator: np.random.Generator) -> None:
    """Throws single samples of pose and velocity far off."""
    for column, name in ((0, "x"), (1, "y"), (5, "yaw"), (6, "vx"), (8, "wz")):
        hit = generator.uniform(size=len(columns)) < OUTLIER_SHARE
        columns[hit, column] += noise[name] * generator.uniform(8, 20, hit.sum()) * generator.choice([-1, 1], hit.sum())


def _velocities(vehicle, seen: np.ndarray, generator: np.random.Generator) -> None:
    """Adds what encoders and gyro do to vx, vy and wz."""
    senses, noise, rows = vehicle.kind.senses, vehicle.noise, len(seen)
    window = round(senses.average_ms / 1000.0 / TICK_S)
    if window > 1:
        seen[:, 6] = uniform_filter1d(seen[:, 6], window, origin=(window - 1) // 2)
    white = max(noise["vx"] ** 2 - senses.encoder_mps**2 / 12.0, 0.0) ** 0.5
    seen[:, 6] += white * generator.standard_normal(rows)
    if senses.encoder_mps > 0.0:
        seen[:, 6] = senses.encoder_mps * np.round(seen[:, 6] / senses.encoder_mps)
    seen[:, 7] += noise["vy"] * generator.standard_normal(rows)
    seen[:, 8] += _coloured(noise["wz"], senses.gyro_colour, rows, generator)


def sense(vehicle, truth: Truth, more: np.ndarray, seed: list[int], outliers: bool) -> np.ndarray:
    """The rows of a log without its time: pose, velocities, commands."""
    generator = np.random.default_rng([*seed, 2])
    seen, senses, noise = measured(truth, more), vehicle.kind.senses, vehicle.noise
    rows = np.arange(len(seen), dtype=float)
    for column in range(6):
        seen[:, column] = np.interp(rows - vehicle.filter_s / TICK_S, rows, seen[:, column])
    for column in (0, 1):
        if vehicle.wander_m > 0.0:
            seen[:, column] += _wander(vehicle.wander_m, senses.wander_s, len(seen), generator)
    for column, name in enumerate(["x", "y", "z", "roll", "pitch", "yaw"]):
        seen[:, column] += noise[name] * generator.standard_normal(len(seen))
    hold = np.floor(np.floor(rows * TICK_S * senses.pose_hz + 1e-6) / senses.pose_hz / TICK_S + 1e-6 + 0.999)
    seen[:, :6] = seen[np.minimum(hold, rows).astype(int), :6]
    _velocities(vehicle, seen, generator)
    if outliers:
        _spoil(seen, noise, generator)
    seen[:, 5] = (seen[:, 5] + np.pi) % (2 * np.pi) - np.pi
    return np.column_stack([seen, truth.commands])[LEAD_TICKS:]
