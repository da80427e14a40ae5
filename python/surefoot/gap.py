"""Why simulator and robot disagree: where, which effect, how far, what next."""

from surefoot._native import GapReport, GroundReport, apply, diagnose, ground, manoeuvre

__all__ = ["GapReport", "GroundReport", "apply", "diagnose", "ground", "manoeuvre"]
