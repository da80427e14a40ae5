"""pytorch-mppi's controller on surefoot's own map of risks, in `surefoot bench navigation`.

    surefoot bench navigation --planner "pytorch-mppi=python navigation_pytorch_mppi.py" --methods pietra --alpha 0.6 --pairs 1

What is compared is the controller: map, networks, time to the goal, limits, costs, horizon, number of futures, the share of
them that counts and the model of the vehicle are those of the method `pietra` at alpha 0.6. The sampler is the package's
KMPPI, its smooth one, with ten support points over the horizon; its controls are what differs from full speed straight on,
since it pulls them to zero. Nothing else of it is changed, but that surefoot's weight of the control cost, 0.1, takes the
place of 1, with which the vehicle stood still. Needs `pip install pytorch-mppi`.
"""

from collections.abc import Sequence

import numpy as np
import surefoot
import torch
from numpy.typing import NDArray
from pytorch_mppi import KMPPI
from pytorch_mppi.mppi import RBFKernel

#: Standard deviations of speed [m/s] and steering angle [rad] at a support point.
NOISE_STD = (0.5, 0.25)
N_SUPPORT = 10
#: So many of the futures are to count: surefoot's own share. A cost higher by the temperature makes a future e times less
#: likely; it begins with this and stays within these [s].
FRACTION, TEMPERATURE_S, TEMPERATURES_S = 0.05, 0.5, (1e-3, 10.0)
#: Cost of a step beyond the limits of roll or pitch [s], and which share of them a plan may use: surefoot's own.
ATTITUDE_S, SHARE = 20.0, 0.9
#: The ground is judged anew with every so many scans: with each fourth, after less than a metre.
SCANS = 4
#: Where nothing leads to the goal [s].
NEVER_S = 1000.0


class Belief:
    """The ground as surefoot judges it, to be looked up by many futures at once."""

    def __init__(self, vehicle: surefoot.Vehicle) -> None:
        settings = surefoot.settings_for(vehicle)
        window = settings["risk_map"]
        self.judge = surefoot.Evidential.load(vehicle, "pietra", cvar_level=0.6)
        self.field = surefoot.CostToGo(vehicle.model(), window["n_rows"], window["n_cols"], settings["cost_to_go"])

    def renew(self, ground: surefoot.Surface, at_m: Sequence[float], goal_m: Sequence[float]) -> None:
        """Judges the ground around the vehicle anew."""
        risk_map = self.judge.judge(ground, centre_m=at_m)
        self.field.update(risk_map, goal_m)
        self.n_rows, self.n_cols, self.n_yaws = risk_map.shape
        self.resolution_m, self.corner_m = risk_map.resolution_m, np.array(risk_map.origin) * risk_map.resolution_m
        self.risks = torch.from_numpy(risk_map.risks.reshape(-1, 4).copy())
        seconds: NDArray[np.float32] = np.nan_to_num(self.field.seconds, nan=NEVER_S, posinf=NEVER_S)
        self.seconds = torch.from_numpy(seconds.reshape(-1))

    def cells(self, x_m: torch.Tensor, y_m: torch.Tensor) -> torch.Tensor:
        """The cell of each place; beyond the map its outermost ring, where nothing moves."""
        col = ((x_m - self.corner_m[0]) / self.resolution_m).clamp(0, self.n_cols - 1).int()
        row = ((y_m - self.corner_m[1]) / self.resolution_m).clamp(0, self.n_rows - 1).int()
        cell: torch.Tensor = row * self.n_cols + col
        return cell

    def risks_at(self, x_m: torch.Tensor, y_m: torch.Tensor, yaw_rad: torch.Tensor) -> tuple[torch.Tensor, ...]:
        turns = yaw_rad / (2 * torch.pi)
        yaw_bin = ((turns - turns.floor()) * self.n_yaws).clamp(max=self.n_yaws - 1).int()
        risks: tuple[torch.Tensor, ...] = self.risks.index_select(0, self.cells(x_m, y_m) * self.n_yaws + yaw_bin).unbind(1)
        return risks

    def seconds_at(self, x_m: torch.Tensor, y_m: torch.Tensor) -> torch.Tensor:
        return self.seconds.index_select(0, self.cells(x_m, y_m).reshape(-1)).reshape(x_m.shape)


