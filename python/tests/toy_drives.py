"""A simple simulator in Python, and a robot that is the same with one thing changed."""

import numpy as np

STEP_S = 0.02
WHEELBASE_M = 2.0
VEHICLE = {"name": "toy", "wheelbase": WHEELBASE_M, "max_steer": 0.5, "max_speed": 6.0}
NOISE = {"x": 0.01, "y": 0.01, "yaw": 0.002, "vx": 0.01, "wz": 0.004}


def commands(seed, duration_s=20.0):
    """Speed [m/s] and steering [rad] that change every now and then."""
    random = np.random.default_rng(seed)
    n = int(duration_s / STEP_S)
    speed, steering = np.empty(n), np.empty(n)
    row = 0
    while row < n:
        until = row + int(random.uniform(1.0, 3.0) / STEP_S)
        speed[row:until] = random.uniform(1.5, 4.5)
        steering[row:until] = random.uniform(-0.35, 0.35)
        row = until
    return speed, steering


def motion(speed_command, steering_command, start=(0.0, 0.0, 0.0, 2.0), *, delay_s=0.0, steer_gain=1.0):
    """A bicycle whose drive and steering lag: x, y, yaw, speed and yaw rate of every row."""
    late = int(round(delay_s / STEP_S))
    wanted = np.concatenate([np.full(late, steering_command[0]), steering_command])[: len(steering_command)]
    x_m, y_m, yaw_rad, speed_mps = start
    steering_rad = steer_gain * wanted[0]
    rows = np.empty((len(speed_command), 5))
    for row in range(len(speed_command)):
        rate = speed_mps * np.tan(steering_rad) / WHEELBASE_M
        rows[row] = x_m, y_m, yaw_rad, speed_mps, rate
        x_m += STEP_S * speed_mps * np.cos(yaw_rad)
        y_m += STEP_S * speed_mps * np.sin(yaw_rad)
        yaw_rad += STEP_S * rate
        speed_mps += STEP_S / 0.4 * (speed_command[row] - speed_mps)
        steering_rad += STEP_S / 0.1 * (steer_gain * wanted[row] - steering_rad)
    return rows


def drive(seed, **hidden):
    """A drive log as a dict of arrays, as noisy as its sensors."""
    speed, steering = commands(seed)
    rows = motion(speed, steering, **hidden)
    random = np.random.default_rng(1000 + seed)
    x, y, yaw, vx, wz = (rows + random.normal(size=rows.shape) * list(NOISE.values())).T
    t = STEP_S * np.arange(len(speed))
    return {"t": t, "x": x, "y": y, "yaw": yaw, "vx": vx, "wz": wz, "cmd_speed": speed, "cmd_steer": steering}


class Simulator:
    """The simulator itself, to be asked by the diagnosis."""

    name = "toy simulator"
    knobs = [{"name": "gain", "unit": "-", "low": 0.5, "high": 1.5, "default": 1.0}]

    def __call__(self, run):
        start = run["start"]
        began = (start["x_m"], start["y_m"], start["yaw_rad"], start["speed_mps"])
        gain = run["knobs"]["gain"]
        rows = motion(run["command_speed_mps"], run["command_steering_rad"], began, steer_gain=gain)
        names = ["x_m", "y_m", "yaw_rad", "speed_mps", "yaw_rate_radps"]
        return dict(zip(names, rows.T))
