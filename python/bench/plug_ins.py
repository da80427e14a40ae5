"""What a cost and a model written in Python cost beside the controller's own, on this machine: least times of an update [ms].

    python plug_ins.py
"""

import time

import numpy as np
import surefoot

STATE, GOAL_M = np.array([0.0, 0.0, 0.3, 1.0, 0.0]), (9.0, 2.0)
MODEL = surefoot.Vehicle("pietra_full_size").model()
WHEELBASE_M = MODEL.to_dict()["wheelbase_m"]


def level_map():
    risks = np.zeros((81, 96, 13, 4), np.float32)
    risks[1:-1, 1:-1, :, :2] = 0.8
    return surefoot.RiskMap.from_arrays(risks, 0.25, origin=(-48, -40))


def lateral(rollouts):
    """A price for lateral acceleration."""
    speed_mps, yaw_rate_radps = np.moveaxis(rollouts.rates, 2, 0)
    return np.where(np.abs(speed_mps * yaw_rate_radps) > 3.0, 0.7, 0.0)


def bicycle(states, commands, traction, step_s):
    """The kinematic bicycle, whose actuators follow at once."""
    _, _, yaw_rad, _, _ = states.T
    speed_mps, steering_rad = commands.T
    way_m = speed_mps * step_s
    after = states.copy()
    after[:, 0] += traction[:, 0] * way_m * np.cos(yaw_rad)
    after[:, 1] += traction[:, 0] * way_m * np.sin(yaw_rad)
    after[:, 2] += traction[:, 1] * way_m * np.tan(steering_rad) / WHEELBASE_M
    after[:, 3:] = commands
    return after


def least_ms(controller, risk_map, n):
    times_s = []
    for _ in range(n):
        before_s = time.perf_counter()
        controller.decide(STATE, risk_map, GOAL_M)
        times_s.append(time.perf_counter() - before_s)
    return 1e3 * min(times_s)


def main():
    risk_map = level_map()
    own_ms = least_ms(surefoot.Mppi(MODEL), risk_map, 50)
    rows = [
        ("nothing of Python's", surefoot.Mppi(MODEL), 50),
        ("a cost", surefoot.Mppi(MODEL, cost=lateral), 30),
        ("a model", surefoot.Mppi(surefoot.PythonModel(MODEL, bicycle)), 4),
    ]
    for name, controller, n in rows:
        update_ms = least_ms(controller, risk_map, n)
        print(f"{name:24}{update_ms:10.2f} ms{update_ms / own_ms:10.1f}")


if __name__ == "__main__":
    main()
