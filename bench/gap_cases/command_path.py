"""What happens to a command before it reaches the plant: the effects that are injected in front of it.

Keys of an injection that act here: st_* on steering, v_* on speed, drop_* and quantum on both.
"""

import math
from collections import deque

TICK_S = 0.02


class Delay:
    """Transport delay with linear interpolation between ticks."""

    def __init__(self, delay_s: float):
        self.ticks, self.fraction = divmod(delay_s / TICK_S, 1.0)
        self.past: deque[float] = deque(maxlen=int(self.ticks) + 2)

    def __call__(self, value: float) -> float:
        """The value as it was `delay_s` ago; the first one before there was any."""
        if not self.past:
            self.past.extend([value] * self.past.maxlen)
        self.past.append(value)
        return self.past[1] * (1.0 - self.fraction) + self.past[0] * self.fraction


class Lag:
    """First-order lag with an optional rate limit, exact over a tick."""

    def __init__(self, time_constant_s: float = 0.0, rate_per_s: float = math.inf):
        self.share = 1.0 - math.exp(-TICK_S / time_constant_s) if time_constant_s > 0.0 else 1.0
        self.step = rate_per_s * TICK_S
        self.value: float | None = None

    def __call__(self, target: float) -> float:
        """Output after one tick towards the target; starts at the first target."""
        if self.value is None:
            self.value = target
        move = self.share * (target - self.value)
        self.value += min(max(move, -self.step), self.step)
        return self.value


class Backlash:
    """Play: the output follows once the input has crossed the gap."""

    def __init__(self, half_width: float):
        self.half_width = half_width
        self.value: float | None = None

    def __call__(self, target: float) -> float:
        """Output dragged along by the input."""
        if self.value is None:
            self.value = target
        self.value = min(max(self.value, target - self.half_width), target + self.half_width)
        return self.value


class CommandPath:
    """Commands in, disturbed commands out, one call a tick."""

    def __init__(self, injection: dict):
        get = injection.get
        self.injection = injection
        self.steer_stages = [
            Delay(get("st_delay", 0.0)),
            Lag(get("st_lag", 0.0), get("st_rate", math.inf)),
            Backlash(get("st_backlash", 0.0)),
        ]
        self.speed_stages = [
            Delay(get("v_delay", 0.0)),
            Lag(get("v_lag", 0.0)),
            Lag(0.0, get("v_acc", math.inf)),
        ]
        self.kept = (0.0, 0.0)

    def __call__(
        self, time_s: float, speed_mps: float, steer_rad: float, true_speed_mps: float
    ) -> tuple[float, float]:
        """Commands as the plant receives them; `true_speed_mps` scales what depends on speed."""
        speed_mps, steer_rad = self._dropped_out(time_s, speed_mps, steer_rad)
        return self._speed(time_s, speed_mps), self._steer(time_s, steer_rad, true_speed_mps)

    def _dropped_out(self, time_s: float, speed_mps: float, steer_rad: float) -> tuple[float, float]:
        """Repeats the last commands during the last `drop_len` of every `drop_period` seconds."""
        period = self.injection.get("drop_period")
        if period is None or time_s % period < period - self.injection["drop_len"]:
            self.kept = (speed_mps, steer_rad)
        return self.kept

    def _steer(self, time_s: float, steer: float, true_speed_mps: float) -> float:
        get = self.injection.get
        steer *= get("st_gain", 1.0) * (get("st_gain_left", 1.0) if steer > 0.0 else 1.0)
        steer /= 1.0 + get("st_uspeed", 0.0) * true_speed_mps**2
        steer += get("st_bias", 0.0) + get("st_drift", 0.0) * max(time_s, 0.0)
        steer += get("st_wobble", 0.0) * math.sin(2 * math.pi * get("wobble_hz", 0.0) * time_s)
        quantum = get("st_quantum", 0.0)
        steer = quantum * round(steer / quantum) if quantum else steer
        for stage in self.steer_stages:
            steer = stage(steer)
        return steer

    def _speed(self, time_s: float, speed: float) -> float:
        get = self.injection.get
        speed = 0.0 if abs(speed) < get("v_deadband", 0.0) else speed
        speed *= get("v_scale", 1.0) * (1.0 - get("v_sag", 0.0) * max(time_s, 0.0))
        for stage in self.speed_stages:
            speed = stage(speed)
        return speed
