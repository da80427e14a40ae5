"""Worlds as Gymnasium environments: drive to a goal over ground that tilts, slips and blocks.

`surefoot/RockField-v0`, `surefoot/Arena-v0` and `surefoot/Terrain-v0` are registered with Gymnasium by `import surefoot`;
`gymnasium.make` makes one, `gymnasium.make_vec` many that step on all cores. The vehicle is a plant of rigid bodies on sprung
wheels with brush tyres, seen through simulated sensors; nothing here is the planner's own model. The manual is docs/python.md.
"""

import threading
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from os import PathLike
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surefoot import _native
from surefoot._native import Observations, Simulation, Surface, Task, Vehicle

try:
    import gymnasium
    from gymnasium import spaces
    from gymnasium.utils import seeding
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space
except ImportError as error:
    raise ImportError(
        "surefoot.environments: expected Gymnasium 1.1 or later, found none that can be imported; "
        "install it with: pip install 'surefoot[environments]'"
    ) from error

_Settings: TypeAlias = Mapping[str, Any] | str | PathLike[str]
_Elevation: TypeAlias = NDArray[np.float32] | Surface | str | PathLike[str]
_Observed: TypeAlias = dict[str, NDArray[np.float32]]
_Told: TypeAlias = dict[str, Any]
_Float64: TypeAlias = NDArray[np.float64]
_Flags: TypeAlias = NDArray[np.bool_]

#: How an episode may fail; "goal" is the one way to succeed, "timeout" truncates.
FAILURES = ("rolled_over", "attitude_limit", "collision", "stuck", "out_of_bounds", "in_water")

#: What each metre nearer to the goal, each second, the goal and a failure are worth.
PROGRESS_PER_M, PER_S, AT_GOAL, AT_FAILURE = 1.0, -0.1, 10.0, -10.0

#: Rounding that an action may be beyond its bounds by.
ROUNDING = 1e-6

#: Largest magnitudes of an observation; what is beyond is brought to them.
HEIGHT_MAX_M, DISTANCE_MAX_M = 10.0, 1000.0
STATE_MAX = np.array([50.0, 50.0, 50.0, np.pi, np.pi, np.pi, 50.0], np.float32)


def observation_space(patch: Mapping[str, Any]) -> spaces.Dict:
    """The space of what a vehicle observes: "ground", "state", "goal", each a finite Box of float32."""
    layers_low = np.array([-HEIGHT_MAX_M, 0.0, 0.0, 0.0], np.float32)
    layers_high = np.array([HEIGHT_MAX_M, 1.0, HEIGHT_MAX_M, 1.0], np.float32)
    shape = (4, patch["n_rows"], patch["n_cols"])
    low, high = (np.broadcast_to(bound[:, None, None], shape).copy() for bound in (layers_low, layers_high))
    return spaces.Dict({
        "ground": spaces.Box(low, high, dtype=np.float32),
        "state": spaces.Box(-STATE_MAX, STATE_MAX, dtype=np.float32),
        "goal": spaces.Box(-DISTANCE_MAX_M, DISTANCE_MAX_M, (2,), np.float32),
    })  # fmt: skip


