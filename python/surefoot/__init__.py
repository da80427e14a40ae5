"""A real-time local planner for ground vehicles that drive where there is no road.

Arrays go in, arrays come out; all work is done by the native module, without Python's lock. Lengths are metres, angles
radians, times seconds. Map frame: x east, y north, z up, yaw counter-clockwise from east. Grids have shape (row, col), row 0
in the south, column 0 in the west. The manual is docs/python.md.
"""

import os as _os

from surefoot import _native
from surefoot._native import (
    CostToGo,
    Decision,
    Defect,
    ElevationMap,
    Evidential,
    FuseReport,
    Model,
    Mppi,
    PhysicsPrior,
    RiskMap,
    Rollouts,
    SkidSteerModel,
    SkidSteerVehicle,
    Surface,
    Vehicle,
    settings_for,
)

__all__ = [
    "CostToGo",
    "Decision",
    "Defect",
    "ElevationMap",
    "Evidential",
    "FuseReport",
    "Model",
    "Mppi",
    "PhysicsPrior",
    "RiskMap",
    "Rollouts",
    "SkidSteerModel",
    "SkidSteerVehicle",
    "Surface",
    "Vehicle",
    "settings_for",
]

# A forked process has none of its parent's threads.
if hasattr(_os, "register_at_fork"):
    _os.register_at_fork(after_in_child=_native.note_fork)
