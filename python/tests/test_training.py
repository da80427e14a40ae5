"""Learning from Python: footprints of recorded drives become networks, the same every time."""

import pickle

import numpy as np
import pytest
import surefoot

CAR = surefoot.Vehicle("rc_car")
BRIEF = {"epochs_max": 2, "flow_epochs_max": 1}


@pytest.fixture(scope="module")
def datasets():
    return [
        surefoot.Dataset.collect(CAR, "arena", split, n_maps=1, n_trials=4, time_limit_s=10.0, seed=2)
        for split in ("train", "validation")
    ]


def test_collected_drives_train_networks_that_judge_ground(datasets):
    told = []
    trained = surefoot.train(*datasets, settings=BRIEF, progress=told.append)
    assert told == trained.curves and {epoch["phase"] for epoch in told} == {"joint", "flow"}
    assert all(0.0 < emd2 < 4.0 for emd2 in trained.validation_emd2)
    again = surefoot.train(*datasets, settings=BRIEF)
    assert (again.weights, again.sidecar) == (trained.weights, trained.sidecar)
    own = surefoot.Evidential.from_bytes(CAR, trained.weights, trained.sidecar)
    risk_map = own.judge(surefoot.Surface.from_arrays(np.zeros((60, 60), np.float32), 0.03))
    assert own.method == "pietra" and 0.0 < risk_map.risks[30, 30, 0, 0] <= 1.0


def test_datasets_join_and_come_back_from_bytes(datasets):
    one, other = datasets
    joined = one.joined(other)
    assert len(joined) == len(one) + len(other) and joined.measured.shape == (len(joined), 4)
    assert np.array_equal(joined.poses, np.concatenate([one.poses, other.poses]))
    assert surefoot.Dataset.from_bytes(joined.to_bytes()).to_bytes() == joined.to_bytes()
    assert pickle.loads(pickle.dumps(joined)).to_bytes() == joined.to_bytes()


def test_even_ground_is_what_is_less_uneven():
    rocks = surefoot.Dataset.collect(
        surefoot.Vehicle("pietra_full_size"), "rocks", n_maps=1, n_trials=1, time_limit_s=6.0
    )
    median_m = float(np.median(rocks.unevenness_m))
    even = rocks.even(median_m)
    assert 0 < len(even) < len(rocks) and even.unevenness_m.max() <= median_m


def test_what_cannot_be_learned_from_is_told(datasets, tmp_path):
    with pytest.raises(ValueError, match="expected at least one example"):
        datasets[0].even(-1.0)
    with pytest.raises(ValueError, match='world: expected "testbed", "rocks", "arena" or "floor", found "moon"'):
        surefoot.Dataset.collect(CAR, "moon")
    with pytest.raises(ValueError, match="method: expected one of"):
        surefoot.train(*datasets, "magic")
    with pytest.raises(ValueError, match="epochs_max: expected a count from 1"):
        surefoot.train(*datasets, settings={"epochs_max": 0})
    with pytest.raises(TypeError, match="progress: expected a function"):
        surefoot.train(*datasets, progress=1)
    with pytest.raises(FileNotFoundError, match="nowhere.mcap"):
        surefoot.Dataset.from_recording(CAR, tmp_path / "nowhere.mcap", surefoot.Task.arena())
    with pytest.raises(ValueError, match="expected a drive in a file ending"):
        surefoot.Dataset.from_recording(CAR, tmp_path / "drive.txt", surefoot.Task.arena())


def test_what_a_progress_raises_ends_the_training(datasets):
    def enough(epoch):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        surefoot.train(*datasets, settings=BRIEF, progress=enough)
