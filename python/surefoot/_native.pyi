# Generated from the Rust side by python/stubs/write_stubs.py; do not edit.

from collections.abc import Callable, Iterator, Mapping, Sequence
from os import PathLike
from typing import Any, Final, SupportsFloat, SupportsIndex, TypeAlias, final
from numpy import bool_, float32, float64, uint8
import numpy as np
import pandas as pd
from _typeshed import DataclassInstance
from numpy.typing import NDArray
_Floats: TypeAlias = Sequence[float] | NDArray[np.floating[Any]] | NDArray[np.integer[Any]]
_Float32: TypeAlias = NDArray[np.float32]
_Float64: TypeAlias = NDArray[np.float64]
_Uint8: TypeAlias = NDArray[np.uint8]
_Description: TypeAlias = dict[str, Any] | DataclassInstance
_Settings: TypeAlias = Mapping[str, Any] | DataclassInstance | str | PathLike[str]
_Answer: TypeAlias = NDArray[np.floating[Any]]
_Path: TypeAlias = str | PathLike[str]
_Drive: TypeAlias = pd.DataFrame | Mapping[str, Any] | Recording | _Path

class Defect(RuntimeError):
    """Surefoot broke off where it never should: a defect of its own, whatever it was given."""

@final
class CostToGo:
    """The field of least time to the goal over the known map, which tells the controller what lies beyond its horizon, with
    what a turning circle adds to it from every place and heading.

    CostToGo(model, n_rows, n_cols, settings=None) for risk maps of that many rows and columns. settings: a dict, TOML text or
    a path with what differs from the defaults, as the part "cost_to_go" of `settings_for(vehicle)`.
    """

    def __new__(cls, model: Model | SkidSteerModel | PythonModel, n_rows: SupportsIndex, n_cols: SupportsIndex, settings: _Settings | None=None) -> CostToGo:
        ...

    def __repr__(self) -> str:
        ...

    @property
    def seconds(self) -> NDArray[float32]:
        """Least time from each cell to the goal [s]: float32 (row, col), zero before the first update, a copy."""

    @property
    def turning_s(self) -> NDArray[float32]:
        """What keeping to the turning circle takes beyond that [s]: float32 (heading, row, col), a copy; no heading for a vehicle
        that turns on the spot or before the first update, else 16: to the 8 adjacent cells and to the 8 a knight's move away,
        counter-clockwise from east.
        """

    def update(self, risk_map: RiskMap, goal_m: _Floats, tolerance_m: SupportsFloat | SupportsIndex=0.0) -> None:
        """Solves for the times over the map to the goal, two numbers, x_m, y_m, which may lie beyond it; within the tolerance of
        it the straight line counts. Raises `ValueError` for a map of another shape or a goal that is no place; the field is
        then as it was.
        """

@final
class Cycle:
    """What a vehicle says in one cycle, and where it is to go."""

    def __repr__(self) -> str:
        ...

    @property
    def goal_m(self) -> tuple[float, float]:
        """Where to go, x and y in the map frame [m]."""

    @property
    def imu(self) -> dict[str, Any]:
        """What the inertial unit felt since the last cycle: a dict with "acceleration_mps2" and "angular_rate_radps", float32
        (sample, 3) in the body frame.
        """

    @property
    def is_new_drive(self) -> bool:
        """Whether a drive begins with this cycle, the first one too: what was learned of the ground before is of another place."""

    @property
    def odometry(self) -> dict[str, Any]:
        """All that is measured of the motion: a dict as `Run.odometry` gives it."""

    @property
    def scan(self) -> dict[str, Any] | None:
        """A sweep of the range sensor, where one was finished: a dict with "points", float32 (point, 3) [m] in the body frame,
        and "terrain_class", uint8 (point,).
        """

    @property
    def state(self) -> tuple[float, float, float, float, float]:
        """The measured state as `Mppi.decide` takes it: x_m, y_m, yaw_rad, speed_mps, steering_rad."""

    @property
    def time_s(self) -> float:
        """Simulated time of the drive [s]."""

    @property
    def tolerance_m(self) -> float:
        """How near to the goal counts as there [m]."""

@final
class Dataset:
    """Footprints of a vehicle's drives, with what was measured on them: what networks learn from.

    Made by `Dataset.from_recording`, `Dataset.collect`, and `Dataset.from_bytes` of a file that `surefoot collect` wrote.
    """

    def __len__(self) -> int:
        ...

    def __repr__(self) -> str:
        ...

    @staticmethod
    def collect(vehicle: Vehicle, world: str='testbed', split: str='train', *, n_maps: SupportsIndex=10, n_trials: SupportsIndex=20, time_limit_s: SupportsFloat | SupportsIndex=40.0, seed: SupportsIndex=1) -> Dataset:
        """Of simulated drives over generated ground, with steering that swings from side to side, until the vehicle rolls over,
        is stuck or leaves the map, as `surefoot collect` does it.

        world: "testbed" or "rocks", rock fields, "arena", or "floor", which is level. split: "train", "validation" or "test".
        On all cores; the result does not depend on how many.
        """

    def even(self, unevenness_max_m: SupportsFloat | SupportsIndex) -> Dataset:
        """The examples on ground up to an unevenness [m]: what is to count as familiar."""

    @staticmethod
    def from_bytes(bytes: bytes) -> Dataset:
        """From a file's bytes."""

    @staticmethod
    def from_recording(vehicle: Vehicle, log: str | PathLike[str], ground: Task | Surface | _Path) -> Dataset:
        """Of a drive that was recorded.

        log: the path of a drive log, a recording (.mcap) or CSV, whose poses lie in the frame of the ground. ground: the `Task`
        that was driven, a `Surface`, or the path of an elevation file. Raises `ValueError` where ground is known under less
        than half of the drive, or nothing can be labelled; `OSError` for a file that cannot be read.
        """

    def joined(self, other: Dataset) -> Dataset:
        """The examples of both. Raises `ValueError` for another vehicle."""

    @property
    def measured(self) -> NDArray[float32]:
        """What was measured: float32 (example, 4), linear and angular traction, |roll|, |pitch| [rad]; NaN where it means
        nothing.
        """

    @property
    def poses(self) -> NDArray[float64]:
        """Where: float64 (example, 3), x_m, y_m, yaw_rad."""

    def to_bytes(self) -> bytes:
        """The bytes of a file, which `surefoot train` reads too."""

    @property
    def unevenness_m(self) -> NDArray[float32]:
        """How uneven the ground is [m]: float32 (example,), standard deviation of its height."""

@final
class Decision:
    """What came out of a cycle."""

    def __repr__(self) -> str:
        ...

    @property
    def command(self) -> tuple[float, float]:
        """What the vehicle is to be told: speed [m/s] and steering angle [rad], or yaw rate [rad/s]."""

    @property
    def kind(self) -> str:
        """"drive": follow the command; "hold": stand still for now; "stop": come to a controlled stop."""

    @property
    def reason(self) -> str | None:
        """Why to hold or to stop, as "at_goal" or "no_feasible_rollout"; None to drive."""

