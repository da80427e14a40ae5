"""Makes cases whose robot is a simulator with one thing changed, for `surefoot gap diagnose --simulator`.

    python in_simulator_sets.py "python3 examples/python/mujoco_simulator.py" develop --out /tmp/in-simulator/mujoco

The simulator itself drives, asked over its protocol (docs/simulator_protocol.md): as it is for the nominal drives, and
for the real ones with an effect on its commands or sensors, with a knob turned, or with nothing changed. The second
word is a seed. Which of these it was stands in labels.json alone.
"""

import argparse
import json
import math
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter1d

from command_path import TICK_S, CommandPath
from driver import Envelope, rich_driver
from sensors import NOISE, measure
from set_files import seed_of, write_case

DRIVE_S, LEAD_S = 30.0, 3.0
LEAD_TICKS = round(LEAD_S / TICK_S)
CAR = {"name": "car", "wheelbase_m": 2.6, "steering_max_rad": 0.5, "speed_max_mps": 10.0}
ENVELOPE = Envelope(2.6, 0.5, 3.0, 9.0, 5.0, math.inf)
SLOPE_STD, SLOPE_WIDTH_S = 0.05, 1.5
MEASURED = ["x", "y", "yaw", "vx", "wz"]
COLUMNS = ["x", "y", "roll", "pitch", "yaw", "vx", "wz", "cmd_speed", "cmd_steer"]
N_SIMS = 4
JUST_VISIBLE, LARGE = 1.0, 10.0
HORIZONS = [15, 30, 60, 100]
Log = dict[str, np.ndarray]


@dataclass(frozen=True)
class Change:
    """A way to change the robot: a knob, or the key of an effect, from what changes nothing to the farthest."""

    name: str
    key: str
    neutral: float
    far: float
    scale: str = "linear"
    """"linear", "geometric", or "limit", which has no neutral value and comes down to the farthest."""

    def value(self, share: float) -> float:
        """The value a share of the way from neutral to the farthest."""
        if self.scale == "limit":
            return self.far / share
        if self.scale == "geometric":
            return self.neutral * (self.far / self.neutral) ** share
        return self.neutral + share * (self.far - self.neutral)


def effects(generator: np.random.Generator) -> list[Change]:
    """Effects on commands and sensors; what has a sign gets one."""
    sign = {name: float(generator.choice([-1.0, 1.0])) for name in ["bias", "gain", "speed", "odom", "gyro", "yaw"]}
    return [
        Change("steer_delay", "st_delay", 0.0, 0.35),
        Change("steer_lag", "st_lag", 0.0, 0.6),
        Change("steer_rate", "st_rate", math.inf, 0.08, "limit"),
        Change("steer_bias", "st_bias", 0.0, 0.08 * sign["bias"]),
        Change("steer_gain", "st_gain", 1.0, 1.0 + 0.3 * sign["gain"]),
        Change("backlash", "st_backlash", 0.0, 0.06),
        Change("speed_delay", "v_delay", 0.0, 0.7),
        Change("speed_lag", "v_lag", 0.0, 1.5),
        Change("accel_limit", "v_acc", math.inf, 0.3, "limit"),
        Change("speed_scale", "v_scale", 1.0, 1.0 + 0.2 * sign["speed"]),
        Change("pose_latency", "pose_latency", 0.0, 0.3),
        Change("odom_scale", "odom_scale", 1.0, 1.0 + 0.15 * sign["odom"]),
        Change("gyro_bias", "gyro_bias", 0.0, 0.06 * sign["gyro"]),
        Change("yaw_misalign", "yaw_misalign", 0.0, 0.1 * sign["yaw"]),
    ]


def of_knob(knob: dict, generator: np.random.Generator) -> Change:
    """A knob turned nine tenths of the way to one of its ends at most."""
    low, high, default = knob["low"], knob["high"], knob["default"]
    scale = "geometric" if low > 0.0 and high / low >= 4.0 else "linear"
    ends = [end for end in (low, high) if abs(end - default) > 0.05 * (high - low)]
    to_end = Change(knob["name"], knob["name"], default, float(generator.choice(ends)), scale)
    return Change(knob["name"], knob["name"], default, to_end.value(0.9), scale)


