"""The worlds as Gymnasium environments: the contract, the bits, the processes."""

import multiprocessing
import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest
import surefoot
from gymnasium.utils.env_checker import check_env

#: Drives whose worlds take little to make and to see.
CHEAP = {"settings": {"patch": {"n_rows": 12, "n_cols": 8}}}
TRUE = CHEAP | {"ground": "true"}


def heights(n=120, seed=2):
    """Gentle waves [m] over 24 m."""
    rng = np.random.default_rng(seed)
    x_m, y_m = np.meshgrid(np.arange(n) * 0.2, np.arange(n) * 0.2)
    phases = rng.uniform(0, 6, 2)
    return (0.1 * np.sin(x_m / 3 + phases[0]) * np.cos(y_m / 4 + phases[1])).astype(np.float32)


WORLDS = [
    ("surefoot/RockField-v0", TRUE | {"world_seed": 1}),
    ("surefoot/Arena-v0", TRUE),
    ("surefoot/Arena-v0", CHEAP),
    (
        "surefoot/Terrain-v0",
        TRUE | {"elevation": heights(), "resolution_m": 0.2, "start": (6.0, 6.0, 0.8), "goal_m": (16.0, 16.0)},
    ),
]


def trail(environment, seed, n_steps=15):
    """All that an environment says over some steps, as one array."""
    actions = np.random.default_rng(7).uniform(-1, 1, (n_steps, 2)).astype(np.float32)
    observation, info = environment.reset(seed=seed)
    said = [flat(observation)]
    for action in actions:
        observation, reward, terminated, truncated, info = environment.step(action)
        said.append(np.append(flat(observation), [reward, terminated, truncated, info["distance_m"]]))
    return np.concatenate(said)


def flat(observation):
    return np.concatenate([observation[name].ravel() for name in ("ground", "state", "goal")])


@pytest.mark.parametrize("world, options", WORLDS, ids=["rocks", "hall", "hall, sensed", "terrain"])
def test_the_checker_finds_nothing_to_say(world, options):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        environment = gymnasium.make(world, render_mode="rgb_array", frame_px=64, **options)
        check_env(environment.unwrapped)
        environment.close()


@pytest.mark.parametrize("world, options", WORLDS, ids=["rocks", "hall", "hall, sensed", "terrain"])
def test_whole_episodes_are_the_same_to_the_bit(world, options):
    one, other = gymnasium.make(world, **options), gymnasium.make(world, **options)
    assert trail(one, 5).tobytes() == trail(other, 5).tobytes()
    assert trail(one, 5).tobytes() != trail(other, 6).tobytes()
    assert trail(other, 5).tobytes() == trail(one, 5).tobytes(), "after another episode"


def test_another_seed_is_another_world_unless_it_was_chosen():
    environment = gymnasium.make("surefoot/RockField-v0", **TRUE)
    environment.reset(seed=1)
    first = environment.unwrapped.simulation
    environment.reset(seed=2)
    assert np.any(surface(environment.unwrapped.simulation) != surface(first))
    chosen = gymnasium.make("surefoot/RockField-v0", world_seed=3, **TRUE)
    chosen.reset(seed=1)
    first = chosen.unwrapped.simulation
    chosen.reset(seed=2)
    assert np.all(surface(chosen.unwrapped.simulation) == surface(first))


def surface(simulation):
    return np.nan_to_num(simulation.surface().height_m)


def test_actions_are_scaled_to_what_the_vehicle_can_do():
    environment = gymnasium.make("surefoot/Arena-v0", **TRUE).unwrapped
    limits = surefoot.Vehicle("rc_car").to_dict()["limits"]
    commands = environment.course.commands([[1.0, -1.0], [-1.0, 0.5], [0.5, 0.0]])
    ahead_mps, reverse_mps = limits["speed_max_mps"], limits["reverse_speed_max_mps"]
    steering_rad = limits["steering_max_rad"]
    expected = [[ahead_mps, -steering_rad], [-reverse_mps, 0.5 * steering_rad], [0.5 * ahead_mps, 0.0]]
    assert commands.dtype == np.float32 and np.allclose(commands, expected)
    assert np.allclose(environment.course.actions(commands), [[1.0, -1.0], [-1.0, 0.5], [0.5, 0.0]])


