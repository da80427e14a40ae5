"""Planners of your own on the starts and goals of `surefoot bench navigation`, beside surefoot's.

    python navigation_peers.py [picture.png] [maps] [pairs]

Every planner drives the same pairs in lock-step with the simulation, however long it thinks; its time is counted apart. What it
may know is what the vehicle knows: the measured state and the elevation map of the simulated lidar.
"""

import heapq
import itertools
import math
import sys
import time
from collections.abc import Callable, Iterator

import matplotlib

matplotlib.use("agg")
import matplotlib.pyplot as plt
import numpy as np
import surefoot
from numpy.typing import NDArray

State = tuple[float, float, float, float, float]
Point = tuple[float, float]
#: Speed and steering angle.
Command = tuple[float, float]
#: What a planner makes of state, ground and goal.
Planner = Callable[[State, surefoot.Surface, Point], Command]
#: Cells of the costmap have so many of the elevation map along their edge.
COARSE = 2
#: Cost of a metre that nobody has seen, beside 1 on level ground.
UNKNOWN = 3.0
#: The costmap is searched anew every so many cycles.
CYCLES = 5


class Pursuit:
    """Pure pursuit along the cheapest way over a costmap of slopes: what a robot without a model of its futures does."""

    def __init__(self, vehicle: surefoot.Vehicle) -> None:
        description = vehicle.to_dict()
        geometry, limits = description["geometry"], description["limits"]
        self.wheelbase_m, self.half_m = geometry["wheelbase_m"], 0.5 * geometry["width_m"]
        self.speed_mps, self.steering_max_rad = limits["speed_max_mps"], limits["steering_max_rad"]
        self.step_max_m = geometry["ground_clearance_m"]
        self.n_cycles, self.way_m = 0, np.zeros((0, 2))

    def __call__(self, state: State, ground: surefoot.Surface, goal_m: Point) -> Command:
        at_m = np.array(state[:2])
        if self.n_cycles % CYCLES == 0:
            self.way_m = self.cheapest(ground, at_m, np.array(goal_m))
        self.n_cycles += 1
        away_m = np.hypot(*(self.way_m - at_m).T)
        ahead = np.flatnonzero((away_m > 3.0) & (np.arange(len(away_m)) > np.argmin(away_m)))
        target_m = self.way_m[ahead[0] if len(ahead) else -1] - at_m
        aside = math.sin(math.atan2(target_m[1], target_m[0]) - state[2])
        steering_rad = math.atan2(2.0 * self.wheelbase_m * aside, float(np.hypot(*target_m)))
        return self.speed_mps, max(-self.steering_max_rad, min(self.steering_max_rad, steering_rad))

    def costs(self, ground: surefoot.Surface) -> NDArray[np.float64]:
        """Cost of a metre on each coarse cell: rises with what the heights under the vehicle differ by."""
        height_m = ground.height_m
        rows, cols = (length // COARSE * COARSE for length in height_m.shape)
        blocks = height_m[:rows, :cols].reshape(rows // COARSE, COARSE, cols // COARSE, COARSE)
        known = np.isfinite(blocks)
        high, low = np.where(known, blocks, -np.inf).max((1, 3)), np.where(known, blocks, np.inf).min((1, 3))
        reach = math.ceil(self.half_m / (COARSE * ground.resolution_m))
        step_m = np.maximum(spread(high, reach) + spread(-low, reach), 0.0)
        costs = np.where(step_m > self.step_max_m, 100.0, 1.0 + 10.0 * step_m / self.step_max_m)
        return np.asarray(np.where(known.any((1, 3)), costs, UNKNOWN))

    def cheapest(self, ground: surefoot.Surface, at_m: NDArray[np.float64], goal_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Places along the cheapest way to the goal, or to the place of the map that is nearest to it."""
        costs, cell_m = self.costs(ground), COARSE * ground.resolution_m
        corner_m = np.array(ground.origin) * ground.resolution_m
        start, goal = (tuple(np.clip((place_m - corner_m)[::-1] // cell_m, 0, np.array(costs.shape) - 1).astype(int))
                       for place_m in (at_m, goal_m))  # fmt: skip
        places_m = corner_m + (np.array(dijkstra(costs, start, goal))[:, ::-1] + 0.5) * cell_m
        return np.vstack([places_m, goal_m])


def spread(values: NDArray[np.float64], reach: int) -> NDArray[np.float64]:
    """The largest value of the square around each cell."""
    padded = np.pad(values, reach, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, (2 * reach + 1, 2 * reach + 1))
    return np.asarray(windows.max((2, 3)))


def dijkstra(costs: NDArray[np.float64], start: tuple[int, int], goal: tuple[int, int]) -> list[tuple[int, int]]:
    """Cells of the cheapest way, over eight neighbours."""
    least, before, heap = {start: 0.0}, {start: start}, [(0.0, start)]
    while heap:
        spent, cell = heapq.heappop(heap)
        if cell == goal:
            break
        if spent > least[cell]:
            continue
        for row, col in ((-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (-1, 1), (1, -1), (1, 1)):
            near = (cell[0] + row, cell[1] + col)
            if not (0 <= near[0] < costs.shape[0] and 0 <= near[1] < costs.shape[1]):
                continue
            there = spent + math.hypot(row, col) * 0.5 * float(costs[cell] + costs[near])
            if there < least.get(near, math.inf):
                least[near], before[near] = there, cell
                heapq.heappush(heap, (there, near))
    cells = [goal]
    while cells[-1] != start:
        cells.append(before[cells[-1]])
    return cells[::-1]


def ours(vehicle: surefoot.Vehicle) -> Planner:
    """Surefoot's planner by the physics prior."""
    planner, cycles = surefoot.Planner(vehicle), itertools.count()

    def command(state: State, ground: surefoot.Surface, goal_m: Point) -> Command:
        # A scan comes every other cycle; in between the map stays as it is.
        return planner.decide(state, ground if next(cycles) % 2 == 0 else None, goal_m).command

    return command


PLANNERS: dict[str, Callable[[surefoot.Vehicle], Planner]] = {"pursuit on a costmap": Pursuit, "surefoot": ours}


def drive(name: str, vehicle: surefoot.Vehicle, task: surefoot.Task, seed: int) -> tuple[surefoot.Simulation, float]:
    """A drive to its end, and the mean time that the planner took for a cycle [ms]."""
    simulation = surefoot.Simulation(vehicle, task, seed=seed)
    planner, thought_s, n_cycles = PLANNERS[name](vehicle), 0.0, 0
    while simulation.outcome is None:
        began_s = time.perf_counter()
        command = planner(simulation.state, simulation.surface(), task.goal_m)
        thought_s, n_cycles = thought_s + time.perf_counter() - began_s, n_cycles + 1
        surefoot.step_together([simulation], np.array([command], np.float32))
    return simulation, 1e3 * thought_s / max(n_cycles, 1)


def wilson(n_goal: int, n: int) -> tuple[float, float]:
    """Interval of 95 % of a share (Wilson 1927)."""
    z2 = 1.96**2
    middle, half = n_goal + z2 / 2, 1.96 * math.sqrt(n_goal * (n - n_goal) / n + z2 / 4)
    return (middle - half) / (n + z2), (middle + half) / (n + z2)


def pairs(n_maps: int, n_pairs: int) -> Iterator[tuple[int, int]]:
    return ((map_index, pair) for map_index in range(n_maps) for pair in range(n_pairs))


def main(picture: str = "navigation_peers.png", maps: str = "1", pairs_of_a_map: str = "1") -> None:
    vehicle, drives = surefoot.Vehicle("pietra_full_size"), list(pairs(int(maps), int(pairs_of_a_map)))
    figure, axes = plt.subplots(1, len(PLANNERS), figsize=(5.2 * len(PLANNERS), 5.4), layout="constrained")
    for axis, name in zip(axes, PLANNERS):
        outcomes, milliseconds = [], []
        for map_index, pair in drives:
            task = surefoot.Task.navigation(map_index, pair)
            simulation, cycle_ms = drive(name, vehicle, task, seed=1000 * map_index + pair)
            outcomes.append(simulation.outcome)
            milliseconds.append(cycle_ms)
            print(f"{name}, map {map_index + 1}, pair {pair + 1}: {simulation.outcome} after {simulation.time_s:.1f} s")
            if (map_index, pair) == drives[0]:
                axis.imshow(simulation.frame(512))
                axis.set_title(f"{name}: {simulation.outcome}, {simulation.time_s:.0f} s")
                axis.set_axis_off()
        n_goal, n = outcomes.count("goal"), len(outcomes)
        low, high = wilson(n_goal, n)
        print(f"{name}: {n_goal} of {n} at the goal [{low:.0%} to {high:.0%}], "
              f"{np.mean(milliseconds):.1f} ms a cycle")  # fmt: skip
    figure.savefig(picture, dpi=100)


if __name__ == "__main__":
    main(*sys.argv[1:])
