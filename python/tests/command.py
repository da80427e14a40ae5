"""The command `surefoot` of the wheel, as the tests call it."""

import pathlib
import subprocess
import sys

# As the wheel installs it, beside the interpreter.
SUREFOOT = pathlib.Path(sys.executable).parent / "surefoot"


def surefoot(*words, timeout=120.0, **options):
    """Runs the command to its end."""
    return subprocess.run(
        [SUREFOOT, *map(str, words)], capture_output=True, text=True, timeout=timeout, check=False, **options
    )
