"""The command `surefoot`: `python -m surefoot`, or as the wheel installs it."""

import signal
import sys

from surefoot import _native


def main() -> int:
    """Runs the command line with the words of this process; returns its exit code."""
    # Python would only note a Ctrl-C until the command is over; the command knows what to do with it itself.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    # Not from the folder that it is called in, where another `surefoot` may lie.
    start = [sys.executable, "-P", "-m", "surefoot"]
    return _native.run_command_line(start, sys.argv[1:], _native.__file__)


if __name__ == "__main__":
    sys.exit(main())
