"""The last word before the actuators, as bus/src/watchdog.rs has it: a command counts for as long as what it was
decided on, however late it comes, and then the vehicle stops.
"""

DRIVE = 1
# Limits of the usual rates; see docs/runtime.md for others.
COMMAND_AGE_MAX_NS = 300_000_000
SCAN_AGE_MAX_NS = 1_000_000_000
# How far ahead of this clock a time may be.
FUTURE_NS = 20_000_000
# Who decided what the actuators are told; see OdometryRecord.
BY_COMMAND, BY_VEHICLE = 0, 1


class Watchdog:
    """Keeps the last command and knows when it is too old."""

    def __init__(self) -> None:
        self.speed_mps = self.steering_rad = 0.0
        self.until_ns = -1
        self.is_told_to_stand = False
        self.told, self.since_ns = (0.0, 0.0, BY_VEHICLE), 0

    def admit(self, command) -> None:
        """Takes over a CommandRecord. To hold or to stop ends what was commanded before."""
        self.is_told_to_stand = command.decision != DRIVE
        self.speed_mps, self.steering_rad = command.speed_mps, command.steering_rad
        times_ns = (command.odometry_at_ns + COMMAND_AGE_MAX_NS, command.scan_at_ns + SCAN_AGE_MAX_NS)
        self.until_ns = min(times_ns) if command.decision == DRIVE else -1

    def command(self, now_ns: int):
        """Speed [m/s] and steering [rad] to drive with now; None to stop."""
        is_fresh = now_ns <= self.until_ns <= now_ns + COMMAND_AGE_MAX_NS + FUTURE_NS
        return (self.speed_mps, self.steering_rad) if is_fresh else None

    def carry_out(self, now_ns: int):
        """Speed [m/s] and steering [rad] for the actuators; to stop is no speed, and the wheels as they were told."""
        command = self.command(now_ns)
        speed_mps, steering_rad = command or (0.0, self.told[1])
        by = BY_COMMAND if command or self.is_told_to_stand else BY_VEHICLE
        if self.told != (speed_mps, steering_rad, by):
            self.told, self.since_ns = (speed_mps, steering_rad, by), now_ns
        return speed_mps, steering_rad

    def applied(self) -> dict:
        """What the actuators were told last, as fields of the OdometryRecord that is sent next."""
        speed_mps, steering_rad, by = self.told
        return {
            "applied_speed_mps": speed_mps,
            "applied_steering_rad": steering_rad,
            "applied_since_ns": self.since_ns,
            "applied_by": by,
        }
