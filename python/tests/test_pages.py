"""The pages of the documentation are built, and hold every public name."""

import pathlib
import subprocess

import surefoot
import surefoot.gap

PYTHON = pathlib.Path(__file__).resolve().parent.parent


def test_the_pages_are_built_with_every_public_name(tmp_path):
    subprocess.run([PYTHON / "docs/build", tmp_path], check=True, capture_output=True, text=True)
    pages = ("planner", "worlds", "diagnosis", "running")
    pages = "".join((tmp_path / name / "index.html").read_text() for name in pages)
    names = [name for name in surefoot.__all__ if name != "gap"]
    names += [f"gap.{name}" for name in surefoot.gap.__all__]
    missing = [name for name in names if f'id="surefoot.{name}"' not in pages]
    assert not missing, f"python/docs/*.md leave out {missing}"
    assert "Where and why the recording breaks off" in pages, "docstrings of the Rust side"
