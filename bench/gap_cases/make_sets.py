"""Makes a set of sim-to-real cases: python make_sets.py SET --out FOLDER."""

import argparse
import json
from pathlib import Path

import numpy as np

from command_path import TICK_S
from drive import MAX_STEER_RAD, DriveFailed, simulate
from ground import Ground
from plan import SETS, Case, cases_of
from sensors import NOISE
from set_files import seed_of, write_case, write_vehicle
from vehicles import VEHICLES

COLUMNS = ["x", "y", "z", "roll", "pitch", "yaw", "vx", "vy", "wz", "cmd_speed", "cmd_steer"]
FORMATS = ["%.2f"] + ["%.3f"] * 3 + ["%.4f"] * 3 + ["%.3f", "%.3f", "%.4f", "%.3f", "%.4f"]
SIM_STYLES = ["rich", "rich", "rich", "track"]
ATTEMPTS = 12


def write_log(path: Path, columns: dict[str, np.ndarray]) -> None:
    """A drive log as CSV."""
    time = np.arange(len(columns["x"])) * TICK_S
    table = np.column_stack([time, *(columns[name] for name in COLUMNS)])
    np.savetxt(path, table, fmt=FORMATS, delimiter=",", header=",".join(["t", *COLUMNS]), comments="")


def surviving_drive(vehicle, ground: Ground, injection: dict, style: str, name: list[str], harder: float) -> dict:
    """The first drive that the vehicle survives, of a row of seeds that depends on the name alone."""
    for attempt in range(ATTEMPTS):
        try:
            return simulate(vehicle, ground, injection, style, [seed_of(*name), attempt], harder)
        except DriveFailed as failure:
            print(f"  {'/'.join(name)} attempt {attempt}: {failure}", flush=True)
    raise SystemExit(f"{'/'.join(name)}: no drive survived with {injection}")


def make_vehicle(folder: Path, name: str) -> None:
    """Map, vehicle file and nominal drives."""
    vehicle, ground = VEHICLES[name], ground_of(name)
    numbers = {
        "name": vehicle.name,
        "wheelbase": f"{vehicle.wheelbase_m:.4f}",
        "max_steer": f"{MAX_STEER_RAD}",
        "max_speed": f"{vehicle.speeds_mps[1]}",
        "min_speed": f"{vehicle.speeds_mps[0]}",
    }
    target = write_vehicle(folder / "vehicles" / name, numbers, NOISE, ground)
    for number, style in enumerate(SIM_STYLES, 1):
        drive = surviving_drive(vehicle, ground, {}, style, [name, f"sim_{number}"], 1.0)
        write_log(target / f"sim_{number}.csv", drive)


def ground_of(vehicle: str) -> Ground:
    """The map of a vehicle, the same in all sets."""
    return Ground(VEHICLES[vehicle].shape, seed_of(vehicle, "ground"))


def make_case(folder: Path, set_name: str, name: str, case: Case) -> None:
    """Case file and the three drives with the effect."""
    target = write_case(folder / "cases" / name, case.vehicle, len(SIM_STYLES))
    vehicle, ground = VEHICLES[case.vehicle], ground_of(case.vehicle)
    styles = {"real_train_1": case.style, "real_train_2": case.style, "real_heldout": case.heldout_style}
    for drive, style in styles.items():
        seed_name = [set_name, name, drive]
        columns = surviving_drive(vehicle, ground, case.injection, style, seed_name, case.harder())
        write_log(target / f"{drive}.csv", columns)


def main() -> None:
    """Reads the arguments and makes the set; labels.json grows with the cases."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("set", choices=SETS)
    parser.add_argument("--out", type=Path, required=True, help="folder that will hold SET/")
    parser.add_argument("--limit", type=int, help="make only the first cases")
    arguments = parser.parse_args()
    folder = arguments.out / arguments.set
    for vehicle in SETS[arguments.set].vehicles:
        make_vehicle(folder, vehicle)
    labels = {}
    for number, case in enumerate(cases_of(arguments.set)[: arguments.limit], 1):
        name = f"{arguments.set}_{number:03d}"
        make_case(folder, arguments.set, name, case)
        labels[name] = case.label()
        (folder / "labels.json").write_text(json.dumps(labels, indent=1) + "\n")
        print(name, case.vehicle, case.kind, case.effects, case.magnitude, case.injection, flush=True)


if __name__ == "__main__":
    main()