def test_the_patch_is_turned_with_the_vehicle_and_the_goal_too():
    """Ground that rises to the north: ahead of who faces north, to the left of who faces east."""
    slope = np.repeat(np.arange(120, dtype=np.float32)[:, None] * 0.02, 120, axis=1)
    for yaw_rad, axis in [(np.pi / 2, 0), (0.0, 1)]:
        environment = gymnasium.make(
            "surefoot/Terrain-v0", elevation=slope, resolution_m=0.2, start=(12.0, 12.0, yaw_rad), goal_m=(12.0, 20.0), **TRUE
        )  # fmt: skip
        observation, _ = environment.reset(seed=1)
        height_m, is_known = observation["ground"][0], observation["ground"][1]
        spacing_m = environment.unwrapped.simulation.settings["patch"]["spacing_m"]
        rises = np.diff(height_m, axis=axis)[np.diff(is_known, axis=axis) == 0]
        assert is_known.mean() > 0.9 and np.allclose(np.median(rises), 0.1 * spacing_m, rtol=0.05)
        ahead_m, left_m = observation["goal"]
        nearer = (ahead_m, left_m) if axis == 0 else (left_m, ahead_m)
        assert abs(nearer[0] - 8.0) < 0.3 and abs(nearer[1]) < 0.3


def test_rewards_and_ends_are_what_they_are_said_to_be():
    elevation = np.zeros((120, 120), np.float32)
    there = {"elevation": elevation, "resolution_m": 0.2, "start": (6.0, 12.0, 0.0)}
    environment = gymnasium.make("surefoot/Terrain-v0", goal_m=(12.0, 12.0), **there, **TRUE)
    _, info = environment.reset(seed=1)
    for _ in range(200):
        before_m = info["distance_m"]
        _, reward, terminated, truncated, info = environment.step(np.array([0.5, 0.0], np.float32))
        at_goal = info["outcome"] == "goal"
        assert reward == pytest.approx(before_m - info["distance_m"] - 0.01 + 10.0 * at_goal)
        assert terminated == at_goal and not truncated
        if terminated:
            break
    assert info["outcome"] == "goal" and info["distance_m"] < 1.5
    # Who stands still is stuck, and who has no time left is cut off.
    stuck = gymnasium.make("surefoot/Terrain-v0", goal_m=(18.0, 12.0), **there, **TRUE)
    stuck.reset(seed=1)
    ends = [stuck.step(np.zeros(2, np.float32)) for _ in range(52)]
    assert ends[-1][4]["outcome"] == "stuck" and ends[-1][2] and not ends[-1][3]
    assert sum(end[1] < -9.0 for end in ends) >= 1
    late_settings = {**CHEAP["settings"], "rules": {"time_limit_s": 1.0}}
    late = gymnasium.make(
        "surefoot/Terrain-v0", goal_m=(18.0, 12.0), **there, ground="true", settings=late_settings
    )
    late.reset(seed=1)
    ends = [late.step(np.array([0.2, 0.0], np.float32)) for _ in range(10)]
    assert [end[3] for end in ends] == [False] * 9 + [True] and not ends[-1][2]


@pytest.mark.parametrize("n", [1, 3])
def test_many_together_are_the_same_as_each_alone(n):
    rules = {"time_limit_s": 0.8, "immobile_s": 0.4, "immobile_m": 0.02}
    options = TRUE | {"settings": {**CHEAP["settings"], "rules": rules}}
    many = gymnasium.make_vec("surefoot/Arena-v0", num_envs=n, vectorization_mode="vector_entry_point", **options)
    assert many.metadata["autoreset_mode"] == gymnasium.vector.AutoresetMode.NEXT_STEP
    alone = [gymnasium.make("surefoot/Arena-v0", **options) for _ in range(n)]
    observation, _ = many.reset(seed=9)
    single = [environment.reset(seed=9 + index)[0] for index, environment in enumerate(alone)]
    assert all(same(observation, index, single[index]) for index in range(n))
    rng, ended, ends = np.random.default_rng(3), [False] * n, []
    for _ in range(14):
        # The last one stands and is stuck before the time of the others is over.
        actions = rng.uniform([0.6, -1.0], 1.0, (n, 2)).astype(np.float32)
        actions[-1, 0] = 0.0
        observation, rewards, terminated, truncated, info = many.step(actions)
        ends.append(info["outcome"])
        for index, environment in enumerate(alone):
            if ended[index]:
                first, _ = environment.reset()
                assert same(observation, index, first) and rewards[index] == 0.0
                assert not (terminated[index] or truncated[index])
                ended[index] = False
            else:
                own, reward, is_terminated, is_truncated, told = environment.step(actions[index])
                assert same(observation, index, own) and rewards[index] == reward
                assert (terminated[index], truncated[index]) == (is_terminated, is_truncated)
                assert info["outcome"][index] == told["outcome"]
                ended[index] = is_terminated or is_truncated
    assert many.observation_space.contains(observation)
    told = [set(outcomes) - {None} for outcomes in zip(*ends)]
    assert told == [{"timeout"}] * (n - 1) + [{"stuck"}]