class Course:
    """What an environment drives: a vehicle, tasks, and how they are simulated; shared by one environment and many."""

    world_seed: int | None

    def __init__(self, vehicle: Vehicle | str, ground: str, settings: _Settings | None) -> None:
        self.vehicle = vehicle if isinstance(vehicle, Vehicle) else Vehicle(vehicle)
        self.ground, self.settings = ground, settings
        limits = self.vehicle.to_dict()["limits"]
        self.speeds_mps = np.array([limits["reverse_speed_max_mps"], limits["speed_max_mps"]])
        self.steering_max_rad = limits["steering_max_rad"]
        self._task: Task | None = None
        self._turn = threading.Lock()

    def begin(self, random: np.random.Generator) -> Simulation:
        """A simulation at its start, by a generator of random numbers."""
        world_seed, sensor_seed = (int(seed) for seed in random.integers(2**63, size=2))
        return Simulation(
            self.vehicle, self.task(world_seed), seed=sensor_seed, ground=self.ground, settings=self.settings
        )

    def make_task(self, world_seed: int) -> Task:
        """The task of a seed."""
        raise NotImplementedError

    def task(self, world_seed: int) -> Task:
        """What is to be driven, by the seed of an episode, or always the same where the world was chosen."""
        if self.world_seed is None:
            return self.make_task(world_seed)
        with self._turn:
            if self._task is None:
                self._task = self.make_task(self.world_seed)
            return self._task

    def commands(self, actions: ArrayLike) -> NDArray[np.float32]:
        """Actions from -1 to 1 as float32 (vehicle, 2): speed [m/s], steering angle [rad]."""
        actions = np.asarray(actions)
        if actions.dtype.kind not in "fiu":
            raise TypeError(f"action: expected numbers from -1 to 1, found an array of {actions.dtype}")
        actions = actions.astype(np.float64)
        if not (np.abs(actions) <= 1.0 + ROUNDING).all():
            raise ValueError(f"action: expected numbers from -1 to 1, found {actions.tolist()}")
        reverse_mps, ahead_mps = self.speeds_mps
        speed, steering = np.clip(actions, -1.0, 1.0).T
        speed_mps = np.where(speed < 0.0, speed * reverse_mps, speed * ahead_mps)
        return np.stack([speed_mps, steering * self.steering_max_rad], axis=1).astype(np.float32)

    def actions(self, commands: ArrayLike) -> NDArray[np.float32]:
        """The actions that stand for commands, speed [m/s] and steering angle [rad]: float32 (vehicle, 2)."""
        speed_mps, steering_rad = np.asarray(commands, np.float64).T
        reverse_mps, ahead_mps = np.maximum(self.speeds_mps, 1e-9)
        speed = np.where(speed_mps < 0.0, speed_mps / reverse_mps, speed_mps / ahead_mps)
        steering = steering_rad / self.steering_max_rad
        return np.asarray(np.clip(np.stack([speed, steering], axis=1), -1.0, 1.0), np.float32)


class RockFieldCourse(Course):
    def __init__(
        self, vehicle: Vehicle | str = "pietra_full_size", ground: str = "sensed", settings: _Settings | None = None,
        field: _Settings | None = None, world_seed: int | None = None,
    ) -> None:  # fmt: skip
        super().__init__(vehicle, ground, settings)
        self.field, self.world_seed = field, world_seed

    def make_task(self, world_seed: int) -> Task:
        return Task.rock_field(world_seed, self.field)


class ArenaCourse(Course):
    def __init__(
        self, vehicle: Vehicle | str = "rc_car", ground: str = "sensed", settings: _Settings | None = None,
        hall: _Settings | None = None,
    ) -> None:  # fmt: skip
        super().__init__(vehicle, ground, settings)
        self.hall, self.world_seed = hall, 0

    def make_task(self, world_seed: int) -> Task:
        return Task.arena(self.hall)


class TerrainCourse(Course):
    def __init__(
        self, elevation: _Elevation, vehicle: Vehicle | str = "pietra_full_size", ground: str = "sensed",
        settings: _Settings | None = None, resolution_m: float | None = None, start: Sequence[float] | None = None,
        goal_m: Sequence[float] | None = None, distance_m: float | None = None, world_seed: int | None = None,
    ) -> None:  # fmt: skip
        super().__init__(vehicle, ground, settings)
        self.elevation, self.world_seed = surface_of(elevation, resolution_m), world_seed
        self.ends: dict[str, Any] = {"start": start, "goal_m": goal_m, "distance_m": distance_m}

    def make_task(self, world_seed: int) -> Task:
        return Task.terrain(self.elevation, self.vehicle, **self.ends, seed=world_seed)


def surface_of(elevation: _Elevation, resolution_m: float | None) -> Surface | str | PathLike[str]:
    """Ground as `Task.terrain` takes it: a Surface, a path, or an array of heights with the length of its cells."""
    if not isinstance(elevation, np.ndarray):
        if resolution_m is not None:
            raise ValueError("resolution_m: expected with an array of heights, found with ground that knows its own")
        return elevation
    if resolution_m is None:
        raise ValueError("resolution_m: expected the length of a cell [m] with an array of heights, found None")
    return Surface.from_arrays(elevation, resolution_m)


def observed(observations: Observations, space: Any) -> _Observed:
    """Observations as the space has them, and where each vehicle stands with its task."""
    raw = {"ground": observations.ground, "state": observations.state, "goal": observations.goal}
    return {name: np.clip(values, space[name].low, space[name].high) for name, values in raw.items()}


