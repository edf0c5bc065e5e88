"""Rank parameters by their indices, and say how far the ranking can be trusted."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from drillrig_pin.batch.importance import Index, Method

#: A parameter of less than this share of the first one's importance needs no place in the ranking.
LITTLE = 0.05
#: Nobody runs more blocks than this to tell two parameters apart.
MANY = 5000
#: Fewer blocks than this give a confidence that is none: a bootstrap of a handful of numbers knows no others.
FEW = 6
#: Fewer than this rank no more than what was looked at.
ENOUGH = 10
#: So many are customary.
USUAL = 16


def ranked(metric: str, unit: str, names: Sequence[str], rows: Sequence[dict[str, float]]) -> list[Index]:
    """Indices of one metric, most important first; of equal ones the first named."""
    key = "mu_star" if "mu_star" in rows[0] else "ST"
    order = sorted(range(len(names)), key=lambda i: -rows[i][key])
    found = []
    for rank, i in enumerate(order, 1):
        value, conf = rows[i][key], rows[i][f"{key}_conf"]
        separated = None
        if rank < len(order):
            below = rows[order[rank]]
            separated = value - conf > below[key] + below[f"{key}_conf"]
        index = Index(metric, unit, names[i], rank, value, conf, separated, value > conf, **rows[i])
        found.append(index)
    return found


def verdict(indices: Sequence[Index], method: Method, blocks: int) -> tuple[str, int | None]:
    """One sentence or two: whether the ranking can be trusted; and how many blocks would make it so, if that helps."""
    word = "trajectories" if method == "morris" else "samples"
    if blocks < FEW:
        return f"Not to be trusted: {blocks} {word} are too few to know how sure the indices are.", USUAL
    advised = None
    little = [index for index in indices if index.importance < LITTLE * indices[0].importance]
    close = [
        (above, below) for above, below in itertools.pairwise(indices) if not above.separated and above not in little
    ]
    if close:
        told = "; ".join(f"{short(above.parameter)} and {short(below.parameter)}" for above, below in close)
        sentence = f"Not separated, since their intervals overlap: {told}."
        advised = _advised(close, method, blocks)
        if advised is None:
            sentence += " They matter about equally: no affordable number of runs tells them apart."
        else:
            sentence += f" About {advised} {word} would tell them apart."
    elif len(indices) > 1:
        sentence = "The ranking can be trusted: the intervals do not overlap."
        if blocks < ENOUGH:
            sentence = (
                f"The intervals do not overlap, so the ranking can be trusted as far as {blocks} {word} go; "
                f"{ENOUGH} or more are customary."
            )
            advised = USUAL
    else:
        sentence = "There is one parameter, so nothing to rank."
    if little:
        names = ", ".join(short(index.parameter) for index in little)
        sentence += f" Of little matter, less than {100 * LITTLE:.0f} % of the first: {names}."
    return sentence, advised


def looked_at(method: Method, designs: int, levels: int) -> str:
    """What the indices and extremes rest on: the ranges were sampled, not searched."""
    where = f"{designs} designs at {levels} levels of every range" if method == "morris" else f"{designs} designs"
    return (
        f"Looked at: {where}. Between them a narrow peak, such as a resonance, may go unseen: the least and the "
        "greatest are those of these designs, not of the ranges."
    )


def short(name: str) -> str:
    """A varied name as people say it."""
    return name.removeprefix("model.").removeprefix("scenario.")


def _advised(close: Sequence[tuple[Index, Index]], method: Method, blocks: int) -> int | None:
    """How many blocks would separate them: confidence shrinks with the square root of their number."""
    needed = 0.0
    for above, below in close:
        gap = above.importance - below.importance
        reach = above.importance_conf + below.importance_conf
        needed = max(needed, blocks * (reach / gap) ** 2 if gap > 0 else math.inf)
    if needed > MANY:
        return None
    if method == "sobol":
        return max(1 << math.ceil(math.log2(needed)), 2 * blocks)
    return max(10 * math.ceil(needed / 10), blocks + 10)