@final
class Driver:
    """The driver of a vehicle: tells a run where the vehicle is and what it sees, and says what its actuators are to do.

    Driver(run, vehicle): joins the processes of that name, in whatever order they start, as the one that has the vehicle. A
    channel has one publisher: `RuntimeError` while another process has it. command_age_s: how old the odometry of a command
    may be that is followed, as the run was started with [s]. The last word before the actuators is Surefoot's own watchdog:
    what `carry_out` says is to be done, at once. Times are of `time.monotonic_ns()`.
    """

    def __new__(cls, run: str, vehicle: Vehicle, *, command_age_s: SupportsFloat | SupportsIndex | None=None) -> Driver:
        ...

    def carry_out(self) -> tuple[float, float, str]:
        """What the actuators are to do now: speed [m/s], steering angle [rad], and "drive", "hold" or "stop". A command counts
        as long as what it was decided on; then the vehicle stops, with its wheels as they are. To be asked every cycle.
        """

    @property
    def n_commands(self) -> int:
        """Commands that have come so far."""

    def publish_command(self, speed_mps: SupportsFloat | SupportsIndex, steering_rad: SupportsFloat | SupportsIndex, valid_at_ns: SupportsIndex) -> None:
        """Tells a command of a recorded drive in place of the run's own control process, as whoever knew all of its time."""

    def publish_imu(self, times_ns: NDArray[np.uint64], acceleration_mps2: _Float32, angular_rate_radps: _Float32) -> None:
        """Tells what the inertial unit felt since the last message.

        times_ns: uint64 (sample,). acceleration_mps2, angular_rate_radps: float32 (sample, 3), body frame; (0, 0, +9.81) at
        rest on level ground.
        """

    def publish_mission(self, goal_m: Sequence[float], tolerance_m: SupportsFloat | SupportsIndex, time_s: SupportsFloat | SupportsIndex, *, outcome: SupportsIndex=0) -> None:
        """Says where to go, in place of the run's own mission process: to be repeated once a second. outcome: 0 under way, 1
        goal reached, 6 out of time; see docs/runtime.md.
        """

    def publish_odometry(self, position_m: _Floats, attitude_rad: _Floats, velocity_mps: _Floats, yaw_rate_radps: SupportsFloat | SupportsIndex, *, wheel_speed_mps: SupportsFloat | SupportsIndex | None=None, steering_rad: SupportsFloat | SupportsIndex=0.0, valid_at_ns: SupportsIndex | None=None, applied: tuple[float, float] | None=None) -> None:
        """Tells where the vehicle is, and what its actuators were told last by `carry_out`.

        position_m: rear axle's centre in the map frame, x, y, z. attitude_rad: roll, pitch, yaw. velocity_mps: forward and
        leftward, in the body frame. valid_at_ns: when that was; now, if not given. applied: what another than `carry_out` told
        the actuators, speed [m/s] and steering angle [rad].
        """

    def publish_scan(self, points: _Float32, terrain_class: _Uint8 | None=None, *, sensor: SupportsIndex=0, origin_m: Sequence[float]=..., valid_at_ns: SupportsIndex | None=None) -> None:
        """Tells what the range sensor saw.

        points: float32 (point, 3) [m], in the frame of `sensor`: 0 the vehicle's body, else the robot file's sensor of this
        number. terrain_class: uint8 (point,), 0 open, 1 loose, 2 vegetation, 3 obstacle; all open, if not given. origin_m:
        where the rays start, in the frame of the points.
        """

    @property
    def run(self) -> Run:
        """The same run, to be listened to."""

@final
class ElevationMap:
    """The semantic elevation map: fused from scans and poses, its window follows the vehicle.

    ElevationMap(settings=None): a dict, TOML text or a path with what differs from the defaults, as the part "elevation" of
    `settings_for(vehicle)`.
    """

    def __new__(cls, settings: _Settings | None=None) -> ElevationMap:
        ...

    def __repr__(self) -> str:
        ...

    def fuse(self, points: _Float32, pose: _Floats, *, terrain_class: _Uint8 | None=None, origin_m: Sequence[float]=..., valid_at_ns: SupportsIndex=0) -> FuseReport:
        """Fuses one scan.

        points: float32 (point, 3), forward, left, up in the body frame [m]. pose: six numbers, x_m, y_m, z_m, roll_rad,
        pitch_rad, yaw_rad of the body frame, at the rear axle's centre, in the map frame. terrain_class: uint8 (point,), all
        open where there is none. origin_m: where the rays start in the body frame [m]. valid_at_ns: when it was measured,
        on a clock that only goes on. Points and classes are interleaved, which copies them; points that are no numbers are
        dropped and counted. Raises `ValueError` for a pose or an origin that is no place; the map is then as it was.
        """

    @property
    def settings(self) -> dict[str, Any]:
        """Its settings as a dict."""

    def surface(self) -> Surface:
        """The ground as it is known now, a copy that later scans do not change."""

@final
class Evidential:
    """What driving taught, fused with the physics prior by evidence (PIETRA, equations 9 to 14).

    Made by `Evidential.load`, of the networks that come with surefoot, and by `Evidential.from_bytes`.
    """

    def __repr__(self) -> str:
        ...

    @staticmethod
    def from_bytes(vehicle: Vehicle | SkidSteerVehicle, weights: bytes, sidecar: bytes, settings: _Settings | None=None, *, cvar_level: SupportsFloat | SupportsIndex=0.6, unfamiliar: str='fuse') -> Evidential:
        """Networks of your own: what `surefoot train` wrote as weights.safetensors and weights.json."""

    def judge(self, ground: Surface | ElevationMap, *, centre_m: _Floats | None=None) -> RiskMap:
        """The risk map of the ground, as `PhysicsPrior.judge`. Cells unlike the training data have flag 4."""

    @staticmethod
    def load(vehicle: Vehicle | SkidSteerVehicle, method: str='pietra', settings: _Settings | None=None, *, cvar_level: SupportsFloat | SupportsIndex=0.6, unfamiliar: str='fuse') -> Evidential:
        """The networks that come with surefoot, for a vehicle like the one that they were trained on.

        vehicle: `Vehicle("pietra_full_size")` or one of its wheelbase, track and wheels. method: "pietra", "evora",
        "physics-informed" or "vanilla". unfamiliar: "fuse", ground unlike the training data is driven on as the posterior
        says, or "avoid", it costs a detour as well. settings and cvar_level as for `PhysicsPrior`. Raises `ValueError` for
        another vehicle or method.
        """

    @property
    def method(self) -> str:
        """How the networks were trained."""

@final
class FuseReport:
    """What became of the points of one scan."""

    def __repr__(self) -> str:
        ...

    @property
    def n_mapped(self) -> int:
        """Points that were mapped."""

    @property
    def n_out_of_window(self) -> int:
        """Points dropped because they lie outside the window."""

    @property
    def n_own_body(self) -> int:
        """Points dropped because they lie on the vehicle itself."""

    @property
    def n_points(self) -> int:
        """Points that the scan held."""

    @property
    def n_rejected_non_finite(self) -> int:
        """Points dropped because a coordinate was NaN or infinite."""

