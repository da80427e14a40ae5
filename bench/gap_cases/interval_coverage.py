"""How often the intervals of diagnoses hold the truth, effect by effect.

    interval_coverage.py LABELS:ANSWERS ...

ANSWERS are those that `surefoot gap score` keeps in its output. Of every single effect that was announced rightly, the
parameters that the label has as the catalogue has them are compared; of limits their logarithms. The last column tells by
which factor intervals would have to be wider or narrower to hold nine of ten (split conformal prediction); groups are those
of `sim_to_real/src/intervals.rs`.
"""

import json
import math
import sys
from collections import defaultdict
from pathlib import Path

# What labels call the parameters of the catalogue; what they only call alike is left out.
PARAMETERS = {
    ("accel_limit", "acceleration_mps2"): ("limit_mps2", "limit_m_s2"),
    ("backlash", "half_width_rad"): ("half_width_rad",),
    ("friction", "mu"): ("mu",),
    ("gyro_bias", "bias_radps"): ("bias_radps", "bias_rad_s"),
    ("mass", "ratio"): ("ratio",),
    ("motor_deadband", "speed_mps"): ("threshold_mps",),
    ("odom_scale", "ratio"): ("ratio",),
    ("pose_latency", "age_s"): ("latency_s",),
    ("quad_drag", "coefficient_per_m"): ("drag_pm", "k_1_m"),
    ("rolling_drag", "deceleration_mps2"): ("drag_mps2", "a_m_s2"),
    ("slope_gravity", "share"): ("extra", "factor"),
    ("speed_delay", "delay_s"): ("delay_s",),
    ("speed_lag", "time_constant_s"): ("time_constant_s",),
    ("speed_scale", "ratio"): ("ratio",),
    ("steer_bias", "angle_rad"): ("bias_rad",),
    ("steer_delay", "delay_s"): ("delay_s",),
    ("steer_gain", "ratio"): ("ratio",),
    ("steer_lag", "time_constant_s"): ("time_constant_s",),
    ("steer_rate", "rate_radps"): ("rate_radps", "rate_rad_s"),
    ("understeer", "gradient_s2_per_m2"): ("k_s2pm2", "K_s2_m2"),
    ("veg_drag", "deceleration_mps2"): ("drag_mps2", "a_m_s2"),
    ("yaw_misalign", "angle_rad"): ("angle_rad",),
}
LIMITS = {"accel_limit", "steer_rate", "friction"}
GROUPS = {
    "command": {
        *("steer_delay", "steer_gain", "steer_bias", "backlash", "steer_rate", "steer_lag"),
        *("speed_delay", "motor_deadband", "speed_scale", "speed_lag", "accel_limit"),
    },
    "body": {"understeer", "friction", "mass", "rolling_drag", "quad_drag", "veg_drag", "slope_gravity"},
    "sensors": {"pose_latency", "odom_scale", "gyro_bias", "yaw_misalign"},
}


def told(label: dict, effect: str, parameter: str, found: float) -> float | None:
    """The truth as the label tells it; one that tells sizes alone has the sign of what was found."""
    own = label["parameters"].get(effect, {})
    if (effect, parameter) == ("mass", "ratio") and "added_ratio" in own:
        return 1.0 + own["added_ratio"]
    truth = next((own[name] for name in PARAMETERS.get((effect, parameter), ()) if name in own), None)
    if truth is None or "made" not in own:
        return truth
    neutral = 1.0 if parameter == "ratio" else 0.0
    return neutral + math.copysign(truth, found - neutral)


def distance(effect: str, truth: float, estimate: dict[str, float]) -> float:
    """Of the truth from the estimate, in halves of the interval on its side."""
    scaled = math.log if effect in LIMITS else float
    value, end = estimate["value"], estimate["high" if truth > estimate["value"] else "low"]
    if effect in LIMITS and min(truth, value, end) <= 0.0:
        return math.inf
    half = abs(scaled(end) - scaled(value))
    return abs(scaled(truth) - scaled(value)) / half if half > 0.0 else math.inf


def read(labels: Path, answers: Path) -> list[tuple[str, float]]:
    """Effects that were announced rightly, and how far off the worst of their parameters is."""
    found = []
    for name, label in json.loads(labels.read_text()).items():
        path = answers / f"{name}.json"
        if label["kind"] != "single" or label.get("zero_effect") or not path.exists():
            continue
        for named in json.loads(path.read_text())["effects"]:
            if named["id"] != label["effects"][0] or "form" in named:
                continue
            estimates = named["parameters"].items()
            pairs = [(told(label, named["id"], own, estimate["value"]), estimate) for own, estimate in estimates]
            off = [distance(named["id"], truth, estimate) for truth, estimate in pairs if truth is not None]
            found += [(named["id"], max(off))] if off else []
    return found


def row(name: str, off: list[float]) -> str:
    """One line of the table."""
    n = len(off)
    # The smallest of n that at least nine tenths of n + 1 do not exceed.
    place = math.ceil(0.9 * (n + 1)) - 1
    factor = f"{sorted(off)[place]:.2f}" if place < n else "-"
    inside = sum(distance <= 1.0 for distance in off)
    return f"| {name} | {inside}/{n} = {inside / n:.2f} | {factor} |"


def main() -> None:
    """Writes a table in Markdown."""
    found = [pair for given in sys.argv[1:] for pair in read(*map(Path, given.split(":")))]
    by_name: dict[str, list[float]] = defaultdict(list)
    for effect, off in found:
        by_name[effect].append(off)
    print("| | inside its 90 % interval | factor for 90 % |\n|---|---|---|")
    for group, effects in GROUPS.items():
        own = [off for effect in sorted(effects) for off in by_name.get(effect, [])]
        for effect in sorted(effects & by_name.keys()):
            print(row(f"`{effect}`", by_name[effect]))
        if own:
            print(row(f"**{group}**", own))
    print(row("**all**", [off for _, off in found]))


if __name__ == "__main__":
    main()
