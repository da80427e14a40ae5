"""How long odometry at 50 Hz and clouds of 1.28 MB at 10 Hz take from a node of rclpy through the bridge, and what that
costs: `ros/test -s -k latency` prints it. Times are told and not judged; that what was said is heard is.
"""

import json
import os
import statistics
import sys
import time
from pathlib import Path

from channels import Bus, Inlet
from conftest import CAR, FOLDER, SUREFOOT, Process, until

DURATION_S = 8.0
# Of clouds that nobody asks for once more, and on a machine that does other things.
SHARE_HEARD = 0.5


def show(who: str, said: dict, heard: dict) -> None:
    lost = {name: said[name] - heard[name]["n"] for name in said}
    late = "".join(f"  {name} p50 {1e3 * heard[name]['p50_s']:.2f} ms, {lost[name]} of {said[name]} lost" for name in said)
    print(f"\n{who:9}{late}  {100 * heard['core_share']:.1f} % of a core")


def test_latency_of_the_bridge(start, tmp_path):
    # What comes more than three times as often as the file states would be thinned.
    file = tmp_path / "car.toml"
    file.write_text(CAR.read_text().replace("scan_hz = 2.5", "scan_hz = 10.0"))
    bridge = start(Process, [SUREFOOT, "up", "--robot", str(file), "--role", "ros", "--out", str(tmp_path)])
    # The bridge comes first, which has room on its channels for more readers than this program asks for.
    until(lambda: any(Path(f"/tmp/surefoot-{os.geteuid()}/ros-car").glob("**/*")), 20, "the bridge's channels")
    time.sleep(1.0)
    inlets = {"odometry": Inlet(Bus("ros-car"), "odometry"), "cloud": Inlet(Bus("ros-car"), "scan")}
    late_s, sequence = {name: [] for name in inlets}, {name: 0 for name in inlets}
    talker = start(Process, [sys.executable, str(FOLDER / "talker.py"), str(DURATION_S)])
    stat = Path(f"/proc/{bridge.process.pid}/stat")
    used = lambda: sum(map(int, stat.read_text().rsplit(")", 1)[1].split()[11:13])) / os.sysconf("SC_CLK_TCK")
    began_s, used_s = time.monotonic(), used()

    def is_done() -> bool:
        for name, inlet in inlets.items():
            message = inlet.newest()
            if message is not None:
                stamp = message[1] if name == "odometry" else message[1].stamp
                late_s[name].append(1e-9 * (stamp.published_at_ns - stamp.valid_at_ns))
                sequence[name] = stamp.sequence
        return talker.process.poll() is not None

    until(is_done, DURATION_S + 30, "everything is said")
    said = json.loads(talker.lines[-1])
    heard = {name: {"n": sequence[name], "p50_s": statistics.median(late_s[name])} for name in inlets}
    show("surefoot", said, {**heard, "core_share": (used() - used_s) / (time.monotonic() - began_s)})
    for name in said:
        assert heard[name]["n"] >= SHARE_HEARD * said[name], name
