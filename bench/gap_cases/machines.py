"""Makes a set over kinds of machine: python machines.py SET --out FOLDER.

Every name of a set is a draw of its own: vehicles, maps, drivers and cases follow from it.
"""

import argparse
import json
from pathlib import Path

import numpy as np

from machine_kinds import KINDS
from machine_plan import DRIVES, Case, Planner, drive_checks, label, survived
from machine_sensors import sense
from machine_types import TICK_S, added, seed_of
from machine_vehicles import Vehicle, vehicle_of

COLUMNS = "t,x,y,z,roll,pitch,yaw,vx,vy,wz,cmd_speed,cmd_steer"
FORMATS = ["%.2f"] + ["%.4f"] * 9 + ["%.3f", "%.4f"]
SIM_HABITS = ["path", "setpoint", "sweep", "human"]


def write_log(path: Path, rows: np.ndarray) -> None:
    """A drive log as CSV."""
    table = np.column_stack([np.arange(len(rows)) * TICK_S, rows])
    np.savetxt(path, table, fmt=FORMATS, delimiter=",", header=COLUMNS, comments="")


def vehicle_file(vehicle: Vehicle) -> str:
    """The text of vehicle.toml."""
    origin = -vehicle.ground.half_extent_m
    lines = [
        f'name = "{vehicle.name}"',
        'reference_point = "rear_axle"',
        f"wheelbase = {vehicle.length_m:.4f}",
        f"max_steer = {vehicle.number('max_steer_rad'):.4f}",
        f"max_speed = {vehicle.number('max_speed_mps'):.3f}",
        f"min_speed = {vehicle.number('min_speed_mps')}",
        "log_rate_hz = 50.0",
        'sim_train = ["sim_1.csv", "sim_2.csv", "sim_3.csv"]',
        'sim_heldout = ["sim_4.csv"]',
        "[noise]",
        *(f"{name} = {value}" for name, value in vehicle.noise.items()),
        "[map]",
        'heightmap = "heightmap.csv"',
        'terrain_class = "terrain_class.csv"',
        f"resolution = {vehicle.ground.shape.resolution_m}",
        f"origin_x = {origin:.4f}",
        f"origin_y = {origin:.4f}",
        'index = "row = x, column = y"',
        'classes = { 0 = "open", 1 = "loose", 2 = "vegetation" }',
    ]
    return "\n".join(lines) + "\n"


def make_vehicle(folder: Path, set_name: str, vehicle: Vehicle) -> None:
    """Map, vehicle file and nominal drives."""
    target = folder / "vehicles" / vehicle.name
    target.mkdir(parents=True, exist_ok=True)
    np.savetxt(target / "heightmap.csv", vehicle.ground.height_m, fmt="%.3f", delimiter=",")
    np.savetxt(target / "terrain_class.csv", vehicle.ground.terrain_class, fmt="%d", delimiter=",")
    (target / "vehicle.toml").write_text(vehicle_file(vehicle))
    for number, habit in enumerate(SIM_HABITS, 1):
        name = [set_name, vehicle.kind.name, f"sim_{number}"]
        found = survived(vehicle, habit, added({}), name, slides=False)
        if found is None:
            raise SystemExit(f"{vehicle.kind.name}: no nominal {habit} drive survived")
        write_log(target / f"sim_{number}.csv", sense(vehicle, found[0], added({}), found[1], outliers=False))


def make_case(folder: Path, set_name: str, name: str, case: Case) -> dict | None:
    """Case file and the three drives; the label, or None where no drive survived."""
    driven = {}
    for drive, habit in zip(DRIVES, case.habits, strict=True):
        driven[drive] = survived(case.vehicle, habit, case.more, [set_name, case.key, drive], case.slides)
        if driven[drive] is None:
            return None
    target = folder / "cases" / name
    target.mkdir(parents=True, exist_ok=True)
    base = f"../../vehicles/{case.vehicle.name}"
    sims = ", ".join(f'"{base}/sim_{number}.csv"' for number in range(1, len(SIM_HABITS) + 1))
    (target / "case.toml").write_text(
        f'name = "{name}"\nvehicle = "{base}/vehicle.toml"\nsim = [{sims}]\n'
        'real = ["real_train_1.csv", "real_train_2.csv"]\nheldout = ["real_heldout.csv"]\n'
    )
    checks = {}
    for (drive, (truth, seed)), habit in zip(driven.items(), case.habits, strict=True):
        write_log(target / f"{drive}.csv", sense(case.vehicle, truth, case.more, seed, case.outliers))
        checks[drive] = drive_checks(case, habit, truth, seed)
    return label(case, checks)


def make_set(folder: Path, set_name: str, kinds: list[str], labels_file: Path) -> None:
    """All vehicles, then all cases in a shuffled order under anonymous names."""
    planner, cases = Planner(set_name), []
    for kind in kinds:
        vehicle = vehicle_of(set_name, kind)
        make_vehicle(folder, set_name, vehicle)
        cases += planner.cases_of(vehicle)
        print(kind, vehicle.name, flush=True)
    labels = {}
    order = np.random.default_rng(seed_of(set_name, "order")).permutation(len(cases))
    for number, index in enumerate(order, 1):
        entry = make_case(folder, set_name, f"c{number:03d}", cases[index])
        if entry is None:
            print(f"c{number:03d}: no drive survived {cases[index].values}", flush=True)
            continue
        labels[f"c{number:03d}"] = entry
    labels_file.write_text(json.dumps(labels, indent=1) + "\n")


def main() -> None:
    """Reads the arguments and makes the set."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("set", help="any name; the sets of the README are kinds_a, kinds_b, kinds_c")
    parser.add_argument("--out", type=Path, required=True, help="folder that will hold SET/")
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=list(KINDS), help="only these kinds")
    parser.add_argument("--labels", type=Path, help="where the truth goes instead of SET/labels.json")
    arguments = parser.parse_args()
    folder = arguments.out / arguments.set
    folder.mkdir(parents=True, exist_ok=True)
    make_set(folder, arguments.set, arguments.kinds, arguments.labels or folder / "labels.json")


if __name__ == "__main__":
    main()
