"""Where a belief about the ground and drives part."""

import json

import pytest
import surefoot
from surefoot import gap


def test_a_recorded_drive_is_held_against_its_own_maps(recording_path, tmp_path):
    vehicle = surefoot.Vehicle("rc_car")
    report = gap.ground([recording_path], vehicle, reference=[recording_path])
    numbers = report.numbers
    assert numbers["schema_version"] == 1 and numbers["n_met"] > 5
    assert [one["parameter"] for one in numbers["calibration"]] == [
        "linear traction",
        "angular traction",
        "roll",
        "pitch",
    ]
    # Of a drive against itself, or too short a one to tell, nothing is named.
    assert report.named is None and not report.is_unknown and report.doubts == []
    assert "Foretold and met" in str(report) and "rc_car" in repr(report)
    report.save(tmp_path / "out")
    assert json.loads((tmp_path / "out" / "ground.json").read_text()) == numbers
    assert (tmp_path / "out" / "ground.html").read_text() == report.html()
    assert report._repr_html_().startswith("<iframe")


def test_what_is_no_drive_is_refused(recording_path, tmp_path):
    vehicle = surefoot.Vehicle("rc_car")
    with pytest.raises(ValueError, match="expected footprints on ground that the map shows, found none|at least one map"):
        gap.ground([], vehicle)
    log = tmp_path / "drive.csv"
    log.write_text("t,x\n0,0\n")
    with pytest.raises(ValueError, match="drive.csv: expected a recording"):
        gap.ground([log], vehicle)
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(recording_path.read_bytes()[:200])
    with pytest.raises(ValueError, match="broken.mcap: expected messages on topic /drive_log"):
        gap.ground([broken], vehicle)
    with pytest.raises(TypeError):
        gap.ground([recording_path], "rc_car")
    with pytest.raises(TypeError):
        gap.ground([3], vehicle)
