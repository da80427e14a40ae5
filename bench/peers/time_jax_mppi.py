"""Times jax-mppi. Its whole update, noise to shifted controls, is one compiled function."""

import work

chosen = work.arguments()  # before JAX counts the processors

from importlib.metadata import version

import jax
import jax.numpy as jnp
import numpy as np
from jax_mppi import mppi

RISKS = jnp.asarray(work.risk_map())
GOAL_M = jnp.asarray(work.GOAL_M)


def risk_at(x_m, y_m, yaw_rad):
    col = jnp.clip((x_m - work.WEST_M) / work.RESOLUTION_M, 0, work.N_COLS - 1).astype(jnp.int32)
    row = jnp.clip((y_m - work.SOUTH_M) / work.RESOLUTION_M, 0, work.N_ROWS - 1).astype(jnp.int32)
    turns = yaw_rad / (2 * np.pi)
    turns = turns - jnp.floor(turns)
    yaw_bin = jnp.minimum(turns * work.N_YAWS, work.N_YAWS - 1).astype(jnp.int32)
    index = (row * work.N_COLS + col) * work.N_YAWS + yaw_bin
    return RISKS.at[index].get(mode="promise_in_bounds")


def step(state, control):
    x_m, y_m, yaw_rad, on_way, cost = state
    speed_mps, steering_rad = control
    linear_traction, angular_traction, roll_rad, pitch_rad = risk_at(x_m, y_m, yaw_rad)
    travel_m = speed_mps * linear_traction * work.STEP_S
    x_m = x_m + travel_m * jnp.cos(yaw_rad)
    y_m = y_m + travel_m * jnp.sin(yaw_rad)
    yaw_rate_radps = angular_traction * speed_mps * jnp.tan(steering_rad) / work.WHEELBASE_M
    yaw_rad = yaw_rad + yaw_rate_radps * work.STEP_S
    distance_m = jnp.sqrt((x_m - GOAL_M[0]) ** 2 + (y_m - GOAL_M[1]) ** 2)
    over = (roll_rad > work.ATTITUDE_MAX_RAD) | (pitch_rad > work.ATTITUDE_MAX_RAD)
    cost = cost + on_way * (work.STEP_S + distance_m + work.ATTITUDE_PENALTY * over)
    on_way = on_way * (distance_m > work.GOAL_TOLERANCE_M)
    return jnp.stack([x_m, y_m, yaw_rad, on_way, cost])


def running_cost(_state, _control):
    return jnp.float32(0.0)  # the state carries the cost, because it needs the latch


def terminal_cost(state, _last_control):
    distance_m = jnp.sqrt((state[0] - GOAL_M[0]) ** 2 + (state[1] - GOAL_M[1]) ** 2)
    return state[4] + state[3] * distance_m / work.FINAL_SPEED_MPS


config, controls = mppi.create(
    nx=5,
    nu=2,
    noise_sigma=jnp.diag(jnp.asarray(work.NOISE_STD) ** 2),
    num_samples=work.N_ROLLOUTS,
    horizon=work.N_STEPS,
    lambda_=work.TEMPERATURE,
    u_min=jnp.asarray(work.CONTROL_MIN),
    u_max=jnp.asarray(work.CONTROL_MAX),
    U_init=jnp.tile(jnp.asarray(work.NOMINAL), (work.N_STEPS, 1)),
)
start = jnp.asarray(work.START_STATE, dtype=jnp.float32)
compiled = jax.jit(lambda state: mppi.command(config, state, start, step, running_cost, terminal_cost))


def update():
    global controls
    command, controls = compiled(controls)
    return np.asarray(jax.block_until_ready((command, controls))[0])


work.report(f"jax-mppi {version('jax-mppi')}, jax {jax.__version__}", chosen, update)
