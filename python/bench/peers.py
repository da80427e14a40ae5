"""One controller update from Python beside those of pytorch-mppi and jax-mppi, the same work, in turns on one machine.

    python peers.py [--rounds 3] [--threads 1] [--updates 200] [--peer NAME=PYTHON ...]

Runs the scripts of bench/peers, ours with this interpreter and each peer's with its own, in which it is installed, for instance
--peer jax_mppi=/tmp/jax-mppi/bin/python --peer pytorch_mppi=/tmp/pytorch-mppi/bin/python. Everybody's turn comes once a
round, so that a machine that is busy for a while is so for all; the least median counts.
"""

import argparse
import json
import pathlib
import subprocess
import sys

SCRIPTS = pathlib.Path(__file__).resolve().parents[2] / "bench" / "peers"


def timed(interpreter, name, chosen):
    """What a script says of itself."""
    script = SCRIPTS / f"time_{name}.py"
    options = ["--threads", str(chosen.threads), "--updates", str(chosen.updates)]
    run = subprocess.run([interpreter, script, *options], capture_output=True, text=True)
    if run.returncode != 0:
        raise SystemExit(f"{name}: {run.stderr.strip().splitlines()[-1]}")
    return json.loads(run.stdout.strip().splitlines()[-1])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--updates", type=int, default=200)
    parser.add_argument("--peer", action="append", default=[], metavar="NAME=PYTHON")
    chosen = parser.parse_args()
    runners = {"surefoot": sys.executable} | dict(peer.split("=", 1) for peer in chosen.peer)
    rows = {name: [] for name in runners}
    for _ in range(chosen.rounds):
        for name, interpreter in runners.items():
            rows[name].append(timed(interpreter, name, chosen))
    ours_ms = min(row["ms"]["median"] for row in rows["surefoot"])
    for name, told in rows.items():
        median_ms = min(row["ms"]["median"] for row in told)
        print(f"{told[0]['peer']:44}{median_ms:9.3f} ms{median_ms / ours_ms:9.1f}")


if __name__ == "__main__":
    main()
