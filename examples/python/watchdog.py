"""The last word before the actuators, as runtime/src/watchdog.rs has it: a command counts for as long as what it was
decided on, however late it comes, and then the vehicle stops.
"""

DRIVE = 1
# Limits of the usual rates; see docs/runtime.md for others.
COMMAND_AGE_MAX_NS = 300_000_000
SCAN_AGE_MAX_NS = 1_000_000_000
# How far ahead of this clock a time may be.
FUTURE_NS = 20_000_000


class Watchdog:
    """Keeps the last command and knows when it is too old."""

    def __init__(self) -> None:
        self.speed_mps = self.steering_rad = 0.0
        self.until_ns = -1

    def admit(self, command) -> None:
        """Takes over a CommandRecord. To hold or to stop ends what was commanded before."""
        self.speed_mps, self.steering_rad = command.speed_mps, command.steering_rad
        times_ns = (command.odometry_at_ns + COMMAND_AGE_MAX_NS, command.scan_at_ns + SCAN_AGE_MAX_NS)
        self.until_ns = min(times_ns) if command.decision == DRIVE else -1

    def command(self, now_ns: int):
        """Speed [m/s] and steering [rad] to drive with now; None to stop."""
        is_fresh = now_ns <= self.until_ns <= now_ns + COMMAND_AGE_MAX_NS + FUTURE_NS
        return (self.speed_mps, self.steering_rad) if is_fresh else None