@final
class GapReport:
    """What separates a robot from its simulator, as `surefoot gap diagnose` tells it.

    Made by `surefoot.gap.diagnose`. In a notebook it shows itself as a page; `print` tells it in words.
    """

    def __repr__(self) -> str:
        ...

    def __str__(self) -> str:
        ...

    def _repr_html_(self) -> str:
        ...

    @property
    def answer(self) -> dict[str, Any]:
        """The whole answer as a dict: that of `answer.json`, whose layout has the version `schema_version`."""

    @property
    def doubts(self) -> list[str]:
        """What is doubtful about the drives, in sentences."""

    def html(self) -> str:
        """The page as HTML that needs nothing else, with its pictures."""

    @property
    def intervals(self) -> dict[str, dict[str, tuple[float, float, float]]]:
        """Best value and the ends of the 90 % interval of every parameter: {effect: {parameter: (value, low, high)}}, in the
        unit that the parameter's name ends in.
        """

    @property
    def names(self) -> list[str]:
        """Ids of the announced effects, strongest first."""

    def save(self, folder: str | PathLike[str]) -> None:
        """Writes report.html, answer.json, the pictures, and where there are any predictions.csv and manoeuvre.csv into a
        folder, which is made if it is missing.
        """

    @property
    def verdict(self) -> str:
        """The conclusion: "none", "effects", "effects_and_unknown" or "unknown"."""

@final
class GroundReport:
    """Where a belief about the ground and drives part, and what has changed; made by `ground`. In a notebook it shows itself."""

    def __repr__(self) -> str:
        ...

    def __str__(self) -> str:
        ...

    def _repr_html_(self) -> str:
        ...

    @property
    def doubts(self) -> list[str]:
        """What is doubtful about the drives, in sentences."""

    def html(self) -> str:
        """The page as HTML that needs nothing else, with its picture."""

    @property
    def is_unknown(self) -> bool:
        """Whether something has changed that no known cause explains."""

    @property
    def named(self) -> str | None:
        """Id of what has changed since the reference drives; `None` where nothing has, or nothing known explains it."""

    @property
    def numbers(self) -> dict[str, Any]:
        """All numbers as a dict: that of `ground.json`, whose layout has the version `schema_version`."""

    def save(self, folder: str | PathLike[str]) -> None:
        """Writes ground.html, ground.json and ground.png into a folder, which is made if it is missing."""

@final
class Model:
    """The kinematic bicycle with its effects: `wheelbase_m`, `[limits]`, and one `[[effects]]` per effect.

    Model(path): a TOML file. See also `Vehicle.model`, `from_toml` and `from_dict`. A command is a speed [m/s] and a steering
    angle [rad]; a state is (x_m, y_m, yaw_rad, speed_mps, steering_rad) of the rear axle's centre.
    """

    def __eq__(self, other: object, /) -> bool:
        ...

    def __new__(cls, path: str | PathLike[str]) -> Model:
        ...

    def __repr__(self) -> str:
        ...

    @staticmethod
    def from_dict(description: _Description) -> Model:
        """From a dict of what stands in the file, or a dataclass with such fields, of which those that are None count as absent."""

    @staticmethod
    def from_toml(text: str, name: str='model.toml') -> Model:
        """From TOML text; `name` stands where errors name the file."""

    def to_dict(self) -> dict[str, Any]:
        """A dict of what stands in the file."""

@final
class Mppi:
    """Model predictive path integral control over a risk map (Williams et al. 2017).

    Mppi(model, settings=None, *, seed=1, cost=None). model: `Model`, `SkidSteerModel` or `PythonModel`. settings: a dict, TOML
    text or a path with what differs from the defaults, as the part "controller" of `settings_for(vehicle)`. A decision is a
    function of the calls before it, settings and seed, bit for bit, for any number of threads. Threads of Python take turns.
    Raises `ValueError` for a setting out of range, with its name, range and value.

    cost: a function of your own, for trying out, called once per update with all `SampledRollouts`; it returns what they cost
    more [s], float32 or float64 (rollout, step), of which the steps before the goal count, or (rollout,). Infinity is for
    what may not be; NaN, another shape and what the function raises come out of `decide`, whose plan then goes without.
    It must not call a controller.
    """

    def __new__(cls, model: Model | SkidSteerModel | PythonModel, settings: _Settings | None=None, *, seed: SupportsIndex=1, cost: Callable[[SampledRollouts], _Answer] | None=None) -> Mppi:
        ...

    def __repr__(self) -> str:
        ...

    def decide(self, state: _Floats, risk_map: RiskMap, goal_m: _Floats, *, tolerance_m: SupportsFloat | SupportsIndex=0.5, cost_to_go: CostToGo | None=None, elapsed_s: SupportsFloat | SupportsIndex | None=None) -> Decision:
        """Decides what to do now to reach a point.

        state: five numbers, see `state_names`, of the rear axle's centre in the map frame. risk_map: `RiskMap` around the
        vehicle. goal_m: two numbers, x_m, y_m. tolerance_m: distance at which the goal counts as reached. cost_to_go:
        `CostToGo` to this goal, in place of the straight line from the end of the horizon. elapsed_s: time since the last
        decision; None stands for nothing on the first and for a step of the horizon on all others. Numbers that are not
        finite, a map without the vehicle, no feasible future: such a cycle gives a decision to stop with its reason and
        raises nothing.
        """

    @property
    def diagnostics(self) -> dict[str, Any]:
        """What the last decision that sampled tells about itself, as a dict: costs of the cheapest rollout and their means by
        term [s], temperature [s], effective sample size, free energy [s], feasible rollouts and so on.
        """

    def follow(self, state: _Floats, risk_map: RiskMap, points_m: _Float64, speed_mps: SupportsFloat | SupportsIndex, *, tolerance_m: SupportsFloat | SupportsIndex=0.5, elapsed_s: SupportsFloat | SupportsIndex | None=None) -> Decision:
        """Decides what to do now to follow a line at a speed.

        points_m: float64 (point, 2), x_m, y_m of at least two corners. tolerance_m: distance from the last of them at which the
        end counts as reached. All else as `decide`.
        """

    def note_sent(self, command: _Floats, after_s: SupportsFloat | SupportsIndex=0.0) -> None:
        """What the vehicle was really told, two numbers as `Decision.command`, from `after_s` after the last decision on,
        where that is something else. Numbers that are not finite are no command and change nothing.
        """

    @property
    def plan(self) -> NDArray[float32]:
        """The commands of the plan: float32 (step, 2), the one just decided first."""

    def reset(self) -> None:
        """Forgets plan, history and progress, and counts its decisions from zero."""

    def rollouts(self, risk_map: RiskMap, n: SupportsIndex | None=None) -> Rollouts:
        """The cheapest futures that the last decision sampled, cheapest first.

        n: how many, all without it. They are computed again over the map, so that only who asks pays for them. Raises
        `RuntimeError` before the first decision that sampled.
        """

    @property
    def settings(self) -> dict[str, Any]:
        """Its settings as a dict."""

    @property
    def state_names(self) -> tuple[str, str, str, str, str]:
        """What the numbers of a state are; the last two name those of a command."""

    def trajectory(self, risk_map: RiskMap) -> NDArray[float64]:
        """Where the plan leads over the map: float64 (step + 1, 5), the predicted start first."""

