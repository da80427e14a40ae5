"""Times pytorch-mppi on the CPU, as it comes: every operation is a call of its own."""

import work

chosen = work.arguments()  # before PyTorch counts the processors

from importlib.metadata import version

import torch
from pytorch_mppi import MPPI

torch.set_num_threads(chosen.threads)
torch.set_grad_enabled(False)
torch.manual_seed(7)

RISKS = torch.from_numpy(work.risk_map())


def risk_at(x_m, y_m, yaw_rad):
    col = ((x_m - work.WEST_M) / work.RESOLUTION_M).clamp(0, work.N_COLS - 1).int()
    row = ((y_m - work.SOUTH_M) / work.RESOLUTION_M).clamp(0, work.N_ROWS - 1).int()
    turns = yaw_rad / (2 * torch.pi)
    turns = turns - turns.floor()
    yaw_bin = (turns * work.N_YAWS).clamp(max=work.N_YAWS - 1).int()
    return RISKS.index_select(0, (row * work.N_COLS + col) * work.N_YAWS + yaw_bin).unbind(1)


def distance_m(x_m, y_m):
    return torch.hypot(x_m - work.GOAL_M[0], y_m - work.GOAL_M[1])


def step(state, control):
    x_m, y_m, yaw_rad, on_way, cost = state.unbind(1)
    speed_mps, steering_rad = control.unbind(1)
    linear_traction, angular_traction, roll_rad, pitch_rad = risk_at(x_m, y_m, yaw_rad)
    travel_m = speed_mps * linear_traction * work.STEP_S
    x_m = x_m + travel_m * yaw_rad.cos()
    y_m = y_m + travel_m * yaw_rad.sin()
    yaw_rate_radps = angular_traction * speed_mps * steering_rad.tan() / work.WHEELBASE_M
    yaw_rad = yaw_rad + yaw_rate_radps * work.STEP_S
    to_goal_m = distance_m(x_m, y_m)
    over = (roll_rad > work.ATTITUDE_MAX_RAD) | (pitch_rad > work.ATTITUDE_MAX_RAD)
    cost = cost + on_way * (work.STEP_S + to_goal_m + work.ATTITUDE_PENALTY * over)
    on_way = on_way * (to_goal_m > work.GOAL_TOLERANCE_M)
    return torch.stack([x_m, y_m, yaw_rad, on_way, cost], dim=1)


NO_COST = torch.zeros(work.N_ROLLOUTS)


def running_cost(_state, _control):
    return NO_COST  # the state carries the cost, because it needs the latch


def terminal_cost(states, _controls):
    x_m, y_m, _, on_way, cost = states[:, :, -1].unbind(-1)
    return cost + on_way * distance_m(x_m, y_m) / work.FINAL_SPEED_MPS


controller = MPPI(
    step,
    running_cost,
    nx=5,
    noise_sigma=torch.diag(torch.tensor(work.NOISE_STD) ** 2),
    num_samples=work.N_ROLLOUTS,
    horizon=work.N_STEPS,
    terminal_state_cost=terminal_cost,
    lambda_=work.TEMPERATURE,
    u_min=torch.tensor(work.CONTROL_MIN),
    u_max=torch.tensor(work.CONTROL_MAX),
    U_init=torch.tensor(work.NOMINAL).repeat(work.N_STEPS, 1),
)
start = torch.tensor(work.START_STATE)

work.report(
    f"pytorch-mppi {version('pytorch-mppi')}, torch {torch.__version__}",
    chosen,
    lambda: controller.command(start).numpy(),
)
