"""The command line of the wheel: versions, exit codes, a short drive, processes of a run, Ctrl-C."""

import json
import os
import signal
import subprocess
import time

from command import SUREFOOT, surefoot


def test_it_says_its_version():
    told = surefoot("--version")
    assert told.returncode == 0 and told.stdout.startswith("surefoot "), told


def test_bad_usage_ends_with_two_and_one_line():
    told = surefoot("drive", "--goal", "nowhere")
    assert told.returncode == 2 and len(told.stderr.splitlines()) == 1, told
    assert told.stderr.startswith("surefoot: --goal: expected"), told.stderr


def test_a_drive_that_does_not_get_there_ends_with_one(recording_path):
    summary = json.loads((recording_path.parent / "summary.json").read_text())
    assert summary, "the fixture has driven"
    told = surefoot("drive", "--time-limit", 1, "--method", "physics", "--out", recording_path.parent / "short")
    assert told.returncode == 1 and "goal not reached" in told.stderr, told


def test_the_module_is_not_taken_from_the_folder_it_is_called_in(tmp_path):
    (tmp_path / "surefoot.py").write_text("raise SystemExit('another one')\n")
    assert surefoot("--version", cwd=tmp_path).returncode == 0


def run_words(run, out):
    words = ["up", "--run", run, "--vehicle", "rc_car", "--method", "physics", "--threads", "1"]
    return [str(SUREFOOT), *words, "--out", str(out), "--third-parties", "4"]


def test_up_starts_its_own_processes_and_ends_them_on_ctrl_c(tmp_path):
    run = f"wheel-{os.getpid()}"
    up = subprocess.Popen(run_words(run, tmp_path), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        recording = tmp_path / "drive-000.mcap"
        until(lambda: recording.exists() and recording.stat().st_size > 50_000)
        children = [int(word) for word in children_of(up.pid)]
        assert len(children) == 6, "plant, mapping, learning, control, recorder and mission"
        up.send_signal(signal.SIGINT)
        _, told = up.communicate(timeout=60)
    finally:
        up.kill()
    assert up.returncode == 1 and "interrupted by the user" in told, told
    until(lambda: not any(is_alive(child) for child in children))
    assert (tmp_path / "runtime.json").exists()


def until(is_so, timeout_s=60.0):
    deadline_s = time.monotonic() + timeout_s
    while not is_so():
        assert time.monotonic() < deadline_s, "out of time"
        time.sleep(0.05)


def children_of(process):
    return pathlib_text(f"/proc/{process}/task/{process}/children").split()


def pathlib_text(path):
    with open(path) as file:
        return file.read()


def is_alive(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True
