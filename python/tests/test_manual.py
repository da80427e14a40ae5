"""What the manual shows runs word for word, where it needs nothing that only a reader has."""

import pathlib
import re

import ground
import numpy as np
import surefoot

MANUAL = (pathlib.Path(__file__).resolve().parents[2] / "docs/python.md").read_text()


def shown(heading):
    """The first piece of Python under a heading."""
    section = re.search(rf"^## {heading}\n(.*?)(?=^## |\Z)", MANUAL, re.S | re.M)
    assert section, f"docs/python.md has no part {heading!r}"
    return re.search(r"^```python\n(.*?)^```", section[1], re.S | re.M)[1]


def run(heading, names=None):
    names = names or {}
    exec(compile(shown(heading), f"docs/python.md, {heading}", "exec"), names)
    return names


def test_ten_lines_decide(capsys):
    names = run("In ten lines")
    assert capsys.readouterr().out.startswith("drive (")
    assert names["rollouts"].states.shape == (100, 51, 5)


def test_a_recording_is_read(recording_path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "surefoot-out").symlink_to(recording_path.parent)
    names = run("Recordings", {"surefoot": surefoot})
    assert len(names["log"]) > 10 and isinstance(names["risk_map"], surefoot.RiskMap)


def test_environments_are_made():
    names = run("Environments")
    assert names["many"].num_envs == 8 and names["environment"].spec.id == "surefoot/RockField-v0"


def test_a_cost_and_a_model_of_ones_own_decide():
    names = run("Costs and models of your own", {"np": np, "surefoot": surefoot, "vehicle": surefoot.Vehicle("rc_car")})
    for controller in (surefoot.Mppi(names["vehicle"].model(), cost=names["keep_left"]), names["controller"]):
        assert controller.decide(np.zeros(5), ground.level_map(), (4.0, 0.0)).kind == "drive"
