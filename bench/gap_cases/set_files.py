"""The files of a set of cases that a diagnosis may see, and seeds by name; the logs' columns are their makers'."""

import zlib
from pathlib import Path

import numpy as np

from ground import Ground


def seed_of(*names: str) -> int:
    """A seed that depends on names alone."""
    return zlib.crc32("/".join(names).encode())


def write_vehicle(folder: Path, numbers: dict[str, str], noise: dict[str, float], ground: Ground) -> Path:
    """Map and vehicle.toml; `numbers` by name, as they are to stand there: the wheelbase and the limits."""
    folder.mkdir(parents=True, exist_ok=True)
    np.savetxt(folder / "heightmap.csv", ground.height_m, fmt="%.3f", delimiter=",")
    np.savetxt(folder / "terrain_class.csv", ground.terrain_class, fmt="%d", delimiter=",")
    origin = -ground.half_extent_m
    lines = [
        f'name = "{numbers["name"]}"',
        'reference_point = "rear_axle"',
        *(f"{name} = {numbers[name]}" for name in ["wheelbase", "max_steer", "max_speed", "min_speed"]),
        "log_rate_hz = 50.0",
        'sim_train = ["sim_1.csv", "sim_2.csv", "sim_3.csv"]',
        'sim_heldout = ["sim_4.csv"]',
        "[noise]",
        *(f"{name} = {value}" for name, value in noise.items()),
        "[map]",
        'heightmap = "heightmap.csv"',
        'terrain_class = "terrain_class.csv"',
        f"resolution = {ground.shape.resolution_m}",
        f"origin_x = {origin:.4f}",
        f"origin_y = {origin:.4f}",
        'index = "row = x, column = y"',
        'classes = { 0 = "open", 1 = "loose", 2 = "vegetation" }',
    ]
    (folder / "vehicle.toml").write_text("\n".join(lines) + "\n")
    return folder


def write_case(folder: Path, vehicle: str, n_sims: int) -> Path:
    """case.toml of a case that is called as its folder."""
    folder.mkdir(parents=True, exist_ok=True)
    base = f"../../vehicles/{vehicle}"
    sims = ", ".join(f'"{base}/sim_{number}.csv"' for number in range(1, n_sims + 1))
    (folder / "case.toml").write_text(
        f'name = "{folder.name}"\nvehicle = "{base}/vehicle.toml"\nsim = [{sims}]\n'
        'real = ["real_train_1.csv", "real_train_2.csv"]\nheldout = ["real_heldout.csv"]\n'
    )
    return folder
