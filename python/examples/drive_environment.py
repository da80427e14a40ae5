"""Three drivers in the same world: one that knows nothing, one that aims at the goal, and surefoot's own planner.

    python drive_environment.py [picture.png] [random|pursuit|planner]

The world is the hall with bushes and a ramp; the drivers see what its simulated sensors see. Without a choice each drives once.
"""

import sys
from typing import Protocol

import gymnasium
import matplotlib

matplotlib.use("agg")
import matplotlib.pyplot as plt
import numpy as np
import surefoot
from numpy.typing import NDArray
from surefoot.environments import DriveEnvironment

Observation = dict[str, NDArray[np.float32]]
Action = NDArray[np.float32]


class Driver(Protocol):
    def __init__(self, environment: DriveEnvironment) -> None: ...

    def act(self, observation: Observation) -> Action: ...


class Random:
    """Picks any action and keeps it for a second."""

    def __init__(self, environment: DriveEnvironment) -> None:
        self.actions, self.n_steps = environment.action_space, 0
        self.actions.seed(1)

    def act(self, observation: Observation) -> Action:
        if self.n_steps % 10 == 0:
            self.action = self.actions.sample()
        self.n_steps += 1
        return self.action


class Pursuit:
    """Turns on the circle that leads to the goal, at half speed: pure pursuit, blind to the ground."""

    def __init__(self, environment: DriveEnvironment) -> None:
        description = environment.course.vehicle.to_dict()
        self.wheelbase_m = description["geometry"]["wheelbase_m"]
        self.steering_max_rad = description["limits"]["steering_max_rad"]

    def act(self, observation: Observation) -> Action:
        ahead_m, left_m = observation["goal"]
        steering_rad = np.arctan2(2.0 * self.wheelbase_m * left_m, ahead_m**2 + left_m**2)
        return np.asarray(np.clip([0.5, steering_rad / self.steering_max_rad], -1.0, 1.0), np.float32)


class Planner:
    """Surefoot's own: elevation map, physics prior, cost to go and a thousand futures every cycle."""

    def __init__(self, environment: DriveEnvironment) -> None:
        self.environment = environment
        self.planner, self.n_steps = surefoot.Planner(self.environment.course.vehicle), 0

    def act(self, observation: Observation) -> Action:
        simulation = self.environment.simulation
        assert simulation is not None, "the environment was reset"
        task = simulation.task
        # A scan comes every other cycle; in between the map stays as it is.
        ground = simulation.surface() if self.n_steps % 2 == 0 else None
        self.n_steps += 1
        decision = self.planner.decide(simulation.state, ground, task.goal_m, tolerance_m=0.5 * task.tolerance_m)
        action: Action = self.environment.course.actions([decision.command])[0]
        return action


DRIVERS: dict[str, type[Driver]] = {"random": Random, "pursuit": Pursuit, "planner": Planner}


def drive(name: str) -> tuple[str, NDArray[np.uint8]]:
    """One episode: how it ended, and its picture."""
    environment = gymnasium.make("surefoot/Arena-v0", render_mode="rgb_array", hall={"bush_height_m": 0.3},
                                 settings={"rules": {"time_limit_s": 30.0}})  # fmt: skip
    observation, info = environment.reset(seed=1)
    plain = environment.unwrapped
    assert isinstance(plain, DriveEnvironment)
    driver, reward_sum, is_over = DRIVERS[name](plain), 0.0, False
    while not is_over:
        observation, reward, terminated, truncated, info = environment.step(driver.act(observation))
        reward_sum, is_over = reward_sum + float(reward), terminated or truncated
    print(f"{name}: {info['outcome']} after {info['time_s']:.1f} s, {info['distance_m']:.1f} m from the goal, "
          f"return {reward_sum:.1f}")  # fmt: skip
    picture = plain.render()
    assert picture is not None
    return info["outcome"], picture


def main(picture: str = "drive_environment.png", *names: str) -> None:
    names = names or tuple(DRIVERS)
    figure, axes = plt.subplots(1, len(names), figsize=(5.2 * len(names), 4.6), squeeze=False, layout="constrained")
    for axis, name in zip(axes[0], names):
        outcome, image = drive(name)
        axis.imshow(image)
        axis.set_title(f"{name}: {outcome}")
        axis.set_axis_off()
    figure.savefig(picture, dpi=100)


if __name__ == "__main__":
    main(*sys.argv[1:])
