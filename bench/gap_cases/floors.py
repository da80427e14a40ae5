"""How many times the measurements' noise a drive is foretold to that the model was not calibrated on, machine by machine.

    floors.py SET ANSWERS [ANSWERS ...]

SET is a set of cases, ANSWERS the answers that `surefoot gap score` keeps in its output: one column for each, so that a
calibration can be compared to another. The noise is that of the measurement at the end alone, without the start's.
"""

import json
import math
import statistics
import sys
import tomllib
from pathlib import Path

QUANTITIES = {"along": "position", "across": "position", "yaw": "yaw", "forward_speed": "vx", "yaw_rate": "wz"}
SHOWN = {"speed": "forward_speed", "way": "along", "yaw": "yaw"}
LAST_S = 2.0


def noise_of(vehicle: Path) -> dict[str, float]:
    """Standard deviations by what is measured [m], [rad], [m/s], [rad/s]."""
    noise = tomllib.loads(vehicle.read_text())["noise"]
    return noise | {"position": math.hypot(noise["x"], noise["y"]) / math.sqrt(2.0)}


def floors_of(answer: dict, noise: dict[str, float]) -> dict[str, float]:
    """Median over the error's five quantities and horizons, and what is shown at the last, in deviations of the noise."""
    rows = [row for row in answer["errors_by_quantity"] if row["quantity"] in QUANTITIES]
    ratios = {(row["quantity"], row["horizon_s"]): row["floor"] / noise[QUANTITIES[row["quantity"]]] for row in rows}
    shown = {name: ratios[quantity, LAST_S] for name, quantity in SHOWN.items()}
    return {"median": statistics.median(ratios.values())} | shown


def by_vehicle(cases: Path, answers: Path) -> dict[str, dict[str, float]]:
    """Floors of every vehicle of which there is an answer; all answers of one have the same."""
    found = {}
    for path in sorted(answers.glob("*.json")):
        folder = cases / "cases" / path.stem
        vehicle = (folder / tomllib.loads((folder / "case.toml").read_text())["vehicle"]).resolve()
        if vehicle.parent.name not in found:
            found[vehicle.parent.name] = floors_of(json.loads(path.read_text()), noise_of(vehicle))
    return found


def main() -> None:
    """Writes a table in Markdown."""
    columns = [by_vehicle(Path(sys.argv[1]), Path(answers)) for answers in sys.argv[2:]]
    names = ["median", *SHOWN]
    print("| |" + "".join(f" {name} |" for _ in columns for name in names))
    print("|---|" + "---|" * (len(names) * len(columns)))
    for vehicle in sorted(set.intersection(*map(set, columns))):
        print(f"| {vehicle} |" + "".join(f" {column[vehicle][name]:.1f} |" for column in columns for name in names))


if __name__ == "__main__":
    main()