@final
class Observations:
    """What many simulations measured, one row for each."""

    @property
    def distance_m(self) -> NDArray[float64]:
        """Float64 (simulation,): true distance to the goal [m]."""

    @property
    def goal(self) -> NDArray[float32]:
        """Float32 (simulation, 2): the goal from the vehicle, forward_m, left_m."""

    @property
    def ground(self) -> NDArray[float32]:
        """Float32 (simulation, layer, row, col), `Simulation.LAYER_NAMES`: the ground around the vehicle, turned with it; rows go
        forward, columns left. Heights are above the mean under the wheels, zero where nothing is known.
        """

    @property
    def outcomes(self) -> list[str | None]:
        """How each drive ended, None while it goes on."""

    @property
    def state(self) -> NDArray[float32]:
        """Float32 (simulation, 7): what is measured of the motion, `Simulation.STATE_NAMES`."""

@final
class PhysicsPrior:
    """The physics prior: what shape and cover of the ground do to a vehicle before anything was learned (PIETRA, equations 15
    to 18).

    PhysicsPrior(vehicle, settings=None, *, cvar_level=0.6). settings: a dict, TOML text or a path with what differs from
    those that fit the vehicle, as `settings_for(vehicle)`, of which "prior", "risk_map" and the instruction set of
    "controller" count. cvar_level: share of the worst outcomes that counts, in (0, 1].
    """

    def __new__(cls, vehicle: Vehicle | SkidSteerVehicle, settings: _Settings | None=None, *, cvar_level: SupportsFloat | SupportsIndex=0.6) -> PhysicsPrior:
        ...

    def __repr__(self) -> str:
        ...

    def judge(self, ground: Surface | ElevationMap, *, centre_m: _Floats | None=None) -> RiskMap:
        """The risk map of the ground.

        ground: `Surface` or `ElevationMap`. centre_m: two numbers, x_m, y_m, around which the window of
        `settings["risk_map"]` lies; without them the map covers all of the ground. Maps are made from scratch, on all cores
        and without Python's lock. Raises `ValueError` where cells of map and ground cannot line up.
        """

@final
class Pilot:
    """A planner's place in a run: it hears a vehicle cycle by cycle and commands it.

    Pilot(vehicle, run=None): joins the processes of that name, without one those that `SUREFOOT_RUN` names, as it does where
    `surefoot bench navigation --planner` has started the planner. Iterating over it gives a `Cycle` whenever the vehicle has
    measured while its mission says to drive, and ends when everybody else has left the run. A drive in lock-step goes on
    with `command`. Raises `RuntimeError` while another process commands the vehicle.
    """

    def __iter__(self) -> Pilot:
        ...

    def __new__(cls, vehicle: Vehicle, run: str | None=None) -> Pilot:
        ...

    def __next__(self) -> Cycle:
        ...

    def __repr__(self) -> str:
        ...

    def command(self, speed_mps: SupportsFloat | SupportsIndex, steering_rad: SupportsFloat | SupportsIndex) -> None:
        """Commands a speed [m/s], negative in reverse, and an angle of the front wheels [rad], left positive, decided on the
        last cycle. A benchmark goes on by the first command of a cycle. Raises `ValueError` for what is no number.
        """

    def surface(self) -> Surface:
        """The ground as the scans of this drive have shown it, fused as `surefoot drive` does it: a copy."""

@final
class PythonModel:
    """A motion model of your own, for trying out: limits and command of a `Model`, steps of a function in Python.

    PythonModel(model, step). model: `Model`, whose limits bound what is sampled; its wheelbase tells how tightly it turns,
    its effects count for nothing. step(states, commands, traction, step_s) returns the states a step later, float64 (n, 5);
    states is float64 (n, 5), see `Mppi.state_names`, commands float64 (n, 2), traction float64 (n, 2), linear and angular.
    A decision calls it once for every step of the horizon with all rollouts, and now and then with one vehicle; it has to
    treat each by itself. It is tens of times as slow as a model in Rust.
    """

    def __new__(cls, model: Model, step: Callable[[_Float64, _Float64, _Float64, float], _Answer]) -> PythonModel:
        ...

    def __repr__(self) -> str:
        ...

@final
class RecordedMessages:
    """An iterator over maps or sweeps of a recording: pairs of `time_ns` and what was recorded. It ends where the recording
    breaks off.
    """

    def __iter__(self) -> RecordedMessages:
        ...

    def __next__(self) -> tuple[int, Any]:
        ...

@final
class Recording:
    """A recording of a drive, made by `surefoot drive` or `surefoot up`.

    Made by `surefoot.open`. The file is read through once for what is in it, and again by every method, message by message,
    so that no more of it is in memory than what is asked for. One that breaks off, because the recorder was killed or the
    disk was full, gives what is whole; `ended_early` says where. Tables are `pandas.DataFrame`s where pandas is installed
    (`pip install surefoot[frames]`), else dicts of arrays; `time_ns` is when a row was recorded, on the clock of the drive.
    """

    def __repr__(self) -> str:
        ...

    def commands(self) -> pd.DataFrame:
        """What the vehicle was told: `time_ns`, `t`, and the columns of the drive log that begin with cmd_."""

    def controller(self) -> pd.DataFrame:
        """Figures of the controller in each cycle, of recordings of `surefoot drive`."""

    def decisions(self) -> pd.DataFrame:
        """What was decided in each cycle: `decision` is drive, hold or stop, `reason` says why it is not drive."""

    def drive_log(self) -> pd.DataFrame:
        """The drive log: `time_ns`, `t` [s], `run`, and what was measured and commanded, x, y, yaw, vx, wz, cmd_speed,
        cmd_steer and so on, in metres, radians and seconds; NaN where nothing was measured.

        Raises `ValueError` where the recording has none.
        """

    @property
    def duration_s(self) -> float:
        """Time between the first and the last message [s]."""

    def elevation_maps(self) -> RecordedMessages:
        """The maps of the ground, one after the other: an iterator over pairs of `time_ns` and a `Surface`. The likeliest class
        of each cell is recorded, as if it were certain.
        """

    @property
    def ended_early(self) -> str | None:
        """Where and why the recording breaks off; `None` of one that is whole."""

    def odometry(self) -> pd.DataFrame:
        """Where the vehicle was and how it moved, under the names of the drive log: every message of the odometry where these
        were recorded (`surefoot up`), else the rows of the drive log.
        """

    def risk_maps(self) -> RecordedMessages:
        """The risk maps at the heading of the vehicle, one after the other: an iterator over pairs of `time_ns` and a dict with
        "risks", float32 (row, col, 4) as in a `RiskMap`, "terrain_class" and "flags", uint8 (row, col), "resolution_m" [m]
        and "origin", the lattice index (col, row) of the south-west cell.
        """

    def scans(self) -> RecordedMessages:
        """The sweeps of the range sensor in the body frame, one after the other: an iterator over pairs of `time_ns` and a dict
        with "points", float32 (point, 3) [m], and "terrain_class", uint8 (point,).
        """

    @property
    def setup(self) -> dict[str, Any] | None:
        """What is needed to repeat the run, as a dict; `None` where it was not recorded."""

    def table(self, topic: str) -> pd.DataFrame:
        """The messages of any topic of numbers: those in JSON, and those under /channel/, of which there is one row for each
        record (of scans and maps the headers). Names are those of the fields.

        Raises `ValueError` for a topic that is not there or holds something else.
        """

    @property
    def topics(self) -> dict[str, int]:
        """Number of messages of every topic."""