def judged(before_m: _Float64, observations: Observations, cycle_s: float) -> tuple[_Float64, _Flags, _Flags]:
    """Rewards, terminations, truncations of a step."""
    outcomes = np.array([outcome or "" for outcome in observations.outcomes])
    at_goal, is_failure = outcomes == "goal", np.isin(outcomes, FAILURES)
    rewards = PROGRESS_PER_M * (before_m - observations.distance_m) + PER_S * cycle_s
    rewards = rewards + AT_GOAL * at_goal + AT_FAILURE * is_failure
    return rewards, at_goal | is_failure, outcomes == "timeout"


class DriveEnvironment(gymnasium.Env[dict[str, Any], NDArray[np.float32]]):
    """One vehicle on its way to a goal.

    render_mode: None or "rgb_array", whose frames are at most `frame_px` pixels a side. Unknown keywords raise `TypeError`.
    `simulation` is what is driven: its `surface()`, `state` and `task` are what a planner asks for, `record(path)` writes a
    Foxglove file.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}
    course_type: type[Course]

    def __init__(self, render_mode: str | None = None, frame_px: int = 640, **course: Any) -> None:
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f'render_mode: expected None or "rgb_array", found {render_mode!r}')
        self.render_mode, self.frame_px = render_mode, frame_px
        self.course = self.course_type(**course)
        # What the settings make of a patch is only known of a simulation.
        self.simulation: Simulation | None = None
        self._distance_m = np.zeros(1)
        self.observation_space = observation_space(patch_of(self.course))
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[_Observed, _Told]:
        """A new drive. options: {"record": path} records it."""
        super().reset(seed=seed)
        options = checked(options)
        self.close()
        self.simulation = self.course.begin(self.np_random)
        if options.get("record") is not None:
            self.simulation.record(options["record"])
        observations = _native.step_together([self.simulation])
        self._distance_m = observations.distance_m
        return self._first(observations), self._told(observations, self.simulation)

    def step(self, action: ArrayLike) -> tuple[_Observed, float, bool, bool, _Told]:
        if self.simulation is None:
            raise gymnasium.error.ResetNeeded("step: expected a reset before the first step, found none")
        if np.shape(action) != (2,):
            raise ValueError(f"action: expected shape (2,), found {np.shape(action)}")
        observations = _native.step_together([self.simulation], self.course.commands(np.asarray(action)[None]))
        rewards, terminated, truncated = judged(self._distance_m, observations, self.simulation.cycle_s)
        self._distance_m = observations.distance_m
        step = float(rewards[0]), bool(terminated[0]), bool(truncated[0])
        return self._first(observations), *step, self._told(observations, self.simulation)

    @property
    def task(self) -> Task | None:
        """What is being driven: a `Task`, or None before the first reset."""
        return None if self.simulation is None else self.simulation.task

    def render(self) -> NDArray[np.uint8] | None:
        if self.render_mode is None or self.simulation is None:
            return None
        return self.simulation.frame(self.frame_px)

    def close(self) -> None:
        """Completes the recording, if there is one."""
        if self.simulation is not None:
            self.simulation.finish_recording()

    def _first(self, observations: Observations) -> _Observed:
        return {name: values[0] for name, values in observed(observations, self.observation_space).items()}

    def _told(self, observations: Observations, simulation: Simulation) -> _Told:
        return {
            "outcome": observations.outcomes[0], "distance_m": float(observations.distance_m[0]),
            "time_s": simulation.time_s,
        }  # fmt: skip


def patch_of(course: Course) -> dict[str, Any]:
    """The patch of ground that a course's settings make."""
    patch: dict[str, Any] = Simulation.settings_for(course.vehicle, course.settings)["patch"]
    return patch


def checked(options: dict[str, Any] | None) -> dict[str, Any]:
    """Options of a reset, of which there are few."""
    options = options or {}
    unknown = set(options) - {"record"}
    if unknown:
        raise ValueError(f'options: expected "record" alone, found {sorted(map(repr, unknown))}')
    return options


