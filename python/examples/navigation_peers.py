"""A planner of your own on the starts and goals of `surefoot bench navigation`: pure pursuit on a costmap.

    surefoot bench navigation --planner "pursuit=python navigation_peers.py" --methods pietra --alpha 0.6 --pairs 1

starts this program and drives it over the channels of a run, in lock-step with the simulation. By itself

    python navigation_peers.py [picture.png] [maps] [pairs]

does that beside surefoot's planner by the physics prior, and leaves the picture. The planner may know what the vehicle
knows: the measured state and the elevation map of the simulated lidar.
"""

import heapq
import math
import os
import pathlib
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Callable

import numpy as np
import surefoot
from numpy.typing import NDArray

State = tuple[float, float, float, float, float]
Point = tuple[float, float]
#: Speed and steering angle.
Command = tuple[float, float]
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

    def __call__(self, state: State, ground: Callable[[], surefoot.Surface], goal_m: Point) -> Command:
        at_m = np.array(state[:2])
        if self.n_cycles % CYCLES == 0:
            self.way_m = self.cheapest(ground(), at_m, np.array(goal_m))
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


def plan() -> None:
    """Commands the vehicle of the run that this was started for, drive after drive."""
    vehicle = surefoot.Vehicle("pietra_full_size")
    pilot, pursuit = surefoot.Pilot(vehicle), Pursuit(vehicle)
    for cycle in pilot:
        if cycle.is_new_drive:
            pursuit = Pursuit(vehicle)
        pilot.command(*pursuit(cycle.state, pilot.surface, cycle.goal_m))


def bench(picture: str = "navigation_peers.png", maps: str = "1", pairs: str = "1") -> None:
    """The benchmark with this planner in it."""
    planner = f"pursuit={shlex.join([sys.executable, os.path.abspath(__file__)])}"
    methods = ["--methods", "physics", "--alpha", "0.6", "--maps", maps, "--pairs", pairs]
    with tempfile.TemporaryDirectory() as out:
        words = ["bench", "navigation", "--planner", planner, *methods, "--out", out]
        subprocess.run([sys.executable, "-P", "-m", "surefoot", *words], check=True)
        pathlib.Path(picture).write_bytes((pathlib.Path(out) / "navigation.png").read_bytes())


if __name__ == "__main__":
    if "SUREFOOT_RUN" in os.environ:
        plan()
    else:
        bench(*sys.argv[1:])