class Controller:
    """KMPPI over the belief. The state is x, y, yaw, speed, steering angle, whether it is on its way still, and its cost."""

    def __init__(self, vehicle: surefoot.Vehicle) -> None:
        description = vehicle.to_dict()
        settings = surefoot.settings_for(vehicle)["controller"]
        self.limits, self.wheelbase_m = description["limits"], description["geometry"]["wheelbase_m"]
        self.step_s, n_rollouts = settings["step_s"], settings["n_rollouts"]
        self.belief, self.goal_m, self.tolerance_m = Belief(vehicle), (0.0, 0.0), 0.0
        high = torch.tensor([self.limits["speed_max_mps"], self.limits["steering_max_rad"]])
        self.low = torch.tensor([-self.limits["reverse_speed_max_mps"], -self.limits["steering_max_rad"]])
        self.usual = torch.tensor([self.limits["speed_max_mps"], 0.0])
        self.high, self.no_cost = high, torch.zeros(n_rollouts)
        self.kmppi = KMPPI(
            self.step,
            lambda _state, _control: self.no_cost,  # the state carries the cost, because arriving ends it
            nx=7,
            noise_sigma=torch.diag(torch.tensor(NOISE_STD) ** 2),
            num_samples=n_rollouts,
            horizon=settings["n_steps"],
            terminal_state_cost=self.rest,
            lambda_=TEMPERATURE_S,
            u_min=self.low - self.usual,
            u_max=high - self.usual,
            U_init=torch.zeros(settings["n_steps"], 2),
            num_support_pts=N_SUPPORT,
            kernel=RBFKernel(sigma=settings["n_steps"] / N_SUPPORT),
        )

        full_cost, weight = self.kmppi._compute_action_cost, settings["control_cost"]
        self.kmppi._compute_action_cost = lambda noise: weight * full_cost(noise)

    def step(self, state: torch.Tensor, control: torch.Tensor) -> torch.Tensor:
        x_m, y_m, yaw_rad, speed_mps, steering_rad, on_way, cost_s = state.unbind(1)
        traction, turning, roll_rad, pitch_rad = self.belief.risks_at(x_m, y_m, yaw_rad)
        faster_mps = self.limits["acceleration_max_mps2"] * self.step_s
        further_rad = self.limits["steering_rate_max_radps"] * self.step_s
        speed_mps = speed_mps + (control[:, 0] + self.usual[0] - speed_mps).clamp(-faster_mps, faster_mps)
        steering_rad = steering_rad + (control[:, 1] - steering_rad).clamp(-further_rad, further_rad)
        travel_m = speed_mps * traction * self.step_s
        x_m, y_m = x_m + travel_m * yaw_rad.cos(), y_m + travel_m * yaw_rad.sin()
        yaw_rad = yaw_rad + turning * speed_mps * steering_rad.tan() / self.wheelbase_m * self.step_s
        over = (roll_rad > SHARE * self.limits["roll_max_rad"]) | (pitch_rad > SHARE * self.limits["pitch_max_rad"])
        cost_s = cost_s + on_way * (self.step_s + ATTITUDE_S * over)
        away_m = torch.hypot(x_m - self.goal_m[0], y_m - self.goal_m[1])
        on_way = on_way * (away_m > self.tolerance_m)
        return torch.stack([x_m, y_m, yaw_rad, speed_mps, steering_rad, on_way, cost_s], dim=1)

    def rest(self, states: torch.Tensor, _controls: torch.Tensor) -> torch.Tensor:
        x_m, y_m, *_, on_way, cost_s = states[:, :, -1].unbind(-1)
        return cost_s + on_way * self.belief.seconds_at(x_m, y_m)

    def command(self, state: Sequence[float]) -> tuple[float, float]:
        found = self.kmppi.command(torch.tensor([*state, 1.0, 0.0], dtype=torch.float32))
        # Between its support points the plan may overshoot what it sampled.
        speed_mps, steering_rad = (found + self.usual).clamp(self.low, self.high).tolist()
        n_counting, (least_s, most_s) = 1.0 / float((self.kmppi.omega**2).sum()), TEMPERATURES_S
        factor = 0.8 if n_counting > FRACTION * self.kmppi.K else 1.25
        self.kmppi.lambda_ = min(max(factor * self.kmppi.lambda_, least_s), most_s)
        return speed_mps, steering_rad


def main() -> None:
    torch.set_num_threads(1)
    torch.set_grad_enabled(False)
    vehicle = surefoot.Vehicle("pietra_full_size")
    pilot, controller, n_scans = surefoot.Pilot(vehicle), Controller(vehicle), 0
    for cycle in pilot:
        if cycle.is_new_drive:
            torch.manual_seed(1)
            controller = Controller(vehicle)
            controller.goal_m, controller.tolerance_m = cycle.goal_m, cycle.tolerance_m
        n_scans += cycle.scan is not None
        if cycle.is_new_drive or (cycle.scan is not None and n_scans % SCANS == 0):
            controller.belief.renew(pilot.surface(), cycle.state[:2], cycle.goal_m)
        pilot.command(*controller.command(cycle.state))


if __name__ == "__main__":
    main()