class DriveVectorEnvironment(VectorEnv[_Observed, NDArray[np.float32], NDArray[Any]]):
    """Many vehicles, each on its own way, stepped together on all cores without Python's lock.

    A drive that has ended begins anew with the next step, whose action is for nothing (`AutoresetMode.NEXT_STEP`).
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10, "autoreset_mode": AutoresetMode.NEXT_STEP}
    course_type: type[Course]

    def __init__(
        self, num_envs: int = 1, render_mode: str | None = None, frame_px: int = 640, **course: Any
    ) -> None:
        if not (isinstance(num_envs, int) and num_envs >= 1):
            raise ValueError(f"num_envs: expected a whole number >= 1, found {num_envs!r}")
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f'render_mode: expected None or "rgb_array", found {render_mode!r}')
        self.num_envs, self.render_mode, self.frame_px = num_envs, render_mode, frame_px
        self.course = self.course_type(**course)
        self.single_observation_space = observation_space(patch_of(self.course))
        self.single_action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.simulations: list[Simulation] = []
        self._random: dict[int, np.random.Generator] = {}
        self._distance_m, self._has_ended = np.zeros(num_envs), np.zeros(num_envs, bool)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[_Observed, _Told]:
        """New drives. seed: one number, from which each vehicle counts on, or one for each."""
        checked(options)
        if options:
            raise ValueError("options: expected none for many vehicles, found some")
        for index, own in enumerate(self._seeds(seed)):
            if own is not None or index not in self._random:
                self._random[index], _ = seeding.np_random(own)
        self._begin(np.ones(self.num_envs, bool))
        observations = _native.step_together(self.simulations)
        self._distance_m, self._has_ended = observations.distance_m, np.zeros(self.num_envs, bool)
        return observed(observations, self.observation_space), self._told(observations)

    def step(self, actions: ArrayLike) -> tuple[_Observed, _Float64, _Flags, _Flags, _Told]:
        if not self.simulations:
            raise gymnasium.error.ResetNeeded("step: expected a reset before the first step, found none")
        if np.shape(actions) != (self.num_envs, 2):
            raise ValueError(f"actions: expected shape {(self.num_envs, 2)}, found {np.shape(actions)}")
        commands, begun = self.course.commands(actions), self._has_ended
        observations = self._advance(commands, begun)
        rewards, terminated, truncated = judged(self._distance_m, observations, self.simulations[0].cycle_s)
        rewards[begun] = 0.0
        self._distance_m, self._has_ended = observations.distance_m, terminated | truncated
        return observed(observations, self.observation_space), rewards, terminated, truncated, self._told(observations)

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        if self.render_mode is None or not self.simulations:
            return None
        return tuple(simulation.frame(self.frame_px) for simulation in self.simulations)

    def _advance(self, commands: NDArray[np.float32], begun: _Flags) -> Observations:
        """Steps those that go on, lets the others begin, and looks at all."""
        if not begun.any():
            return _native.step_together(self.simulations, commands)
        going = np.flatnonzero(~begun)
        if len(going):
            _native.step_together([self.simulations[index] for index in going], commands[going])
        self._begin(begun)
        return _native.step_together(self.simulations)

    def _begin(self, which: _Flags) -> None:
        """New drives for some; worlds are made without Python's lock, so side by side."""
        indices = [index for index in range(self.num_envs) if which[index]]
        if indices:
            with ThreadPoolExecutor() as threads:
                begun = dict(zip(indices, threads.map(self.course.begin, [self._random[index] for index in indices])))
            # The first time all begin.
            self.simulations = [
                begun[index] if index in begun else self.simulations[index] for index in range(self.num_envs)
            ]

    def _seeds(self, seed: int | Sequence[int | None] | None) -> list[int | None]:
        if seed is None or isinstance(seed, (int, np.integer)):
            return [None if seed is None else int(seed) + index for index in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise ValueError(f"seed: expected one number or {self.num_envs}, found {len(seed)}")
        return list(seed)

    def _told(self, observations: Observations) -> _Told:
        everyone = np.ones(self.num_envs, bool)
        outcomes = np.array(observations.outcomes, dtype=object)
        return {
            "outcome": outcomes, "_outcome": everyone.copy(),
            "distance_m": observations.distance_m, "_distance_m": everyone,
        }  # fmt: skip


class RockField(DriveEnvironment):
    """`surefoot/RockField-v0`: 40 m through rocks; see `Task.rock_field` for what `field` may set."""

    course_type = RockFieldCourse


class Arena(DriveEnvironment):
    """`surefoot/Arena-v0`: a hall with bushes and a ramp; see `Task.arena` for what `hall` may set."""

    course_type = ArenaCourse


class Terrain(DriveEnvironment):
    """`surefoot/Terrain-v0`: over your own `elevation`, a path, a `Surface`, or an array with `resolution_m`."""

    course_type = TerrainCourse


class RockFieldVector(DriveVectorEnvironment):
    """Many of `RockField`."""

    course_type = RockFieldCourse


class ArenaVector(DriveVectorEnvironment):
    """Many of `Arena`."""

    course_type = ArenaCourse


class TerrainVector(DriveVectorEnvironment):
    """Many of `Terrain`."""

    course_type = TerrainCourse
