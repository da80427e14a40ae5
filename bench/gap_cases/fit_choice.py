"""What supports an effect for how much: the weights of the diagnosis's choice among effects and none, fitted to labels.

    fit_choice.py LABELS ANSWERS [LABELS ANSWERS]...

ANSWERS are those that `surefoot gap score` keeps in its output; their rankings tell what every single effect has for it. A
conditional logit (McFadden 1974) over the cases with one effect that shows, and those with none. Every kind of machine is
left out in turn as well, and its cases judged with the weights of the others: that is the table.
"""

import json
import math
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

VISIBLE = 1.0
# Pull of the weights towards 0, in squares per case.
PULL = 0.05
CREDIBLE = 0.85
MOST_NAMES = 4
ODDS = (1.0, 1.3, 2.0, 3.0, 5.0)


class Case(NamedTuple):
    """Effects that were in question and the true one: 0 for none, else its place from 1, -1 where it was not."""

    kind_of_machine: str
    names: list[str]
    features: np.ndarray
    truth: int


def features(support: dict[str, float]) -> list[float]:
    """As the diagnosis has them."""
    strength = math.log1p(support["strength"])
    weakest = math.log1p(support["least_strength"])
    return [math.sqrt(max(support["gain"], 0.0)), strength, weakest, support["nominal"]]


def read(labels: Path, answers: Path) -> list[Case]:
    """Cases with one effect that shows, or with none."""
    cases = []
    for name, label in json.loads(labels.read_text()).items():
        kind = "none" if label.get("zero_effect") else label["kind"]
        shows = (label.get("visible_in_train") or 0.0) >= VISIBLE
        path = answers / f"{name}.json"
        if path.exists() and (kind == "none" or (kind == "single" and shows)):
            ranked = [own for own in json.loads(path.read_text())["ranking"] if "support" in own]
            names = [own["id"] for own in ranked]
            true = label["effects"][0] if kind == "single" else None
            place = 0 if true is None else names.index(true) + 1 if true in names else -1
            machine = label.get("plant") or label["vehicle"]
            cases.append(Case(machine, names, np.array([features(own["support"]) for own in ranked]), place))
    return cases


def logits(weights: np.ndarray, case: Case) -> np.ndarray:
    """Of none, 0, and of every effect."""
    return np.concatenate([[0.0], weights[0] + case.features @ weights[1:]])


def probabilities(weights: np.ndarray, case: Case) -> np.ndarray:
    """Of none and of every effect."""
    odds = np.exp(logits(weights, case) - logits(weights, case).max())
    return odds / odds.sum()


def fitted(cases: list[Case]) -> np.ndarray:
    """The most probable weights; the first is that of an effect which nothing supports."""
    known = [case for case in cases if case.truth >= 0]

    def loss(weights: np.ndarray) -> tuple[float, np.ndarray]:
        total = PULL * float(weights[1:] @ weights[1:])
        slope = np.concatenate([[0.0], 2.0 * PULL * weights[1:]])
        for case in known:
            chance = probabilities(weights, case)
            total -= math.log(max(chance[case.truth], 1e-300))
            wrong = chance[1:] - (np.arange(1, len(chance)) == case.truth)
            slope += np.concatenate([[wrong.sum()], case.features.T @ wrong])
        return total / len(known), slope / len(known)

    return minimize(loss, np.zeros(cases[0].features.shape[1] + 1), jac=True, method="BFGS").x


def credible(chance: np.ndarray) -> list[int]:
    """Places of the names that hold the true one with `CREDIBLE`, if one of them is."""
    order = np.argsort(-chance[1:]) + 1
    held = np.cumsum(chance[order]) / chance[1:].sum()
    return list(order[: min(int(np.searchsorted(held, CREDIBLE)) + 1, MOST_NAMES)])


def judged(cases: list[Case]) -> list[tuple[Case, np.ndarray]]:
    """Every case with the weights of the other kinds of machine."""
    out = []
    for machine in sorted({case.kind_of_machine for case in cases}):
        weights = fitted([case for case in cases if case.kind_of_machine != machine])
        out += [(case, probabilities(weights, case)) for case in cases if case.kind_of_machine == machine]
    return out


def main() -> None:
    """Prints the weights and a table in Markdown."""
    paths = [Path(own) for own in sys.argv[1:]]
    cases = [case for pair in zip(paths[::2], paths[1::2], strict=True) for case in read(*pair)]
    print("weights:", np.round(fitted(cases), 2).tolist())
    left_out = judged(cases)
    singles = [(case, chance) for case, chance in left_out if case.truth != 0]
    nones = [chance for case, chance in left_out if case.truth == 0]
    sets = [(case.truth, credible(chance)) for case, chance in singles]
    first = sum(chance[1:].argmax() + 1 == case.truth for case, chance in singles)
    print(f"first of the ranking {first} of {len(singles)}, in the credible set {sum(t in s for t, s in sets)}", end="")
    print(f" of {sum(len(s) for _, s in sets) / len(sets):.2f} names\n")
    print("| odds over none | announced rightly | another announced | where nothing was added |\n|---|---|---|---|")
    for odds in ODDS:
        told = [(case, chance) for case, chance in singles if chance[1:].max() > odds * chance[0]]
        right = sum(chance[1:].argmax() + 1 == case.truth for case, chance in told)
        false = sum(chance[1:].max() > odds * chance[0] for chance in nones)
        print(f"| {odds} | {right}/{len(singles)} | {len(told) - right} | {false}/{len(nones)} |")


if __name__ == "__main__":
    main()
