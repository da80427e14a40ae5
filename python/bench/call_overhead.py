"""What a call from Python costs beside the controller's update: medians of many calls, in microseconds.

    python call_overhead.py

A cycle at the goal does everything that a cycle does, reads the arguments, lets go of Python's lock, looks at the map, makes a
decision of the answer, but the update.
"""

import statistics
import time

import numpy as np
import surefoot

N_CALLS = 20_000


def median_us(call):
    times_ns = []
    for _ in range(N_CALLS):
        before_ns = time.perf_counter_ns()
        call()
        times_ns.append(time.perf_counter_ns() - before_ns)
    return statistics.median(times_ns) / 1e3


def main():
    risks = np.zeros((81, 96, 13, 4), np.float32)
    risks[1:-1, 1:-1, :, :2] = 0.8
    risk_map = surefoot.RiskMap.from_arrays(risks, 0.25, origin=(-48, -40))
    controller = surefoot.Mppi(surefoot.Vehicle("pietra_full_size").model())
    state, goal_m = np.zeros(5), np.array([6.0, 0.0])
    empty_us = median_us(lambda: None)
    at_goal_us = median_us(lambda: controller.decide(state, risk_map, state[:2])) - empty_us
    whole_us = median_us(lambda: controller.decide(state, risk_map, goal_m)) - empty_us
    print(f"decide at the goal, everything but the update: {at_goal_us:.1f} us")
    print(f"decide with an update of 1024 x 50: {whole_us:.1f} us")
    print(f"risks of a map: {median_us(lambda: risk_map.risks) - empty_us:.1f} us")


if __name__ == "__main__":
    main()
