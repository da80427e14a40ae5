"""A minute of PPO in the hall: shows that a learner runs on the worlds, and whether its return rises.

    pip install stable-baselines3 'surefoot[environments]'
    python ppo_smoke.py [seconds]

A minute teaches little. What counts is that return and length of episodes are finite and move.
"""

import sys
import time

import numpy as np
import surefoot  # registers the worlds
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.env_util import make_vec_env


class Stopwatch(BaseCallback):  # type: ignore[misc, unused-ignore]
    """Ends the training after some seconds."""

    def __init__(self, seconds: float) -> None:
        super().__init__()
        self.end_s = time.monotonic() + seconds

    def _on_step(self) -> bool:
        return time.monotonic() < self.end_s


def main(seconds: float = 60.0) -> None:
    settings = {"patch": {"n_rows": 16, "n_cols": 12, "spacing_m": 0.1, "rear_m": 0.2}, "rules": {"time_limit_s": 20.0}}
    options = {"ground": "true", "settings": settings}
    many = make_vec_env("surefoot/Arena-v0", n_envs=4, seed=1, env_kwargs=options)
    model = PPO("MultiInputPolicy", many, n_steps=128, batch_size=128, seed=1, device="cpu")
    model.learn(10**9, callback=Stopwatch(seconds))
    returns = np.array([episode["r"] for episode in model.ep_info_buffer])
    print(f"{model.num_timesteps} steps, return of the last {len(returns)} episodes {returns.mean():.2f}")


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