def same(observation, index, single):
    return all(np.array_equal(observation[name][index], single[name]) for name in single)


@pytest.mark.parametrize("context", ["fork", "spawn"])
def test_vector_environments_of_processes_step_in_forked_and_spawned_ones(context):
    with warnings.catch_warnings():
        # Python warns of forking a process that has threads; that it works is what is tested.
        warnings.simplefilter("ignore")
        many = gymnasium.make_vec(
            "surefoot/Arena-v0", num_envs=2, vectorization_mode="async", vector_kwargs={"context": context}, **TRUE
        )
    alone = gymnasium.make("surefoot/Arena-v0", **TRUE)
    observation, _ = many.reset(seed=4)
    assert same(observation, 0, alone.reset(seed=4)[0])
    action = np.array([0.5, 0.1], np.float32)
    observation, rewards, *_ = many.step(np.stack([action, action]))
    own, reward, *_ = alone.step(action)
    assert same(observation, 0, own) and rewards[0] == reward
    many.close()


def test_pictures_show_ground_vehicle_goal_and_way():
    environment = gymnasium.make("surefoot/Arena-v0", render_mode="rgb_array", frame_px=256, **TRUE)
    environment.reset(seed=1)
    first = environment.render()
    assert first.dtype == np.uint8 and first.ndim == 3 and first.shape[2] == 3 and max(first.shape) == 256
    for _ in range(10):
        environment.step(np.array([1.0, 0.2], np.float32))
    later = environment.render()
    assert later.shape == first.shape and 20 < np.any(later != first, axis=2).sum() < 0.2 * first[..., 0].size
    assert len(np.unique(first.reshape(-1, 3), axis=0)) > 100
    assert gymnasium.make("surefoot/Arena-v0", **TRUE).unwrapped.render() is None


def test_a_recorded_episode_is_a_drive_log_to_learn_from(tmp_path):
    environment = gymnasium.make("surefoot/Arena-v0", **CHEAP)
    path = tmp_path / "drive.mcap"
    environment.reset(seed=1, options={"record": path})
    for _ in range(25):
        environment.step(np.array([0.5, 0.1], np.float32))
    environment.close()
    assert path.read_bytes().startswith(b"\x89MCAP0\r\n") and path.read_bytes().endswith(b"\x89MCAP0\r\n")
    task = environment.unwrapped.simulation
    dataset = surefoot.Dataset.from_recording(surefoot.Vehicle("rc_car"), path, surefoot.Task.arena())
    assert len(dataset) > 5 and len(task.poses) == 26
    with pytest.raises(OSError, match="expected a place to record to"):
        environment.reset(options={"record": tmp_path / "nowhere" / "drive.mcap"})


def test_what_cannot_be_is_told():
    make = gymnasium.make
    with pytest.raises(TypeError, match="unknown"):
        make("surefoot/Arena-v0", unknown=1)
    with pytest.raises(ValueError, match="resolution_m: expected the length of a cell"):
        make("surefoot/Terrain-v0", elevation=heights())
    with pytest.raises(ValueError, match="resolution_m: expected with an array of heights"):
        make("surefoot/Terrain-v0", elevation="hills.npz", resolution_m=0.1)
    with pytest.raises(TypeError, match="height_m: expected an array of float32"):
        make("surefoot/Terrain-v0", elevation=heights().astype(float), resolution_m=0.1)
    with pytest.raises(FileNotFoundError, match="nowhere.npz: expected a readable file"):
        make("surefoot/Terrain-v0", elevation="nowhere.npz").reset(seed=1)
    with pytest.raises(ValueError, match="render_mode: expected None or"):
        surefoot.environments.Arena(render_mode="human")
    with pytest.raises(ValueError, match='ground: expected "sensed" or "true", found "felt"'):
        make("surefoot/Arena-v0", ground="felt").reset(seed=1)
    with pytest.raises(ValueError, match="patch.n_rows: expected 1 to 512, found 0"):
        make("surefoot/Arena-v0", settings={"patch": {"n_rows": 0}})
    with pytest.raises(ValueError, match="num_envs: expected a whole number >= 1"):
        surefoot.environments.ArenaVector(num_envs=0)
    environment = make("surefoot/Arena-v0", **TRUE).unwrapped
    with pytest.raises(gymnasium.error.ResetNeeded):
        environment.step(np.zeros(2, np.float32))
    with pytest.raises(ValueError, match='options: expected "record" alone'):
        environment.reset(options={"seed": 1})
    environment.reset(seed=1)
    nan, far = np.array([np.nan, 0.0], np.float32), np.array([1.1, 0.0], np.float32)
    for action, error in [(nan, ValueError), (far, ValueError), (np.zeros(3), ValueError), (["a", "b"], TypeError)]:
        with pytest.raises(error, match="action: expected"):
            environment.step(action)


