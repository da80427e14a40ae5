"""A real-time local planner for ground vehicles that drive where there is no road.

Arrays go in, arrays come out; all work is done by the native module, without Python's lock. Lengths are metres, angles
radians, times seconds. Map frame: x east, y north, z up, yaw counter-clockwise from east. Grids have shape (row, col), row 0
in the south, column 0 in the west. The manual is docs/python.md.
"""

import os as _os

from surefoot import _native, gap
from surefoot._native import (
    CostToGo,
    Cycle,
    Dataset,
    Decision,
    Defect,
    Driver,
    ElevationMap,
    Evidential,
    FuseReport,
    Model,
    Mppi,
    Observations,
    PhysicsPrior,
    Pilot,
    PythonModel,
    Recording,
    RiskMap,
    Rollouts,
    Run,
    SampledRollouts,
    Simulation,
    SkidSteerModel,
    SkidSteerVehicle,
    Surface,
    Task,
    Training,
    Vehicle,
    attach,
    open,
    settings_for,
    step_together,
    train,
)
from surefoot._registration import register_with_gymnasium as _register_with_gymnasium
from surefoot.planner import Planner

__all__ = [
    "CostToGo",
    "Cycle",
    "Dataset",
    "Decision",
    "Defect",
    "Driver",
    "ElevationMap",
    "Evidential",
    "FuseReport",
    "Model",
    "Mppi",
    "Observations",
    "PhysicsPrior",
    "Pilot",
    "Planner",
    "PythonModel",
    "Recording",
    "RiskMap",
    "Rollouts",
    "Run",
    "SampledRollouts",
    "Simulation",
    "SkidSteerModel",
    "SkidSteerVehicle",
    "Surface",
    "Task",
    "Training",
    "Vehicle",
    "attach",
    "gap",
    "open",
    "settings_for",
    "step_together",
    "train",
]

# A forked process has none of its parent's threads.
if hasattr(_os, "register_at_fork"):
    _os.register_at_fork(after_in_child=_native.note_fork)

_register_with_gymnasium()
