"""A planner of somebody's own in the benchmark: what it hears, and what it may not say."""

import json
import os
import shlex
import subprocess
import sys
import textwrap

import numpy as np
import pytest
import surefoot
from command import SUREFOOT

#: Tells what it hears, and drives half a metre per second straight on.
PLANNER = """
    import json, pathlib, sys
    import numpy as np
    import surefoot

    pilot = surefoot.Pilot(surefoot.Vehicle("pietra_full_size"))
    log = pathlib.Path(sys.argv[1]).open("a", buffering=1)
    for cycle in pilot:
        known, scan, imu = np.isfinite(pilot.surface().height_m).sum(), cycle.scan, cycle.imu
        log.write(json.dumps({
            "new": cycle.is_new_drive, "time_s": cycle.time_s, "goal_m": cycle.goal_m, "tolerance_m": cycle.tolerance_m,
            "state": cycle.state, "position_m": cycle.odometry["position_m"],
            "applied_speed_mps": cycle.odometry["applied_speed_mps"], "known": int(known),
            "points": None if scan is None else [str(scan["points"].dtype), len(scan["points"]), len(scan["terrain_class"])],
            "samples": [str(imu["acceleration_mps2"].dtype), *imu["angular_rate_radps"].shape],
        }) + "\\n")
        pilot.command(0.5, 0.0)
"""


def test_a_pilot_hears_every_cycle_of_every_drive(tmp_path):
    (tmp_path / "planner.py").write_text(textwrap.dedent(PLANNER))
    planner = shlex.join([sys.executable, str(tmp_path / "planner.py"), str(tmp_path / "log")])
    words = ["--methods", "nominal", "--maps", "1", "--pairs", "2", "--time-limit", "0.5", "--threads", "1"]
    command = [SUREFOOT, "bench", "navigation", "--planner", f"mine={planner}", *words, "--out", str(tmp_path / "out")]
    run = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert run.returncode == 0, run.stderr
    cycles = [json.loads(line) for line in (tmp_path / "log").read_text().splitlines()]
    assert [cycle["new"] for cycle in cycles] == [True, False, False, False, False] * 2
    np.testing.assert_allclose([cycle["time_s"] for cycle in cycles], [0.0, 0.1, 0.2, 0.3, 0.4] * 2, atol=1e-9)
    assert [cycle["points"] is None for cycle in cycles] == [False, True, False, True, False] * 2
    for pair in range(2):
        task = surefoot.Task.navigation(0, pair)
        for cycle in cycles[5 * pair : 5 * pair + 5]:
            assert tuple(cycle["goal_m"]) == task.goal_m and cycle["tolerance_m"] == 1.0
            assert np.hypot(*np.subtract(cycle["state"][:2], cycle["position_m"][:2])) < 1e-9
            assert cycle["known"] > 1000, "the map is of this drive"
    dtype, n_points, n_classes = cycles[0]["points"]
    assert dtype == "float32" and n_points == n_classes > 1000
    assert cycles[1]["samples"][0] == "float32" and cycles[1]["samples"][1] > 5 and cycles[1]["samples"][2] == 3
    assert [cycle["applied_speed_mps"] for cycle in cycles] == [0.0, 0.5, 0.5, 0.5, 0.5] * 2
    row = json.loads((tmp_path / "out/navigation.json").read_text())["rows"][1]
    assert row["method"] == "mine" and row["n"] == 2 and row["compute"]["n_cycles"] == 10


def test_a_pilot_needs_a_run_and_says_only_numbers(monkeypatch):
    vehicle = surefoot.Vehicle("pietra_full_size")
    monkeypatch.delenv("SUREFOOT_RUN", raising=False)
    with pytest.raises(ValueError, match="run: expected a name, here or in SUREFOOT_RUN, found none"):
        surefoot.Pilot(vehicle)
    with pytest.raises(ValueError, match="run: expected 1 to 32 letters, digits, - or _"):
        surefoot.Pilot(vehicle, "../up")
    pilot = surefoot.Pilot(vehicle, f"pilot-{os.getpid()}")
    with pytest.raises(RuntimeError, match="expected to be its only publisher"):
        surefoot.Pilot(vehicle, f"pilot-{os.getpid()}")
    with pytest.raises(ValueError, match="command: expected finite numbers"):
        pilot.command(float("nan"), 0.0)
    with pytest.raises(RuntimeError, match="command: expected a cycle before it, found none"):
        pilot.command(0.5, 0.0)
    assert not np.isfinite(pilot.surface().height_m).any()
