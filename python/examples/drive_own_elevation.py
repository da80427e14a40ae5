"""A drive over an elevation array of your own: from heights to a risk map to commands, and a picture of it all.

    python drive_own_elevation.py [picture.png]

The vehicle that drives is a few lines of NumPy below, with a little less grip than the controller believes; what the ground
does to the full-size vehicle is judged by the networks that come with surefoot, fused with its physics prior.
"""

import sys

import matplotlib

matplotlib.use("agg")
import matplotlib.pyplot as plt
import numpy as np
import surefoot
from numpy.typing import NDArray

RESOLUTION_M = 0.25
START_M, GOAL_M = (6.0, 6.0), (44.0, 33.0)
CYCLE_S = 0.1


def hills(n_rows: int = 160, n_cols: int = 200, seed: int = 3) -> NDArray[np.float32]:
    """Rolling ground [m] with a ridge across the straight line, which is steep but for its southern end, and some rocks."""
    rng = np.random.default_rng(seed)
    x_m, y_m = np.meshgrid((np.arange(n_cols) + 0.5) * RESOLUTION_M, (np.arange(n_rows) + 0.5) * RESOLUTION_M)
    height_m = 0.25 * np.sin(x_m / 4.0) * np.cos(y_m / 5.0)
    ridge_m = np.exp(-(((x_m - 25.0) / 2.0) ** 2)) / (1.0 + np.exp(-(y_m - 14.0)))
    height_m += 2.5 * ridge_m
    for _ in range(25):
        rock_m = rng.uniform([2.0, 2.0], [48.0, 38.0])
        if min(np.hypot(*(rock_m - START_M)), np.hypot(*(rock_m - GOAL_M))) > 4.0:
            height_m += 0.6 * np.exp(-(((x_m - rock_m[0]) ** 2 + (y_m - rock_m[1]) ** 2) / 0.5**2))
    return np.asarray(height_m, np.float32)


def drive(
    state: NDArray[np.float64],
    command: tuple[float, float],
    traction: float,
    limits: dict[str, float],
    wheelbase_m: float,
) -> NDArray[np.float64]:
    """The state a cycle later, in steps of a hundredth of a second."""
    x_m, y_m, yaw_rad, speed_mps, steering_rad = state
    step_s = 0.01
    for _ in range(round(CYCLE_S / step_s)):
        change = limits["acceleration_max_mps2"] * step_s
        speed_mps += np.clip(command[0] - speed_mps, -change, change)
        change = limits["steering_rate_max_radps"] * step_s
        steering_rad += np.clip(command[1] - steering_rad, -change, change)
        way_m = traction * speed_mps * step_s
        x_m, y_m = x_m + way_m * np.cos(yaw_rad), y_m + way_m * np.sin(yaw_rad)
        yaw_rad += way_m * np.tan(steering_rad) / wheelbase_m
    return np.array([x_m, y_m, yaw_rad, speed_mps, steering_rad])


def main(picture: str) -> None:
    vehicle = surefoot.Vehicle("pietra_full_size")
    model = vehicle.model()
    settings = surefoot.settings_for(vehicle)
    height_m = hills()
    risk_map = surefoot.Evidential.load(vehicle).judge(surefoot.Surface.from_arrays(height_m, RESOLUTION_M))

    n_rows, n_cols, n_yaws = risk_map.shape
    to_go = surefoot.CostToGo(model, n_rows, n_cols, settings["cost_to_go"])
    to_go.update(risk_map, GOAL_M)
    controller = surefoot.Mppi(model, settings["controller"], seed=1)

    description = model.to_dict()
    state = np.array([*START_M, np.pi / 4, 0.0, 0.0])
    way, futures = [state], []
    while len(way) < 2000:
        decision = controller.decide(state, risk_map, GOAL_M, tolerance_m=0.5, cost_to_go=to_go)
        if decision.reason == "at_goal":
            break
        if len(way) % 80 == 1:
            futures.append(controller.rollouts(risk_map, 60).states)
        # A tenth less than the risk map expects in the worst cases that count.
        traction = 0.9 * risk_map.risk_at(state[:3])[0]
        state = drive(state, decision.command, traction, description["limits"], description["wheelbase_m"])
        way.append(state)
    driven = np.array(way)
    length_m = np.hypot(*np.diff(driven[:, :2], axis=0).T).sum()
    print(f"{decision.reason or decision.kind} after {len(way) * CYCLE_S:.0f} s and {length_m:.1f} m")
    draw(picture, height_m, risk_map, driven, futures)
    assert decision.reason == "at_goal"


def draw(
    picture: str,
    height_m: NDArray[np.float32],
    risk_map: surefoot.RiskMap,
    way: NDArray[np.float64],
    futures: list[NDArray[np.float64]],
) -> None:
    extent = (0.0, height_m.shape[1] * RESOLUTION_M, 0.0, height_m.shape[0] * RESOLUTION_M)
    figure, axes = plt.subplots(1, 2, figsize=(13, 5.2), sharey=True, layout="constrained")
    traction = risk_map.risks[:, :, :, 0].mean(axis=2)
    layers = [(height_m, "gist_earth", "height [m]"), (traction, "magma", "worst expected traction, mean over headings [-]")]
    for axis, (layer, colours, label) in zip(axes, layers):
        image = axis.imshow(layer, origin="lower", extent=extent, cmap=colours)
        figure.colorbar(image, ax=axis, label=label, shrink=0.85)
        for states in futures:
            axis.plot(states[:, :, 0].T, states[:, :, 1].T, color="white", alpha=0.15, linewidth=0.6)
        axis.plot(way[:, 0], way[:, 1], color="deepskyblue", linewidth=2.0, label="driven")
        axis.plot(*START_M, "o", color="deepskyblue")
        axis.plot(*GOAL_M, "*", color="red", markersize=14, label="goal")
        axis.set_xlabel("x, east [m]")
    axes[0].set_ylabel("y, north [m]")
    axes[0].set_title("your ground, the drive, and the cheapest futures every 8 s")
    axes[1].set_title("what the ground does to the vehicle")
    axes[0].legend(loc="lower right")
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    main(*(sys.argv[1:] or ["drive_own_elevation.png"]))
