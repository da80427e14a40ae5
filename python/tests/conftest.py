"""A short drive that several tests read."""

import pytest
from command import surefoot


@pytest.fixture(scope="session")
def recording_path(tmp_path_factory):
    """The recording of four seconds of a drive."""
    folder = tmp_path_factory.mktemp("drive")
    words = ["--vehicle", "rc_car", "--method", "physics", "--time-limit", 4, "--threads", 1, "--out", folder]
    drive = surefoot("drive", *words)
    assert (folder / "drive.mcap").exists(), drive.stderr
    return folder / "drive.mcap"
