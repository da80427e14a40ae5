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
from machine_types import TICK_S, added
from machine_vehicles import Vehicle, vehicle_of
from set_files import seed_of, write_case, write_vehicle

COLUMNS = "t,x,y,z,roll,pitch,yaw,vx,vy,wz,cmd_speed,cmd_steer"
FORMATS = ["%.2f"] + ["%.4f"] * 9 + ["%.3f", "%.4f"]
SIM_HABITS = ["path", "setpoint", "sweep", "human"]


def write_log(path: Path, rows: np.ndarray) -> None:
    """A drive log as CSV."""
    table = np.column_stack([np.arange(len(rows)) * TICK_S, rows])
    np.savetxt(path, table, fmt=FORMATS, delimiter=",", header=COLUMNS, comments="")


def make_vehicle(folder: Path, set_name: str, vehicle: Vehicle) -> None:
    """Map, vehicle file and nominal drives."""
    numbers = {
        "name": vehicle.name,
        "wheelbase": f"{vehicle.length_m:.4f}",
        "max_steer": f"{vehicle.number('max_steer_rad'):.4f}",
        "max_speed": f"{vehicle.number('max_speed_mps'):.3f}",
        "min_speed": f"{vehicle.number('min_speed_mps')}",
    }
    target = write_vehicle(folder / "vehicles" / vehicle.name, numbers, vehicle.noise, vehicle.ground)
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
    target = write_case(folder / "cases" / name, case.vehicle.name, len(SIM_HABITS))
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
