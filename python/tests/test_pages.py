"""The pages of the documentation are built, and hold every public name."""

import os
import pathlib
import subprocess

import surefoot
import surefoot.gap

PYTHON = pathlib.Path(__file__).resolve().parent.parent


def test_the_pages_are_built_with_every_public_name(tmp_path):
    # Another test runs the notebooks.
    environment = os.environ | {"SUREFOOT_RUN_NOTEBOOKS": "false"}
    subprocess.run([PYTHON / "docs/build", tmp_path], check=True, capture_output=True, text=True, env=environment)
    pages = ("planner", "worlds", "diagnosis", "running")
    pages = "".join((tmp_path / name / "index.html").read_text() for name in pages)
    names = [name for name in surefoot.__all__ if name != "gap"]
    names += [f"gap.{name}" for name in surefoot.gap.__all__]
    missing = [name for name in names if f'id="surefoot.{name}"' not in pages]
    assert not missing, f"python/docs/*.md leave out {missing}"
    assert "Where and why the recording breaks off" in pages, "docstrings of the Rust side"
    notebooks = [path.stem for path in (PYTHON / "notebooks").glob("*.ipynb")]
    start = (tmp_path / "index.html").read_text()
    for notebook in notebooks:
        assert (tmp_path / "python/notebooks" / notebook / "index.html").exists(), notebook
        assert f'href="python/notebooks/{notebook}/"' in start, f"nothing leads to {notebook}"
        assert f'{notebook}.ipynb"' not in start, "leads out of the pages"
