"""The planner's parts in their usual order, for who drives with them as they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

from surefoot._native import (
    CostToGo,
    Decision,
    ElevationMap,
    Evidential,
    Mppi,
    PhysicsPrior,
    RiskMap,
    SkidSteerVehicle,
    Surface,
    Vehicle,
    settings_for,
)

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class Planner:
    """Ground to command: a risk map around the vehicle, the least time to the goal over it, and the controller.

    vehicle: `Vehicle` or `SkidSteerVehicle`. judge: `Evidential` or `PhysicsPrior`; without it the physics prior judges, at the
    share of the worst outcomes `cvar_level`. settings: as `settings_for(vehicle)` takes them. After a decision `risk_map`
    and `field` are what it was made of, and `controller` tells its rollouts.
    """

    def __init__(
        self,
        vehicle: Vehicle | SkidSteerVehicle,
        judge: Evidential | PhysicsPrior | None = None,
        settings: Mapping[str, Any] | str | PathLike[str] | None = None,
        *,
        cvar_level: float = 0.6,
        seed: int = 1,
    ) -> None:
        settings = settings_for(vehicle, settings)
        window = settings["risk_map"]
        self.judge = judge or PhysicsPrior(vehicle, settings, cvar_level=cvar_level)
        self.field = CostToGo(vehicle.model(), window["n_rows"], window["n_cols"], settings["cost_to_go"])
        self.controller = Mppi(vehicle.model(), settings["controller"], seed=seed)
        self.risk_map: RiskMap | None = None

    def decide(
        self,
        state: Sequence[float] | NDArray[np.float64],
        ground: ElevationMap | Surface | None,
        goal_m: Sequence[float] | NDArray[np.float64],
        tolerance_m: float = 0.5,
    ) -> Decision:
        """What to do now to reach the goal: a `Decision`.

        ground: an `ElevationMap` or a `Surface`, or None where it is as it was at the last decision, and so are goal and
        tolerance.
        """
        if ground is not None:
            self.risk_map = self.judge.judge(ground, centre_m=state[:2])
            self.field.update(self.risk_map, goal_m, tolerance_m)
        elif self.risk_map is None:
            raise ValueError("ground: expected an ElevationMap or a Surface for the first decision, found None")
        return self.controller.decide(
            state, self.risk_map, goal_m, tolerance_m=tolerance_m, cost_to_go=self.field
        )
