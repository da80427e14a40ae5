"""From the true motion to a log: sensor faults and white noise."""

import numpy as np

from command_path import TICK_S

NOISE = {
    "x": 0.012, "y": 0.012, "z": 0.02, "roll": 0.003, "pitch": 0.003, "yaw": 0.003,
    "vx": 0.03, "vy": 0.03, "wz": 0.008,
}  # fmt: skip
POSE = ["x", "y", "z", "roll", "pitch", "yaw"]


def measure(truth: dict[str, np.ndarray], lead_ticks: int, injection: dict, seed: list[int]) -> dict[str, np.ndarray]:
    """Measured columns from row `lead_ticks` of the truth on; the rows before feed the pose latency."""
    generator = np.random.default_rng(seed)
    faulty = {name: column.copy() for name, column in truth.items()}
    ticks = np.arange(len(truth["x"]))
    late = ticks - injection.get("pose_latency", 0.0) / TICK_S
    for name in POSE:
        faulty[name] = np.interp(late, ticks, np.unwrap(truth[name]) if name == "yaw" else truth[name])
    faulty["yaw"] += injection.get("yaw_misalign", 0.0)
    faulty["vx"] *= injection.get("odom_scale", 1.0)
    faulty["vy"] *= injection.get("odom_scale", 1.0)
    faulty["wz"] += injection.get("gyro_bias", 0.0)
    columns = {name: column[lead_ticks:] for name, column in faulty.items()}
    for name, deviation in NOISE.items():
        columns[name] = columns[name] + deviation * generator.standard_normal(len(columns[name]))
    columns["yaw"] = (columns["yaw"] + np.pi) % (2 * np.pi) - np.pi
    return columns