@final
class RiskMap:
    """The worst expected traversability of every cell and heading, and the ground under it: what the controller drives on.

    Made by `RiskMap.from_arrays`, and by `PhysicsPrior.judge` and `Evidential.judge`. Rows count north, columns east, yaw
    bin k is centred at (k + 1/2) 2 pi / n_yaws. The outermost ring of cells is closed: its risks are zero, nothing moves
    there.
    """
    BLOCKED_RAD: Final[float]
    '\n    Whether a risk is that of a pose that touches an obstacle: from this |roll| on [rad].\n    '

    def __repr__(self) -> str:
        ...

    @property
    def flags(self) -> NDArray[uint8]:
        """The sum of 1 obstacle, 2 unknown, 4 out of distribution: uint8 (row, col), a copy."""

    @staticmethod
    def from_arrays(risks: _Float32, resolution_m: SupportsFloat | SupportsIndex, *, origin: tuple[SupportsIndex, SupportsIndex]=..., gradient: _Float32 | None=None, terrain_class: _Uint8 | None=None, flags: _Uint8 | None=None) -> RiskMap:
        """A risk map of your own.

        risks: float32 (row, col, yaw, 4): linear and angular traction, achieved over commanded, from 0 to 1, and the worst
        |roll| and |pitch| [rad]. resolution_m: edge of a cell [m]. origin: lattice index (col, row) of the south-west cell,
        whose south-west corner lies at origin * resolution_m. gradient: float32 (row, col, 2), height change per metre east
        and north. terrain_class: uint8 (row, col), 0 open, 1 loose, 2 vegetation, 3 obstacle. flags: uint8 (row, col), the
        sum of 1 obstacle, 2 unknown, 4 out of distribution.

        The map reads risks where they lie if they lie row by row without gaps and their outermost ring is zero; else it
        reads a copy, in which that ring is zero. Values are checked here and not again: who writes to the array later
        changes the map, and may do so between calls. Raises `TypeError` for another type of number, `ValueError` for
        another shape, and for values out of range with their place.
        """

    @property
    def gradient(self) -> NDArray[float32]:
        """Height change per metre east and north: float32 (row, col, 2), a copy."""

    @property
    def origin(self) -> tuple[int, int]:
        """Lattice index (col, row) of the south-west cell."""

    @property
    def resolution_m(self) -> float:
        """Edge of a cell [m]."""

    def risk_at(self, pose: _Floats) -> tuple[float, float, float, float]:
        """The risk of a pose: linear traction, angular traction, |roll|, |pitch|; all zero beyond the map."""

    @property
    def risks(self) -> NDArray[float32]:
        """The risks that the map reads, float32 (row, col, yaw, 4), to be read: the same memory, no copy."""

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of rows, columns and yaws."""

    @property
    def terrain_class(self) -> NDArray[uint8]:
        """What covers the ground: uint8 (row, col), 0 open, 1 loose, 2 vegetation, 3 obstacle, a copy."""

@final
class Rollouts:
    """Sampled futures, the cheapest first."""

    @property
    def costs_s(self) -> NDArray[float32]:
        """Float32 (rollout,): what each costs [s]."""

    @property
    def states(self) -> NDArray[float64]:
        """Float64 (rollout, step + 1, 5), the start first; see `Mppi.state_names`."""

    @property
    def weights(self) -> NDArray[float32]:
        """Float32 (rollout,): the share of each in the average; those of all rollouts sum to one."""

@final
class Run:
    """A run of `surefoot up` that is under way, to be listened to and directed; any number of processes may.

    Made by `surefoot.attach`. What reads gives the newest message that came since the last call, as a pair of when it was
    true on the machine's monotonic clock (`time.monotonic_ns()`) and what it says, or `None`; the first call begins to
    listen. Messages of another layout, out of order, from the future or with numbers that cannot be are not given, as
    nowhere in Surefoot. Orders return what the vehicle is told to do from then on, as a dict, and raise `RuntimeError` with
    the reason where they are refused or nobody answers within five seconds.
    """

    def __repr__(self) -> str:
        ...

    def alpha(self, level: SupportsFloat | SupportsIndex) -> dict[str, Any]:
        """Plan for this share of the worst outcomes, in (0, 1]."""

    def cancel(self) -> dict[str, Any]:
        """Stand; the mission is over."""

    def command(self) -> tuple[int, dict[str, Any]] | None:
        """What the vehicle shall do: a dict with "decision" (drive, hold or stop), "speed_mps" and "steering_rad", which count
        only when driving, and "odometry_at_ns" and "scan_at_ns", of when that was which it was decided on.
        """

    def elevation_map(self) -> tuple[int, Surface] | None:
        """The map of the ground, a `Surface`."""

    def estop(self) -> dict[str, Any]:
        """Stop, until reset."""

    def goal(self, goals: Sequence[tuple[float, float]], *, tolerance_m: SupportsFloat | SupportsIndex | None=None) -> dict[str, Any]:
        """Drive to these places, one after the other: goals is a list of (x, y) in the map frame [m]. tolerance_m: how near
        counts as there; without it as the run was started.
        """

    def manual(self) -> dict[str, Any]:
        """An operator takes the wheel."""

    def mission(self) -> tuple[int, dict[str, Any]] | None:
        """What the vehicle is told to do: a dict with "goal_m", "tolerance_m", "state" (0 drive, 1 no mission, 2 paused, 3
        manual, 4 emergency stop), "outcome" (0 under way, 1 goal reached, see docs/runtime.md), "time_s", "leg", "n_legs",
        "alpha" and "told", all that in words.
        """

    @property
    def name(self) -> str:
        """Name of the run."""

    def odometry(self) -> tuple[int, dict[str, Any]] | None:
        """Where the vehicle is: a dict with "position_m" (x, y, z), "attitude_rad" (roll, pitch, yaw), "velocity_mps" (forward,
        leftward), "yaw_rate_radps", "wheel_speed_mps", "steering_rad", and what the actuators were told last,
        "applied_speed_mps", "applied_steering_rad".
        """

    def path(self, corners: Sequence[tuple[float, float]], speed_mps: SupportsFloat | SupportsIndex, *, tolerance_m: SupportsFloat | SupportsIndex | None=None) -> dict[str, Any]:
        """Drive along these corners [m] at a speed [m/s]."""

    def pause(self) -> dict[str, Any]:
        """Stand until told to go on."""

    def reset(self) -> dict[str, Any]:
        """The emergency is over; what was under way is paused."""

    def resume(self) -> dict[str, Any]:
        """Go on; also when an operator gives the wheel back."""

    def risk_map(self) -> tuple[int, RiskMap] | None:
        """The risk map, a `RiskMap`, and the same by way of a copy: that of what was learned, or where learning says nothing, of
        physics alone.
        """

    def scan(self) -> tuple[int, dict[str, Any]] | None:
        """A sweep of the range sensor: a dict with "points", float32 (point, 3) [m], "terrain_class", uint8 (point,), and
        "sensor", whose frame the points are of: 0 the vehicle's body, else the sensor of this number.
        """

@final
class SampledRollouts:
    """What a cost written in Python is called with: every step of all rollouts that were sampled."""

    @property
    def commands(self) -> NDArray[float32]:
        """Float32 (rollout, step, 2): what is asked for, see `Decision.command`."""

    @property
    def is_under_way(self) -> NDArray[bool_]:
        """Bool (rollout, step): whether the goal was not reached before the step."""

    @property
    def rates(self) -> NDArray[float32]:
        """Float32 (rollout, step, 2): speed before the ground takes its share [m/s], yaw rate after [rad/s]."""

    @property
    def risks(self) -> NDArray[float32]:
        """Float32 (rollout, step, 4): the risk where the step begins, as `RiskMap.risks`."""

    @property
    def states(self) -> NDArray[float64]:
        """Float64 (rollout, step + 1, 5), the start first; see `Mppi.state_names`. Single precision within the map."""

@final
class Simulation:
    """A vehicle in a world: rigid bodies on sprung wheels with brush tyres, a servo that lags, and sensors that lie a little.

    Simulation(vehicle, task, *, seed=1, ground="sensed", settings=None). ground: "sensed", fused into an elevation map from
    simulated range scans as `surefoot drive` does it, or "true", the world itself, which is cheaper. settings: a dict, TOML
    text or a path with what differs: control_hz, cycles_per_scan, "rules" (time_limit_s, immobile_m, immobile_s and so on),
    "odometry", and "patch" (n_rows, n_cols, spacing_m, rear_m: rows ahead, columns to the left). What happens is a function
    of vehicle, task, seed, settings and commands, bit for bit, for any number of threads. Threads of Python take turns.
    Raises `ValueError` for a setting out of range and for a start where the vehicle cannot be put.
    """
    LAYER_NAMES: Final[list[str]]
    '\n    What the layers of "ground" in an observation are.\n    '
    STATE_NAMES: Final[list[str]]
    '\n    What the numbers of "state" in an observation are.\n    '

    def __new__(cls, vehicle: Vehicle, task: Task, *, seed: SupportsIndex=1, ground: str='sensed', settings: _Settings | None=None) -> Simulation:
        ...

    def __repr__(self) -> str:
        ...

    @property
    def cycle_s(self) -> float:
        """Length of a step [s]."""

    def finish_recording(self) -> None:
        """Completes the recording; does nothing where there is none."""

    def frame(self, side_px: SupportsIndex=640) -> NDArray[uint8]:
        """The way so far on its ground as a picture: uint8 (row, col, 3), red, green, blue, row 0 in the north. All pictures
        of a task have the same size; neither side exceeds side_px, which is from 64 to 2048.
        """

    @property
    def outcome(self) -> str | None:
        """How the drive ended, as "goal", "rolled_over", "attitude_limit", "collision", "stuck", "out_of_bounds", "in_water",
        "timeout" or "stopped"; None while it goes on.
        """

    @property
    def poses(self) -> NDArray[float64]:
        """True poses so far, the last one now: float64 (pose, 6), x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad."""

    def record(self, path: str | PathLike[str]) -> None:
        """Records from now on into a Foxglove file (.mcap), as `surefoot drive` does: pose, command, decision, drive log, scans,
        elevation map, path and goal. A recording under way is finished first. `surefoot.Dataset.from_recording` reads it.
        Raises `OSError` where it cannot be written.
        """

    @property
    def settings(self) -> dict[str, Any]:
        """Its settings as a dict."""

    @staticmethod
    def settings_for(vehicle: Vehicle, settings: _Settings | None=None) -> dict[str, Any]:
        """The settings that a simulation of a vehicle would have, with what differs: a dict."""

    @property
    def state(self) -> tuple[float, float, float, float, float]:
        """The measured state as `Mppi.decide` takes it: x_m, y_m, yaw_rad, speed_mps, steering_rad."""

    def surface(self) -> Surface:
        """The ground as it is known now, a copy."""

    @property
    def task(self) -> Task:
        """What is being driven."""

    @property
    def time_s(self) -> float:
        """Time since the start [s]."""

@final
class SkidSteerModel:
    """The skid-steered unicycle: `[limits]`, `speed_lag_s`, `yaw_rate_lag_s` and `turning_point_ahead_m`.

    Made by `SkidSteerVehicle.model`, `from_toml` and `from_dict`. A command is a speed [m/s] and a yaw rate [rad/s]; a
    state is (x_m, y_m, yaw_rad, speed_mps, yaw_rate_radps) of the rear axle's centre.
    """

    def __eq__(self, other: object, /) -> bool:
        ...

    def __repr__(self) -> str:
        ...

    @staticmethod
    def from_dict(description: _Description) -> SkidSteerModel:
        """From a dict of what stands in the file, or a dataclass with such fields, of which those that are None count as absent."""

    @staticmethod
    def from_toml(text: str, name: str='model.toml') -> SkidSteerModel:
        """From TOML text; `name` stands where errors name the file."""

    def to_dict(self) -> dict[str, Any]:
        """A dict of what stands in the file."""

@final
class SkidSteerVehicle:
    """A skid-steered vehicle: `name`, `[geometry]`, and in `[model]` what its drives can do.

    SkidSteerVehicle(source): "warthog" or the path of a TOML file. Otherwise as `Vehicle`.
    """

    def __eq__(self, other: object, /) -> bool:
        ...

    def __new__(cls, name_or_path: str) -> SkidSteerVehicle:
        ...

    def __repr__(self) -> str:
        ...

    @staticmethod
    def from_dict(description: _Description) -> SkidSteerVehicle:
        """From a dict of what stands in the file, or a dataclass with such fields, of which those that are None count as absent."""

    @staticmethod
    def from_toml(text: str, name: str='vehicle.toml') -> SkidSteerVehicle:
        """From TOML text; `name` stands where errors name the file."""

    def model(self) -> SkidSteerModel:
        """What a controller believes of it."""

    @property
    def name(self) -> str:
        """What it is called, for reports."""

    def to_dict(self) -> dict[str, Any]:
        """A dict of what stands in the file."""

@final
class Surface:
    """The ground of a map: heights, variances, plants, classes, and what is unknown.

    Made by `Surface.from_arrays` and `ElevationMap.surface`. Arrays have shape (row, col): row 0 is the south, column 0 the
    west. Every property is an array of its own, copied out of the cells.
    """

    def __repr__(self) -> str:
        ...

    @property
    def class_probability(self) -> NDArray[float32]:
        """Probability of each class: float32 (row, col, class)."""

    @staticmethod
    def from_arrays(height_m: _Float32, resolution_m: SupportsFloat | SupportsIndex, *, origin: tuple[SupportsIndex, SupportsIndex]=..., terrain_class: _Uint8 | None=None, vegetation_height_m: _Float32 | None=None, height_variance_m2: _Float32 | None=None, class_probability: _Float32 | None=None, knowledge: _Uint8 | None=None) -> Surface:
        """Ground of your own.

        height_m: float32 (row, col), NaN where nothing is known. resolution_m: edge of a cell [m]. origin: lattice index
        (col, row) of the south-west cell, whose south-west corner lies at origin * resolution_m. terrain_class: uint8
        (row, col), 0 open, 1 loose, 2 vegetation, 3 obstacle; or class_probability: float32 (row, col, class), which sums to
        one where the ground is known. vegetation_height_m: float32 (row, col), height of soft plants above the ground [m].
        height_variance_m2: float32 (row, col). knowledge: uint8 (row, col), 1 where a height was filled in between measured
        ones, else 2, and 0 where nothing is known. Cells are interleaved, so each array is copied. Raises `TypeError` for another type of number, `ValueError` for another shape and for values that no ground has.
        """

    @property
    def height_m(self) -> NDArray[float32]:
        """Height of the ground itself, below plants [m]: float32 (row, col), NaN where unknown."""

    @property
    def height_variance_m2(self) -> NDArray[float32]:
        """Variance of the height [m2]: float32 (row, col), infinite where unknown."""

    @property
    def knowledge(self) -> NDArray[uint8]:
        """How the height came to be known: uint8 (row, col), 0 unknown, 1 interpolated, 2 measured."""

    @property
    def origin(self) -> tuple[int, int]:
        """Lattice index (col, row) of the south-west cell."""

    @property
    def resolution_m(self) -> float:
        """Edge of a cell [m]."""

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and columns."""

    @property
    def terrain_class(self) -> NDArray[uint8]:
        """Likeliest class: uint8 (row, col), 0 open, 1 loose, 2 vegetation, 3 obstacle."""

    @property
    def vegetation_height_m(self) -> NDArray[float32]:
        """Height of soft plants above the ground [m]: float32 (row, col)."""

