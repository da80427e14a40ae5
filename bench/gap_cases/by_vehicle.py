"""Right answers of a set over the cases whose effect shows in the drives, with intervals over vehicles.

    by_vehicle.py LABELS ANSWERS

ANSWERS are those that `surefoot gap score` keeps in its output. Cases of one vehicle stand and fall together, so that an
interval is that of 95 % of 4000 draws of as many vehicles, with replacement. A case in which nothing happens counts as none.
"""

import json
import random
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

N_DRAWS = 4000
VISIBLE = 1.0


class Case(NamedTuple):
    """A label and its answer."""

    vehicle: str
    kind: str
    truth: list[str]
    announced: list[str]
    credible: list[str]
    is_unknown: bool
    is_expressible: bool


def read(labels: Path, answers: Path) -> list[Case]:
    """Cases that have an answer and whose effect shows."""
    cases = []
    for name, label in json.loads(labels.read_text()).items():
        path = answers / f"{name}.json"
        kind = "none" if label.get("zero_effect") else label["kind"]
        if path.exists() and (kind == "none" or (label.get("visible_in_train") or 0.0) >= VISIBLE):
            answer = json.loads(path.read_text())
            announced = [effect["id"] for effect in answer["effects"]]
            said = (announced, answer["credible_set"], "unknown" in answer["verdict"])
            cases.append(Case(label["vehicle"], kind, label["effects"], *said, bool(label.get("expressible"))))
    return cases


def rows(cases: list[Case]) -> dict[str, tuple[list[Case], Callable[[Case], bool]]]:
    """What is counted: of which cases, and what is a hit."""

    def of(kind: str) -> list[Case]:
        return [case for case in cases if case.kind == kind]

    strange = [case for case in of("unknown") if not case.is_expressible]
    return {
        "single effect, announced first": (of("single"), lambda c: c.announced[:1] == c.truth),
        "credible set holds it": (of("single"), lambda c: c.truth[0] in c.credible),
        "exactly, and nothing unknown": (of("single"), lambda c: c.announced == c.truth and not c.is_unknown),
        "silence": (of("single"), lambda c: not c.announced),
        "pair, both announced": (of("pair"), lambda c: set(c.announced) == set(c.truth)),
        "nothing added, an effect announced": (of("none"), lambda c: bool(c.announced)),
        "unknown that no effect can stand for, flagged": (strange, lambda c: c.is_unknown),
    }


def interval(cases: list[Case], hit: Callable[[Case], bool]) -> tuple[float, float]:
    """2.5 and 97.5 % of the share over draws of vehicles."""
    vehicles = sorted({case.vehicle for case in cases})
    counts = {v: (sum(hit(c) for c in cases if c.vehicle == v), sum(c.vehicle == v for c in cases)) for v in vehicles}
    generator = random.Random(0)
    shares = []
    for _ in range(N_DRAWS):
        drawn = [counts[v] for v in generator.choices(vehicles, k=len(vehicles))]
        shares.append(sum(n_hit for n_hit, _ in drawn) / sum(n for _, n in drawn))
    shares.sort()
    return shares[int(0.025 * N_DRAWS)], shares[int(0.975 * N_DRAWS)]


def main() -> None:
    """Writes a table in Markdown."""
    cases = read(Path(sys.argv[1]), Path(sys.argv[2]))
    print("| | of all | interval over vehicles |\n|---|---|---|")
    for name, (counted, hit) in rows(cases).items():
        if counted:
            low, high = interval(counted, hit)
            n_hit = sum(map(hit, counted))
            print(f"| {name} | {n_hit}/{len(counted)} = {n_hit / len(counted):.2f} | {low:.2f} to {high:.2f} |")
    sizes = [len(case.credible) for case in cases if case.kind == "single"]
    print(f"| names in the credible set, mean | {sum(sizes) / max(len(sizes), 1):.2f} | |")


if __name__ == "__main__":
    main()
