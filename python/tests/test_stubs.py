"""The stubs are those of the module, and what uses it is typed."""

import pathlib
import subprocess
import sys

PYTHON = pathlib.Path(__file__).resolve().parent.parent


def succeeds(*words, cwd=PYTHON):
    done = subprocess.run([sys.executable, *map(str, words)], capture_output=True, text=True, cwd=cwd, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_stubs_are_those_that_the_rust_side_generates():
    # python/test leaves them beside the environment that this runs in.
    generated = pathlib.Path(sys.prefix) / "stubs/surefoot/_native.pyi"
    succeeds(PYTHON / "stubs/write_stubs.py", generated, "--check", cwd="/")


def test_signatures_are_those_of_the_module(tmp_path):
    allowed = tmp_path / "allowed"
    # Only builds for tests have the one, and so the list of all differs.
    allowed.write_text("surefoot._native.provoke_defect\nsurefoot._native.__all__\n")
    succeeds("-m", "mypy.stubtest", "surefoot._native", "--allowlist", allowed, "--ignore-disjoint-bases", cwd=tmp_path)


def test_the_package_and_the_examples_are_typed():
    config = PYTHON / "pyproject.toml"
    names = ["drive_robot", "replay_log", "double_track_simulator", "mujoco_simulator", "commonroad_simulator"]
    drivers = [PYTHON.parent / "examples/python" / f"{name}.py" for name in names]
    succeeds("-m", "mypy", "--strict", "--config-file", config, "-p", "surefoot", cwd="/")
    succeeds("-m", "mypy", "--strict", "--config-file", config, PYTHON / "examples", *drivers, cwd="/")