@final
class Task:
    """A drive to be done: a world, a start, a goal.

    Made by `Task.rock_field`, `Task.navigation`, `Task.arena` and `Task.terrain`. The same arguments give the same world, bit
    for bit. A task can be driven any number of times, by any number of simulations at once, which share its world.
    """

    def __repr__(self) -> str:
        ...

    @staticmethod
    def arena(settings: _Settings | None=None) -> Task:
        """A hall of 9.6 x 8 m with bushes and a ramp, for a car of 33 cm.

        settings: bush_height_m, ramp_height_m, ramp_slope_length_m. Raises `ValueError` for a setting out of range.
        """

    @property
    def bounds_m(self) -> tuple[float, float, float, float]:
        """What must not be left: west, south, east, north [m]."""

    @property
    def goal_m(self) -> tuple[float, float]:
        """Where the rear axle's centre is to come: x_m, y_m."""

    @property
    def height_m(self) -> NDArray[float32]:
        """The true height of the ground [m]: float32 (row, col), a copy."""

    @property
    def name(self) -> str:
        """What the world is called."""

    @staticmethod
    def navigation(map: SupportsIndex, pair: SupportsIndex, *, seed: SupportsIndex=1, settings: _Settings | None=None) -> Task:
        """A drive of `surefoot bench navigation`: 40 m between two cleared pads of a map.

        map and pair, from 0, and the seed of the maps, as the benchmark counts them; settings as of `rock_field`, for what
        differs from the benchmark's field. Raises `ValueError` for a setting out of range, or that leaves no room for 40 m.
        """

    @property
    def resolution_m(self) -> float:
        """Edge of a cell of the world [m]; its south-west corner is that of `bounds_m`."""

    @staticmethod
    def rock_field(seed: SupportsIndex, settings: _Settings | None=None) -> Task:
        """40 m through a rock field that belongs to the seed.

        settings: a dict, TOML text or a path with what differs from the default field: side_m, resolution_m, rolling_std_m,
        test_height_scale, and for "small", "medium", "boulders" and "ridges" density_per_m2, height_m, height_to_radius,
        elongation and gap_m. Raises `ValueError` for a setting out of range.
        """

    @property
    def start(self) -> tuple[float, float, float]:
        """Rear axle's centre and heading at the start: x_m, y_m, yaw_rad."""

    @staticmethod
    def terrain(ground: Surface | _Path, vehicle: Vehicle, *, start: _Floats | None=None, goal_m: _Floats | None=None, distance_m: SupportsFloat | SupportsIndex | None=None, seed: SupportsIndex=1) -> Task:
        """A drive over ground of your own.

        ground: a `Surface`, of which the heights count and lie where they lie in the map frame, or the path of an elevation
        file (.npz, GeoTIFF, 16-bit PNG), whose south-west corner is the origin. vehicle: `Vehicle` that has to get there.
        start: (x_m, y_m, yaw_rad); goal_m: (x_m, y_m); what is left open is picked by the seed, distance_m apart, where the
        vehicle can stand and a way is between. Raises `ValueError` for ground without such a pair, `OSError` for a file that
        cannot be read.
        """

    @property
    def tolerance_m(self) -> float:
        """How near the goal counts as there [m]."""

