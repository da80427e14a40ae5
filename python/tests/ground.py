"""Ground and maps that the tests share, and a vehicle whose equations are not the controller's."""

import numpy as np
import surefoot

RESOLUTION_M = 0.2
N_YAWS = 8


def level_risks(n_rows=81, n_cols=121, n_yaws=N_YAWS, traction=0.8):
    """Risks of level ground whose outermost ring is closed."""
    risks = np.zeros((n_rows, n_cols, n_yaws, 4), np.float32)
    risks[1:-1, 1:-1, :, :2] = traction
    return risks


def level_map(**changes):
    """A map of level ground around (0, 0), 24 m from west to east."""
    risks = level_risks(**changes)
    n_rows, n_cols = risks.shape[:2]
    return surefoot.RiskMap.from_arrays(risks, RESOLUTION_M, origin=(-(n_cols // 2), -(n_rows // 2)))


def centres_m(n_rows, n_cols, resolution_m, origin):
    """Centres of cells, x and y, each of shape (row, col)."""
    x_m = (origin[0] + np.arange(n_cols) + 0.5) * resolution_m
    y_m = (origin[1] + np.arange(n_rows) + 0.5) * resolution_m
    return np.meshgrid(x_m, y_m)


class Car:
    """A car whose front axle's middle is followed in steps of a millisecond: the rear axle trails behind it."""

    def __init__(self, model, state, traction):
        description = model.to_dict()
        self.wheelbase_m, self.limits = description["wheelbase_m"], description["limits"]
        self.x_m, self.y_m, self.yaw_rad, self.speed_mps, self.steering_rad = state
        self.traction = traction

    def drive(self, command, duration_s):
        for _ in range(round(duration_s / 1e-3)):
            self.speed_mps += self._change(command[0] - self.speed_mps, self.limits["acceleration_max_mps2"])
            self.steering_rad += self._change(command[1] - self.steering_rad, self.limits["steering_rate_max_radps"])
            front = np.array([self.x_m, self.y_m]) + self.wheelbase_m * self._heading(0.0)
            rear_mps = self.traction * self.speed_mps
            front += 1e-3 * rear_mps / np.cos(self.steering_rad) * self._heading(self.steering_rad)
            rear = np.array([self.x_m, self.y_m]) + 1e-3 * rear_mps * self._heading(0.0)
            self.x_m, self.y_m = rear
            self.yaw_rad = float(np.arctan2(*(front - rear)[::-1]))

    @property
    def state(self):
        return np.array([self.x_m, self.y_m, self.yaw_rad, self.speed_mps, self.steering_rad])

    def _heading(self, steering_rad):
        return np.array([np.cos(self.yaw_rad + steering_rad), np.sin(self.yaw_rad + steering_rad)])

    @staticmethod
    def _change(wanted, rate_max):
        return float(np.clip(wanted, -1e-3 * rate_max, 1e-3 * rate_max))
