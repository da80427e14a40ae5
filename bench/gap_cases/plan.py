"""Which cases make up which set."""

from dataclasses import dataclass

import numpy as np

from effects import EFFECTS, HARDER_FOR_FRICTION, MAGNITUDES, UNKNOWN, applicable, injection_of
from set_files import seed_of
from vehicles import VEHICLES

HELDOUT_BY_ANOTHER_DRIVER = 0.4
POOR_SHARE, TRACK_SHARE = 0.06, 0.05


@dataclass(frozen=True)
class SetPlan:
    """Vehicles of a set, the routes of its injections, and how many cases of each kind a vehicle gets."""

    vehicles: list[str]
    routes: list[str]
    singles: int
    nones: int
    pairs: int
    unknowns: int


SETS = {
    "tune_a": SetPlan(["saloon", "estate", "rover"], ["command"], 26, 6, 6, 6),
    "tune_b": SetPlan(["lorry", "coupe", "truck"], ["parts"], 26, 6, 6, 6),
    "tune_none": SetPlan(["saloon", "estate", "rover", "lorry", "coupe", "truck"], ["command"], 0, 4, 0, 0),
    "check_c": SetPlan(["roadster", "van", "buggy"], ["command", "parts"], 14, 7, 3, 3),
    "check_d": SetPlan(["hatchback", "pickup", "crawler"], ["command", "parts"], 14, 7, 3, 3),
}


@dataclass(frozen=True)
class Case:
    """One case: who drives what, and what was added."""

    vehicle: str
    kind: str
    effects: list[str]
    magnitude: str
    style: str
    heldout_style: str
    injection: dict

    def harder(self) -> float:
        """Factor on the lateral acceleration that the drivers ask for."""
        return HARDER_FOR_FRICTION[VEHICLES[self.vehicle].scale] if "friction" in self.effects else 1.0

    def label(self) -> dict:
        """The entry of labels.json."""
        return {
            "vehicle": self.vehicle,
            "plant": VEHICLES[self.vehicle].plant,
            "kind": self.kind,
            "effects": self.effects,
            "magnitude": self.magnitude,
            "style": self.style,
            "injection": self.injection,
        }


class _Planner:
    """Draws the cases of one vehicle in one set."""

    def __init__(self, set_name: str, vehicle: str):
        self.plan, self.vehicle = SETS[set_name], VEHICLES[vehicle]
        self.generator = np.random.default_rng(seed_of(set_name, vehicle))
        self.applicable = applicable(self.vehicle)

    def _style(self, effects: list[str]) -> str:
        if "friction" in effects:
            return "rich"
        draw = self.generator.uniform()
        return "poor" if draw < POOR_SHARE else "track" if draw < POOR_SHARE + TRACK_SHARE else "rich"

    def _case(self, kind: str, effects: list[str], magnitude: str, injection: dict) -> Case:
        style = self._style(effects)
        other = style == "rich" and self.generator.uniform() < HELDOUT_BY_ANOTHER_DRIVER
        heldout = "track" if other and "friction" not in effects else style
        return Case(self.vehicle.name, kind, effects, magnitude, style, heldout, injection)

    def _injection(self, effects: list[str], magnitude: str) -> dict:
        route = self.generator.choice(self.plan.routes)
        parts = [injection_of(name, magnitude, self.vehicle, route, self.generator) for name in effects]
        return {key: value for part in parts for key, value in part.items()}

    def singles(self) -> list[Case]:
        """Every effect once, then some again; magnitudes take turns."""
        names = list(self.generator.permutation(self.applicable))
        names = [str(name) for name in (names * 2)[: self.plan.singles]]
        sizes = [MAGNITUDES[(i + self.generator.integers(3)) % 3] for i in range(len(names))]
        return [
            self._case("single", [name], size, self._injection([name], size))
            for name, size in zip(names, sizes, strict=True)
        ]

    def pairs(self) -> list[Case]:
        """Two effects of different groups, both medium."""
        return [self._pair() for _ in range(self.plan.pairs)]

    def _pair(self) -> Case:
        usable = [name for name in self.applicable if name not in ("friction", "motor_deadband")]
        while True:
            names = [str(name) for name in self.generator.choice(usable, 2, replace=False)]
            if EFFECTS[names[0]].group != EFFECTS[names[1]].group:
                return self._case("pair", names, "m", self._injection(names, "m"))

    def unknowns(self) -> list[Case]:
        """Different causes that the catalogue does not name; a flat tyre needs four wheels on the ground."""
        usable = [name for name in UNKNOWN if name != "unk_flat_tyre" or self.vehicle.plant == "mujoco"]
        names = [str(name) for name in self.generator.permutation(usable)[: self.plan.unknowns]]
        return [self._case("unknown", [name], "m", UNKNOWN[name](self.vehicle, self.generator)) for name in names]

    def all_cases(self) -> list[Case]:
        """The vehicle's cases."""
        nones = [self._case("none", [], "-", {}) for _ in range(self.plan.nones)]
        return nones + self.singles() + self.pairs() + self.unknowns()


def cases_of(set_name: str) -> list[Case]:
    """All cases of a set in a shuffled order, so that any first part of them is a fair sample."""
    cases = [case for vehicle in SETS[set_name].vehicles for case in _Planner(set_name, vehicle).all_cases()]
    order = np.random.default_rng(seed_of(set_name, "order")).permutation(len(cases))
    return [cases[index] for index in order]