@final
class Training:
    """What a training came to."""

    @property
    def curves(self) -> list[dict[str, Any]]:
        """One dict for each pass over the data: phase, epoch, training_loss, validation_error, is_best."""

    @property
    def sidecar(self) -> bytes:
        """What belongs to them; as weights.json."""

    @property
    def validation_emd2(self) -> list[float]:
        """EMD2 on the validation data of linear and angular traction, |roll| and |pitch|."""

    @property
    def weights(self) -> bytes:
        """The networks, for `Evidential.from_bytes`; as weights.safetensors of `surefoot train`."""

@final
class Vehicle:
    """A vehicle with four wheels that steers the front ones, as a file `vehicle.toml` describes it.

    Vehicle(source): the name of one that ships with surefoot (`Vehicle.SHIPPED`) or the path of a TOML file, as a string
    on the command line. See also `from_toml` and `from_dict`. Lengths in metres, angles in radians, masses in kilograms.
    Raises `FileNotFoundError`, and `ValueError` with file, line and field for what no vehicle can have.
    """
    SHIPPED: Final[list[str]]
    '\n    Names of the vehicles that ship with surefoot.\n    '

    def __eq__(self, other: object, /) -> bool:
        ...

    def __new__(cls, name_or_path: str) -> Vehicle:
        ...

    def __repr__(self) -> str:
        ...

    @staticmethod
    def from_dict(description: _Description) -> Vehicle:
        """From a dict of what stands in the file, or a dataclass with such fields, of which those that are None count as absent."""

    @staticmethod
    def from_toml(text: str, name: str='vehicle.toml') -> Vehicle:
        """From TOML text; `name` stands where errors name the file."""

    def model(self) -> Model:
        """What a controller believes of it unless told otherwise: wheelbase and limits, no effects."""

    @property
    def name(self) -> str:
        """What it is called, for reports."""

    def to_dict(self) -> dict[str, Any]:
        """A dict of what stands in the file."""