class Simulator:
    """A simulator that is asked line by line."""

    def __init__(self, command: str):
        self.process = subprocess.Popen(
            command, shell=True, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        told = self.ask({"type": "hello", "protocol": 1, "vehicle": CAR})
        self.name, self.knobs = told["name"], told["knobs"]

    def ask(self, message: dict) -> dict:
        """The answer to a message."""
        self.process.stdin.write(json.dumps(message) + "\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            raise SystemExit("the simulator has ended")
        answer = json.loads(line)
        if answer["type"] == "error":
            raise SystemExit(f"the simulator said: {answer['message']}")
        return answer

    def close(self) -> None:
        """Ends it."""
        self.process.stdin.close()
        self.process.wait()


@dataclass(frozen=True)
class Course:
    """What is asked of a car in every row of one drive, and the ground that it meets."""

    speed_mps: np.ndarray
    steering_rad: np.ndarray
    slope_ahead: np.ndarray
    slope_left: np.ndarray
    yaw_rad: float
    seed: int

    @staticmethod
    def of(name: str) -> "Course":
        """The course of a name, by a driver who excites everything."""
        seed = seed_of(name)
        generator = np.random.default_rng(seed)
        driver = rich_driver(ENVELOPE, generator, LEAD_S + DRIVE_S)
        n = round((LEAD_S + DRIVE_S) / TICK_S)
        asked = np.array([driver.command(tick, (0.0, 0.0, 0.0), 0.0) for tick in range(n)])
        slopes = [_slopes(generator, n) for _ in range(2)]
        return Course(asked[:, 0].round(3), asked[:, 1].round(4), *slopes, float(generator.uniform(-3, 3)), seed)

    def driven(self, simulator: Simulator, change: Change | None, value: float, noise: int = 0) -> Log:
        """Measured columns of the drive by a robot with one thing changed; `noise` is a seed of the sensors."""
        knobs = {knob["name"]: knob["default"] for knob in simulator.knobs}
        injection: dict[str, float] = {}
        if change:
            (knobs if change.key in knobs else injection)[change.key] = value
        path = CommandPath(injection)
        asked = zip(self.speed_mps, self.steering_rad, strict=True)
        given = [path(row * TICK_S, float(speed), float(steer), 0.0) for row, (speed, steer) in enumerate(asked)]
        start = {"x_m": 0.0, "y_m": 0.0, "yaw_rad": self.yaw_rad, "speed_mps": given[0][0], "yaw_rate_radps": 0.0}
        run = {
            "type": "run", "id": 0, "step_s": TICK_S, "start": start, "seed": 0, "knobs": knobs,
            "command_speed_mps": [speed for speed, _ in given],
            "command_steering_rad": [steer for _, steer in given],
            "slope_ahead": self.slope_ahead.tolist(), "slope_left": self.slope_left.tolist(),
            "terrain_class": [0] * len(given),
        }  # fmt: skip
        return self._logged(simulator.ask(run), injection, noise)

    def _logged(self, motion: dict, injection: dict[str, float], noise: int) -> Log:
        """What the sensors say of a motion, and what was asked for."""
        nothing = np.zeros(len(self.speed_mps))
        truth = {
            "x": np.array(motion["x_m"]), "y": np.array(motion["y_m"]), "z": nothing,
            "roll": np.arctan(self.slope_left), "pitch": -np.arctan(self.slope_ahead),
            "yaw": np.array(motion["yaw_rad"]), "vx": np.array(motion["speed_mps"]), "vy": nothing,
            "wz": np.array(motion["yaw_rate_radps"]),
            "cmd_speed": self.speed_mps, "cmd_steer": self.steering_rad,
        }  # fmt: skip
        return measure(truth, LEAD_TICKS, injection, [self.seed, 2, noise])


def _slopes(generator: np.random.Generator, n: int) -> np.ndarray:
    """Slopes along a way over hills."""
    rough = gaussian_filter1d(generator.standard_normal(n), SLOPE_WIDTH_S / TICK_S)
    return SLOPE_STD * rough / rough.std()


def _seen(log: Log, starts: np.ndarray, horizon: int) -> np.ndarray:
    """Along, across, turn, speed and yaw rate after a horizon, seen from each start."""
    ends = starts + horizon
    yaw = np.unwrap(log["yaw"])
    east, north = log["x"][ends] - log["x"][starts], log["y"][ends] - log["y"][starts]
    sine, cosine = np.sin(yaw[starts]), np.cos(yaw[starts])
    along, across = east * cosine + north * sine, north * cosine - east * sine
    return np.array([along, across, yaw[ends] - yaw[starts], log["vx"][ends], log["wz"][ends]])


def gaps(one: Log, other: Log) -> np.ndarray:
    """Rms gaps of two drives in the 20 numbers."""
    starts = np.arange(0, len(one["x"]) - HORIZONS[-1], 10)
    return np.array([np.sqrt(((_seen(one, starts, h) - _seen(other, starts, h)) ** 2).mean(axis=1)) for h in HORIZONS])


def sized(simulator: Simulator, change: Change, course: Course, aim: float) -> tuple[float, float] | None:
    """The value at which a change is about as visible as aimed at, and how visible it is; None where it is not."""
    nominal = course.driven(simulator, None, 0.0)
    chance = gaps(course.driven(simulator, None, 0.0, 1), nominal)

    def visibility(share: float) -> float:
        """The largest of 20 gaps under the same noise, over that of two drives that differ by noise alone."""
        return float((gaps(course.driven(simulator, change, change.value(share)), nominal) / chance).max())

    share, seen = 1.0, visibility(1.0)
    for _ in range(2):
        share = min(1.0, share * aim / max(seen, 1e-9))
        seen = visibility(share)
    return (float(f"{change.value(share):.3g}"), seen) if seen >= JUST_VISIBLE else None


def write_log(path: Path, log: Log) -> None:
    """A drive log as CSV."""
    time = np.arange(len(log["x"])) * TICK_S
    table = np.column_stack([time, *(log[name] for name in COLUMNS)])
    np.savetxt(path, table, fmt="%.4f", delimiter=",", header=",".join(["t", *COLUMNS]), comments="")


def make_vehicle(folder: Path, simulator: Simulator, seed: str) -> None:
    """Vehicle file and the simulator's own drives."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = ['name = "car"', "wheelbase = 2.6", "max_steer = 0.5", "max_speed = 10.0", "[noise]"]
    lines += [f"{name} = {NOISE[name]}" for name in MEASURED]
    (folder / "vehicle.toml").write_text("\n".join(lines) + "\n")
    for number in range(1, N_SIMS + 1):
        course = Course.of(f"{simulator.name}/{seed}/sim_{number}")
        write_log(folder / f"sim_{number}.csv", course.driven(simulator, None, 0.0))


def make_case(folder: Path, simulator: Simulator, seed: str, change: Change | None, aim: float) -> dict | None:
    """The drives of one case, and its label; None where the change cannot be seen."""
    names = ["real_train_1", "real_train_2", "real_heldout"]
    courses = {name: Course.of(f"{simulator.name}/{seed}/{folder.name}/{name}") for name in names}
    value, seen = 0.0, 0.0
    if change:
        found = sized(simulator, change, courses["real_train_1"], aim)
        if found is None:
            return None
        value, seen = found
    write_case(folder, "car", N_SIMS)
    for name, course in courses.items():
        write_log(folder / f"{name}.csv", course.driven(simulator, change, value))
    label = {"kind": "single" if change else "none", "effects": [change.name] if change else []}
    return label | {"value": value, "neutral": change.neutral if change else 0.0, "visible_in_train": round(seen, 2)}


def changes(simulator: Simulator, n: int, generator: np.random.Generator) -> list[Change]:
    """Knobs and effects in a shuffled order, once each and then again until there are enough to draw from."""
    drawn: list[Change] = []
    while len(drawn) < 2 * n:
        once = effects(generator) + [of_knob(knob, generator) for knob in simulator.knobs]
        drawn += [once[index] for index in generator.permutation(len(once))]
    return drawn


def make_set(folder: Path, simulator: Simulator, seed: str, n_changed: int, n_none: int) -> dict:
    """All cases, changed ones and others in turns; their labels."""
    generator = np.random.default_rng(seed_of(simulator.name, seed))
    make_vehicle(folder / "vehicles" / "car", simulator, seed)
    left = iter(changes(simulator, n_changed, generator))
    are_changed = generator.permutation(np.arange(n_changed + n_none) < n_changed)
    labels = {}
    for number, is_changed in enumerate(are_changed, 1):
        name = f"{simulator.name.replace(' ', '_')}_{seed}_{number:02d}"
        label = None
        while label is None:
            aim = math.exp(generator.uniform(math.log(1.2 * JUST_VISIBLE), math.log(LARGE)))
            change = next(left) if is_changed else None
            label = make_case(folder / "cases" / name, simulator, seed, change, aim)
        labels[name] = label
    return labels


def main() -> None:
    """Reads the arguments and makes the set."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("simulator", help="command of the simulator")
    parser.add_argument("seed", help="a word; each makes another set")
    parser.add_argument("--out", type=Path, required=True, help="folder for the set")
    parser.add_argument("--labels", type=Path, help="where the labels go; else OUT/labels.json")
    parser.add_argument("--changed", type=int, default=20, help="cases with something changed")
    parser.add_argument("--none", type=int, default=17, help="cases with nothing changed")
    arguments = parser.parse_args()
    simulator = Simulator(arguments.simulator)
    labels = make_set(arguments.out, simulator, arguments.seed, arguments.changed, arguments.none)
    simulator.close()
    path = arguments.labels or arguments.out / "labels.json"
    path.write_text(json.dumps(labels, indent=1) + "\n")


if __name__ == "__main__":
    main()
