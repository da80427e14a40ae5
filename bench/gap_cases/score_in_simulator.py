"""How often a simulator in the loop names what was changed in it: counts with 95 % Wilson intervals, for sets by name.

    python3 score_in_simulator.py LABELS ANSWERS [LABELS ANSWERS ...]

LABELS are those of in_simulator_sets.py, ANSWERS the folder with NAME.json of `surefoot gap diagnose --simulator`. Cases
without an answer are told and not counted.
"""

import json
import math
import sys
from pathlib import Path
from statistics import median
from typing import NamedTuple

NORMAL_95 = 1.96


class Case(NamedTuple):
    """A label and what the simulator said."""

    name: str
    truth: list[str]
    visible: float
    causes: list[str]
    not_told_apart: list[str]
    verdict: str
    closed: float | None
    inside: list[bool]
    """Whether the 90 % interval that is told of what was changed holds its value; empty where it was not named."""


def holds(found: dict, value: float) -> bool:
    """Whether an interval holds a value; one that could not be told is null."""
    return found["low"] is not None and found["high"] is not None and found["low"] <= value <= found["high"]


def read(labels: Path, answers: Path) -> list[Case]:
    """Cases that have an answer."""
    cases = []
    for name, label in json.loads(labels.read_text()).items():
        path = answers / f"{name}.json"
        if path.exists():
            said = json.loads(path.read_text())["in_simulator"]
            causes = [cause["name"] for cause in said["causes"]]
            own = [cause["found"] for cause in said["causes"] if cause["name"] in label["effects"]]
            inside = [holds(found, label["value"]) for found in own]
            told = (causes, said["not_told_apart"], said["verdict"], said["shrink"].get("closed"), inside)
            cases.append(Case(name, label["effects"], label["visible_in_train"], *told))
        else:
            print(f"{name}: no answer", file=sys.stderr)
    return cases


def share(n_hit: int, n: int) -> str:
    """A count with its Wilson interval."""
    if n == 0:
        return "0/0"
    middle = (n_hit + NORMAL_95**2 / 2) / (n + NORMAL_95**2)
    half = NORMAL_95 * math.sqrt(n_hit * (n - n_hit) / n + NORMAL_95**2 / 4) / (n + NORMAL_95**2)
    return f"{n_hit}/{n} = {n_hit / n:.2f} ({max(middle - half, 0.0):.2f} to {min(middle + half, 1.0):.2f})"


def rows(cases: list[Case]) -> dict[str, str]:
    """What is counted, by what it is called."""
    changed = [case for case in cases if case.truth]
    sound = [case for case in cases if not case.truth]
    closed = [case.closed for case in changed if case.closed is not None]
    inside = [is_inside for case in changed for is_inside in case.inside]
    first = sum(case.causes[:1] == case.truth for case in changed)
    among = sum(case.truth[0] in [*case.causes, *case.not_told_apart] for case in changed)
    return {
        "first name right": share(first, len(changed)),
        "named, or said to do as well": share(among, len(changed)),
        "that name alone": share(sum(case.causes == case.truth for case in changed), len(changed)),
        "silence": share(sum(not case.causes for case in changed), len(changed)),
        "something named where nothing was changed": share(sum(bool(case.causes) for case in sound), len(sound)),
        "value inside its 90 % interval": share(sum(inside), len(inside)),
        "gap closed, median": f"{median(closed):.2f} of {len(closed)}" if closed else "of 0",
    }


def main() -> None:
    """Writes a table in Markdown, then the cases that went wrong."""
    words = [Path(word) for word in sys.argv[1:]]
    cases = [case for labels, answers in zip(words[::2], words[1::2], strict=True) for case in read(labels, answers)]
    print("| | |\n|---|---|")
    for name, counted in rows(cases).items():
        print(f"| {name} | {counted} |")
    for case in cases:
        if case.causes != case.truth:
            beside = f", as well {case.not_told_apart}" if case.not_told_apart else ""
            print(f"{case.name}: {case.truth} ({case.visible} visible), said {case.verdict} {case.causes}{beside}")


if __name__ == "__main__":
    main()