def apply(diagnosis: GapReport | dict[str, Any] | _Path, model: Model | Vehicle, *, force: bool=False) -> Model:
    """A controller's model with what a diagnosis measured for it: what was calibrated, and what was announced as it fits there.

    diagnosis: a `GapReport`, its answer as a dict, or the path of an answer.json. model: a `Model` or a `Vehicle`. force:
    whether to apply what is named where a part of the gap stays unknown, for which it may stand. Returns a `Model`; raises
    `ValueError` for an answer that names no effect, or none that a model can hold.
    """

def attach(run: str | None=None) -> Run:
    """A run that is under way.

    run: its name; without one there must be a single run. Raises `ValueError` for a name that none can have, `RuntimeError`
    where there is no such run.
    """

def diagnose(sim: Sequence[_Drive], real: Sequence[_Drive], vehicle: Vehicle | _Path | _Description, *, heldout: Sequence[_Drive] | None=None, columns: dict[str, str] | None=None, simulator: Callable[[dict[str, Any]], Mapping[str, Any]] | None=None, model: Model | Vehicle | None=None, estimate: Sequence[str]=..., name: str | None=None) -> GapReport:
    """Says why simulator and robot disagree: where, which effect, how far the gap shrinks, and what to drive next.

    sim, real, heldout: lists of drives, each a data frame or a dict of arrays with the columns of a drive log (`t` [s] and a
    command, `cmd_speed` [m/s] and `cmd_steer` [rad] or `steer_meas`, or `cmd_wz` [rad/s] of a skid-steered machine; used
    where they are there: x, y [m], yaw [rad], vx, vy [m/s], wz [rad/s], roll, pitch, and `run`, in which `t` begins anew), a
    `Recording`, or the path of a CSV file or a recording. sim holds drives of the simulator, at least two of them, or none,
    and then a bare bicycle stands for it; heldout are used for nothing but to verify the answer. vehicle: a `Vehicle`, the
    name of one that ships, the path of a vehicle's file, or a dict or a dataclass of it ("name", "wheelbase" [m], and where known
    "max_steer" [rad], "max_speed" [m/s], "noise"). columns: a dict from our names to yours, {"vx": "wheel_speed"}.
    simulator: a callable that drives commands as your simulator does and so decides; see docs/python.md. model: a `Model` or
    a `Vehicle`, the controller's model to begin with, else the one that the simulator's drives calibrate; what is announced
    is fitted beside its effects for `apply`, and does not depend on it. estimate: "time_offset" and "lever_arm" of the robot's
    pose sensor are estimated from its drives first and taken out of them. name: for the report.

    Returns a `GapReport`. Takes from seconds to minutes; Ctrl-C ends it. Raises `ValueError` for drives that would be
    misread, with what gave them away, and what the callable raises.
    """

def ground(drives: Sequence[_Path], vehicle: Vehicle, *, reference: Sequence[_Path]=..., evidential: Evidential | None=None) -> GroundReport:
    """Holds what was foretold of the ground against what recorded drives met on it.

    drives, reference: lists of paths of recordings (.mcap) that hold maps, as `surefoot drive` and `Simulation.record` write
    them; those of reference are of a time when all was right, and what has changed since is named. vehicle: the `Vehicle`
    that drove. evidential: the networks that judge the ground; without, physics alone does. Returns a `GroundReport`. Raises
    `ValueError` for what is no drive or has no maps.
    """

def manoeuvre(report: GapReport) -> pd.DataFrame | None:
    """The drive that would tell apart what a diagnosis leaves open: a table with t [s], cmd_speed [m/s] and cmd_steer [rad],
    50 Hz, for level ground; `None` where no drive would help.
    """

def note_fork() -> None:
    """Says that this process was just forked from another; Python calls it."""

def open(path: str | PathLike[str]) -> Recording:
    """Opens a recording (MCAP).

    Raises `FileNotFoundError` and other `OSError`s, and `ValueError` where not one message can be read.
    """

def run_command_line(start: Sequence[str], words: Sequence[str], file: str | PathLike[str]) -> int:
    """Runs the command line; returns the exit code.

    start: what starts it again for its own processes, the interpreter and the words before the command's own. words: the
    command's own. file: which file holds it.
    """

def settings_for(vehicle: Vehicle | SkidSteerVehicle, changes: _Settings | None=None) -> dict[str, Any]:
    """The settings of the whole pipeline that fit a vehicle, with what `changes` says in place of theirs.

    vehicle: `Vehicle` or `SkidSteerVehicle`. changes: a dict, TOML text or a path, of which only what differs need stand
    there. Returns a dict whose parts the other classes take: "elevation", "risk_map", "prior", "cost_to_go",
    "controller" and so on; what it cannot hold raises `ValueError`.
    """

def step_together(simulations: Sequence[Simulation], commands: _Float32 | None=None) -> Observations:
    """Steps simulations for one control cycle each, on all cores, and tells what they measure then.

    simulations: a sequence of `Simulation`, of the same patch. commands: float32 (simulation, 2), speed [m/s] and steering
    angle [rad], each limited by what its vehicle can do; None to look without stepping. A drive that has ended stays as it
    is. Raises `ValueError` for commands that are not finite; no simulation has moved then.
    """

def train(dataset: Dataset, validation: Dataset, method: str='pietra', settings: _Settings | None=None, *, progress: Callable[[dict[str, Any]], object] | None=None) -> Training:
    """Fits networks to a dataset; the same data and settings give the same networks, bit for bit.

    dataset, validation: `Dataset`, of drives of their own. method: "pietra", "evora", "physics-informed" or "vanilla". settings:
    a dict, TOML text or a path with what differs: seed, epochs_max, patience, batch, learning_rate, encoder_hidden and so
    on. progress: a function that is called with the dict of every pass; what it raises ends the training and comes out.
    Works on one thread. Raises `ValueError` for data that nothing can be learned from and for settings out of range.
    """
