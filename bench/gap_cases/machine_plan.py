"""Which cases make up a set of machines: five singles, a pair, an unknown and two nones of each kind."""

import math
from dataclasses import dataclass, field

import numpy as np

from machine_drive import failure, run, visibility
from machine_drivers import POOR, RICH
from machine_effects import CATALOGUE, UNKNOWN, VISIBILITY, Addition, applicable, draw_turn, find_strength, size_of
from machine_types import added
from set_files import seed_of

SINGLES, PAIRS, UNKNOWNS, NONES = 5, 1, 1, 2
OUTLIERS_SHARE, HIDDEN = 0.1, 0.02
DRIVES = ["real_train_1", "real_train_2", "real_heldout"]
ATTEMPTS = 15


@dataclass
class Case:
    """One case before it is driven: who drives what, and what was added."""

    vehicle: object
    kind: str
    style: str
    habits: list[str]
    key: str
    outliers: bool
    magnitude: str = "-"
    values: dict = field(default_factory=dict)
    effects: list[str] = field(default_factory=list)
    parameters: dict = field(default_factory=dict)

    @property
    def slides(self) -> bool:
        """Whether sliding is what was added."""
        return bool({"friction", "unk_mufade"} & set(self.effects))

    @property
    def more(self) -> np.ndarray:
        """What was added."""
        return added(self.values)


class Deck:
    """Cards that are dealt evenly: each comes once before any comes twice."""

    def __init__(self, cards: list[str], generator: np.random.Generator):
        self.all, self.generator, self.left = cards, generator, []

    def deal(self, fits) -> str:
        """The next card that fits."""
        for _ in range(3):
            for card in self.left:
                if fits(card):
                    self.left.remove(card)
                    return card
            self.left += [str(card) for card in self.generator.permutation(self.all)]
        raise LookupError("no card fits")


class Planner:
    """Draws the cases of a set, kind by kind."""

    def __init__(self, set_name: str):
        self.set_name = set_name
        self.generator = np.random.default_rng(seed_of(set_name, "plan"))
        self.singles, self.unknowns = Deck(list(CATALOGUE), self.generator), Deck(list(UNKNOWN), self.generator)
        self.sizes, self.styles = Deck(["s", "m", "l"], self.generator), Deck(["rich", "rich", "poor"], self.generator)

    def _case(self, vehicle, kind: str, key: str, effects: list[str]) -> Case:
        style = self.styles.deal(lambda card: True)
        style = "rich" if {"friction", "unk_mufade"} & set(effects) else style
        habits = RICH if style == "rich" else [*POOR, POOR[self.generator.integers(2)]]
        habits = [str(habit) for habit in self.generator.permutation(habits)[:3]]
        outliers = self.generator.uniform() < OUTLIERS_SHARE
        return Case(vehicle, kind, style, habits, key, bool(outliers))

    def _reference(self, case: Case) -> tuple[str, list[int]]:
        """The drive that strengths are measured on: the first one, or a rich one where driving is poor."""
        if case.style == "rich":
            return case.habits[0], [seed_of(self.set_name, case.key, DRIVES[0]), 0]
        return RICH[self.generator.integers(2)], [seed_of(self.set_name, case.key, "reference"), 0]

    def _add(self, case: Case, name: str, addition: Addition, size: str) -> bool:
        """Adds an effect of a visibility to a case, a smaller one where that is out of reach."""
        turn, (habit, seed) = draw_turn(self.generator), self._reference(case)
        for smaller in "lms"["lms".index(size) :]:
            found = find_strength(addition, VISIBILITY[smaller], case.vehicle, turn, habit, seed)
            if found is not None:
                made = addition.make(found[0], turn, case.vehicle)
                case.values |= made
                case.effects.append(name)
                case.parameters[name] = {addition.parameter: found[0], "made": made, "reference_visibility": found[1]}
                case.magnitude = min([case.magnitude, size_of(found[1])], key="lms-".index)
                return True
        return False

    def _with(self, vehicle, kind: str, key: str, count: int) -> Case:
        """A case of one or two effects; effects that do not show on this vehicle give way to others."""
        deck, catalogue = (self.unknowns, UNKNOWN) if kind == "unknown" else (self.singles, CATALOGUE)
        while True:
            names: list[str] = []
            for _ in range(count):
                groups = {catalogue[name].group for name in names}
                names.append(deck.deal(lambda n, g=groups: applicable(n, vehicle) and catalogue[n].group not in g))
            case = self._case(vehicle, kind, key, names)
            size = self.sizes.deal(lambda card: card != "s" or count == 1)
            if all(self._add(case, name, catalogue[name], size) for name in names):
                return case

    def cases_of(self, vehicle) -> list[Case]:
        """The cases of one vehicle."""
        kinds = ["single"] * SINGLES + ["pair"] * PAIRS + ["unknown"] * UNKNOWNS + ["none"] * NONES
        cases = []
        for number, kind in enumerate(kinds):
            key = f"{vehicle.kind.name}_{number}"
            none = kind == "none"
            case = self._case(vehicle, kind, key, []) if none else self._with(vehicle, kind, key, 1 + (kind == "pair"))
            cases.append(case)
        return cases


def survived(vehicle, habit: str, more: np.ndarray, name: list[str], slides: bool):
    """The first drive that is of use, and its seed."""
    for attempt in range(ATTEMPTS):
        seed = [seed_of(*name), attempt]
        truth = run(vehicle, habit, more, seed)
        reason = failure(vehicle, truth, slides)
        if reason is None:
            return truth, seed
        print(f"  {vehicle.kind.name} {'/'.join(name)} {habit} attempt {attempt}: {reason}", flush=True)
    return None


def drive_checks(case: Case, habit: str, truth, seed: list[int]) -> dict:
    """How visible the addition is on a drive, and what it changed against the same drive without it."""
    seen, where = visibility(case.vehicle, truth, case.more)
    replay = run(case.vehicle, habit, added({}), seed)
    apart = float(np.abs(replay.log - truth.log).max())
    sensor = any(name in case.effects for name in SENSOR_ADDITIONS)
    return {
        "visibility": round(seen, 2),
        "where": where,
        "replay_apart": round(apart, 4) if math.isfinite(apart) else None,
        "same_as_none": apart == 0.0 and not sensor or seen < HIDDEN,
        "habit": habit,
    }


SENSOR_ADDITIONS = ["pose_latency", "odom_scale", "gyro_bias", "yaw_misalign", "unk_gps", "unk_clock"]


def label(case: Case, checks: dict) -> dict:
    """The entry of labels.json."""
    lists = {**CATALOGUE, **UNKNOWN}
    none = case.kind == "none"
    entry = {
        "vehicle": case.vehicle.name,
        "plant": f"machine_{case.vehicle.kind.name}",
        "kind": case.kind,
        "effects": case.effects,
        "magnitude": case.magnitude,
        "style": case.style,
        "injection": {} if none else {"how": "; ".join(lists[name].how for name in case.effects)},
        "visible_in_train": None if none else max(checks[drive]["visibility"] for drive in DRIVES[:2]),
        "zero_effect": None if none else all(checks[drive]["same_as_none"] for drive in DRIVES),
        "outliers": case.outliers,
        "parameters": case.parameters,
        "checks": checks,
    }
    if case.kind == "unknown":
        addition = UNKNOWN[case.effects[0]]
        entry["unknown"] = {"kind": case.effects[0], "parameters": case.values}
        entry |= {"expressible": addition.expressible, "nearest": list(addition.nearest)}
    return entry
