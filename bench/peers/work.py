"""The work that every peer does, and how it is timed.

One update of MPPI: 1024 rollouts of 50 steps of 0.1 s. At each step the bicycle (PIETRA, equation 2) looks up linear
and angular traction, |roll| and |pitch| of its cell and yaw in a map of 81 x 96 cells x 13 yaws. The objective is time
to goal: step time plus distance until the goal is reached, a penalty for each step over the attitude limits, and the
remaining distance at the end for rollouts that did not arrive. Noise is fresh in every update.
"""

import argparse
import json
import os
import time

import numpy as np

N_ROLLOUTS, N_STEPS, STEP_S = 1024, 50, 0.1
N_COLS, N_ROWS, N_YAWS, RESOLUTION_M = 81, 96, 13, 0.5
WEST_M, SOUTH_M = -N_COLS * RESOLUTION_M / 2, -N_ROWS * RESOLUTION_M / 2
WHEELBASE_M = 2.5
CONTROL_MIN, CONTROL_MAX = [0.0, -0.5], [6.0, 0.5]  # speed [m/s], steering [rad]
NOISE_STD = [1.0, 0.2236]
NOMINAL = [1.0, 0.0]
TEMPERATURE = 1.0
GOAL_M, GOAL_TOLERANCE_M = [12.0, 14.0], 0.5
ATTITUDE_MAX_RAD, ATTITUDE_PENALTY = 0.5236, 100.0
FINAL_SPEED_MPS = 1.0
START = [-10.0, -10.0, 0.78]  # x [m], y [m], yaw [rad]
# What a rollout carries: x, y, yaw, whether it is still on its way, cost so far.
START_STATE = START + [1.0, 0.0]
N_WARM_UP = 20


def risk_map():
    """Random traction from 0.5 to 1 and attitudes from 0 to 0.6 rad, one row of four for each cell and yaw."""
    values = np.random.default_rng(12345).random((N_ROWS * N_COLS * N_YAWS, 4), dtype=np.float32)
    return (values * [0.5, 0.5, 0.6, 0.6] + [0.5, 0.5, 0.0, 0.0]).astype(np.float32)


def arguments(description=__doc__, more=lambda parser: None):
    """Number of threads and updates; the process is held to as many processors as it may use threads."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--updates", type=int, default=200)
    more(parser)
    chosen = parser.parse_args()
    allowed = sorted(os.sched_getaffinity(0))
    if not 1 <= chosen.threads <= len(allowed):
        parser.error(f"--threads: expected 1 to {len(allowed)} on this machine, found {chosen.threads}")
    if chosen.updates < 1:
        parser.error(f"--updates: expected at least 1, found {chosen.updates}")
    os.sched_setaffinity(0, allowed[: chosen.threads])
    return chosen


def report(peer, chosen, update):
    """Times `update`, which returns when its command is a number in memory, and prints the result as JSON."""
    for _ in range(N_WARM_UP):
        update()
    times_ms = []
    for _ in range(chosen.updates):
        start = time.perf_counter()
        command = update()
        times_ms.append((time.perf_counter() - start) * 1e3)
    if not np.all(np.isfinite(command)):
        raise SystemExit(f"{peer}: the last command is {command}")
    ms = {
        "min": min(times_ms),
        "median": float(np.median(times_ms)),
        "p99": float(np.percentile(times_ms, 99)),
    }
    print(json.dumps({"peer": peer, "threads": chosen.threads, "updates": chosen.updates, "ms": ms}))
