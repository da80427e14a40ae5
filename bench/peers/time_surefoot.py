"""Times surefoot's own controller from Python, with settings that do this work and nothing else."""

import work

chosen = work.arguments()

from importlib.metadata import version

import numpy as np
import surefoot

risks = np.zeros((work.N_ROWS, work.N_COLS, work.N_YAWS, 4), np.float32)
risks[1:-1, 1:-1] = work.risk_map().reshape(risks.shape)[1:-1, 1:-1]
origin = [round(corner_m / work.RESOLUTION_M) for corner_m in (work.WEST_M, work.SOUTH_M)]
RISK_MAP = surefoot.RiskMap.from_arrays(risks, work.RESOLUTION_M, origin=tuple(origin))

(speed_min_mps, steering_min_rad), (speed_max_mps, steering_max_rad) = work.CONTROL_MIN, work.CONTROL_MAX
MODEL = surefoot.Model.from_dict({
    "wheelbase_m": work.WHEELBASE_M,
    "limits": {
        "speed_max_mps": speed_max_mps, "reverse_speed_max_mps": -speed_min_mps, "steering_max_rad": steering_max_rad,
        "steering_rate_max_radps": 1e3, "acceleration_max_mps2": 1e3, "lateral_acceleration_max_mps2": 1e3,
        "roll_max_rad": work.ATTITUDE_MAX_RAD, "pitch_max_rad": work.ATTITUDE_MAX_RAD,
    },
})  # fmt: skip
usual = surefoot.settings_for(surefoot.Vehicle("pietra_full_size"))["controller"]
SETTINGS = {
    "n_rollouts": work.N_ROLLOUTS,
    "n_steps": work.N_STEPS,
    "step_s": work.STEP_S,
    "n_threads": chosen.threads,
    "sampling": {"space": "controls", "speed_std": work.NOISE_STD[0], "steering_std": work.NOISE_STD[1], "correlation_s": 0.0},
    "actuation": "instant",
    "temperature": {"fixed": {"temperature_s": work.TEMPERATURE}},
    "control_cost": work.TEMPERATURE,
    "tracking_s": 0.0,
    "recovery": usual["recovery"] | {"patience_s": float("inf")},
    "delay_s": 0.0,
    "costs": usual["costs"] | {
        "attitude_s": work.ATTITUDE_PENALTY, "lateral_s": 0.0, "reverse_s": 0.0,
        "distance_s_per_m": 1.0, "rest_speed_mps": work.FINAL_SPEED_MPS,
    },
}  # fmt: skip
controller = surefoot.Mppi(MODEL, SETTINGS, seed=7)
state = np.array([*work.START, work.NOMINAL[0], 0.0])


def update():
    decision = controller.decide(state, RISK_MAP, work.GOAL_M, tolerance_m=work.GOAL_TOLERANCE_M)
    return np.array(decision.command)


work.report(f"surefoot {version('surefoot')}, from Python", chosen, update)
