"""Steps per second of the worlds beside PyBullet's racecar, on this machine, side by side.

    python environment_steps.py [seconds per row]

A step is 0.1 s, of ours a hundred steps of a plant of rigid bodies on brush tyres and what sensors and map make of it, of the
racecar ten steps of rigid bodies on a plane and where the ball is. Needs: pip install pybullet 'surefoot[environments]'
"""

import importlib
import multiprocessing
import sys
import time
import types

import gymnasium
import numpy as np
import surefoot  # registers the worlds


def rate(step, n_per_call, seconds):
    """Steps per second of a function that takes so many."""
    step()
    n_calls, began = 0, time.perf_counter()
    while time.perf_counter() - began < seconds:
        step()
        n_calls += 1
    return n_calls * n_per_call / (time.perf_counter() - began)


def alone(world, seconds, **options):
    environment = gymnasium.make(world, **options)
    environment.reset(seed=1)
    rng = np.random.default_rng(1)

    def step():
        action = rng.uniform([0.0, -1.0], 1.0).astype(np.float32)
        _, _, terminated, truncated, _ = environment.step(action)
        if terminated or truncated:
            environment.reset()

    return rate(step, 1, seconds)


def together(world, n, seconds, **options):
    many = gymnasium.make_vec(world, num_envs=n, vectorization_mode="vector_entry_point", **options)
    many.reset(seed=1)
    rng = np.random.default_rng(1)
    return rate(lambda: many.step(rng.uniform([0.0, -1.0], 1.0, (n, 2)).astype(np.float32)), n, seconds)


def racecar(seconds):
    """The racecar's own environment, with as many steps of its physics in a step as make 0.1 s."""
    # It was written for Gym; of that it needs what Gymnasium has kept.
    for name in ("", ".spaces", ".utils", ".utils.seeding", ".envs"):
        sys.modules[f"gym{name}"] = importlib.import_module(f"gymnasium{name}")
    registration = types.ModuleType("gym.envs.registration")
    registration.registry = types.SimpleNamespace(env_specs={})
    registration.register = registration.make = registration.spec = lambda *_, **__: None
    sys.modules["gym.envs.registration"] = registration
    from pybullet_envs.bullet.racecarGymEnv import RacecarGymEnv

    environment, rng = RacecarGymEnv(actionRepeat=10, renders=False, isDiscrete=False), np.random.default_rng(1)
    environment.reset()

    def step():
        _, _, is_done, _ = environment.step(rng.uniform([0.0, -1.0], 1.0))
        if is_done:
            environment.reset()

    return rate(step, 1, seconds)


def main(seconds=5.0):
    n, rows = 4 * multiprocessing.cpu_count(), []
    # The peer before and after, so that it shows whether the machine was as busy all along.
    peers = [racecar(seconds)]
    for name, world, options in [
        ("rock field, the world itself", "surefoot/RockField-v0", {"ground": "true", "world_seed": 1}),
        ("rock field, sensed", "surefoot/RockField-v0", {"world_seed": 1}),
        ("hall, the world itself", "surefoot/Arena-v0", {"ground": "true"}),
        ("hall, sensed", "surefoot/Arena-v0", {}),
    ]:
        rows.append((name, alone(world, seconds, **options)))
        rows.append((f"{name}, {n} together", together(world, n, seconds, **options)))
    # The peer before and after, so that a machine that is busy by then shows.
    peers.append(racecar(seconds))
    print(f"{'':44}{'steps/s':>10}{'over PyBullet racecar':>24}")
    for name, steps_per_s in rows:
        print(f"{name:44}{steps_per_s:10.0f}{steps_per_s / np.mean(peers):24.2f}")
    print(f"{'PyBullet racecar, twice':44}{peers[0]:10.0f}{peers[1]:14.0f}")


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
