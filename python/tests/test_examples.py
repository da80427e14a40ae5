"""The examples do what they say."""

import pathlib
import subprocess
import sys

import pytest

FOLDER = pathlib.Path(__file__).resolve().parent.parent / "examples"
#: What takes a learner or a controller that is not installed here.
BY_HAND = {"ppo_smoke", "navigation_pytorch_mppi"}
EXAMPLES = sorted(path for path in FOLDER.glob("*.py") if path.stem not in BY_HAND)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_every_example_runs_and_leaves_its_picture(example, tmp_path):
    picture = tmp_path / "picture.png"
    run = subprocess.run([sys.executable, example, picture], capture_output=True, text=True, cwd=tmp_path)
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip() and picture.read_bytes().startswith(b"\x89PNG")


def test_there_are_examples():
    assert EXAMPLES