def test_without_gymnasium_it_is_said_what_to_install():
    script = (
        "import sys; sys.modules['gymnasium'] = None\n"
        "import surefoot\n"
        "try:\n    import surefoot.environments\n"
        "except ImportError as error:\n    print(error)"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert "pip install 'surefoot[environments]'" in run.stdout


@pytest.mark.parametrize(
    "script",
    [
        "import surefoot, gymnasium",
        "import gymnasium, surefoot",
        "import surefoot.environments, gymnasium",
        "from gymnasium.envs.registration import registry; import surefoot, gymnasium",
        "import surefoot; from gymnasium import spaces; import gymnasium",
    ],
)
def test_worlds_are_registered_whichever_comes_first(script):
    script += "; print(sorted(name for name in gymnasium.registry if 'surefoot' in name))"
    run = subprocess.run([sys.executable, "-W", "error", "-c", script], capture_output=True, text=True)
    assert run.stdout.strip() == "['surefoot/Arena-v0', 'surefoot/RockField-v0', 'surefoot/Terrain-v0']", run.stderr


def test_importing_surefoot_imports_no_gymnasium():
    script = "import sys, surefoot; print('gymnasium' in sys.modules)"
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "False"


def drive_in_child(n):
    simulation = surefoot.Simulation(surefoot.Vehicle("rc_car"), surefoot.Task.arena(), seed=2)
    commands = np.array([[0.5, 0.1]], np.float32)
    for _ in range(n):
        observations = surefoot.step_together([simulation], commands)
    return observations.state.tobytes()


@pytest.mark.parametrize("method", ["fork", "spawn"])
@pytest.mark.filterwarnings("ignore")
def test_simulations_are_the_same_in_every_process(method):
    expected = drive_in_child(4)
    with multiprocessing.get_context(method).Pool(1) as pool:
        assert pool.apply(drive_in_child, (4,)) == expected


def test_the_pairs_of_the_navigation_benchmark_are_40_m_apart_on_maps_of_their_own():
    tasks = {(seed, map, pair): surefoot.Task.navigation(map, pair, seed=seed)
             for seed, map, pair in ((1, 0, 0), (1, 0, 1), (1, 1, 0), (2, 0, 0))}  # fmt: skip
    for task in tasks.values():
        (x_m, y_m, yaw_rad), goal_m = task.start, np.array(task.goal_m)
        there_m = np.array([x_m + 40.0 * np.cos(yaw_rad), y_m + 40.0 * np.sin(yaw_rad)])
        np.testing.assert_allclose(there_m, goal_m, atol=1e-9)
        # Pads of 7 m are level but for the rocks that a pad's edge cuts.
        row, col = (goal_m[::-1] / task.resolution_m).astype(int)
        pad_m = task.height_m[row - 45 : row + 45, col - 45 : col + 45]
        assert pad_m.size == 0 or np.ptp(pad_m) < 1e-4
    starts = {task.start for task in tasks.values()}
    assert len(starts) == len(tasks)
    again = surefoot.Task.navigation(0, 0, seed=1)
    assert again.start == tasks[1, 0, 0].start and (again.height_m == tasks[1, 0, 0].height_m).all()
    with pytest.raises(ValueError, match="room for a drive of 40 m"):
        surefoot.Task.navigation(0, 0, settings={"side_m": 40.0})
