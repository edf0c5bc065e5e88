"""Joints that a model locks: which they are, where they stand, and the tree without them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any

import pinocchio as pin

from drillrig_pin.declarations import Lock, Pose
from drillrig_pin.errors import ModelError, Source, legal_names


def locked_positions(model: Any, locks: Iterable[tuple[Lock, Source]], first: Pose | None) -> dict[str, float]:
    """Position of every locked joint [rad or m], by name.

    Raises:
        ModelError: a pattern that is none or fits no moving joint, or a joint without exactly one dof.
    """
    names = list(model.names)[1:]
    posed = {entry.name: entry.position for entry in first.joints} if first is not None else {}
    found: dict[str, float] = {}
    for lock, source in locks:
        for pattern in lock.joints:
            try:
                chosen = matching(pattern, names)
            except ModelError as error:
                raise ModelError(f"<lock>: {error.what}", where=source, todo=error.todo) from None
            for name in chosen:
                if model.joints[model.getJointId(name)].nv != 1:
                    raise ModelError(
                        f"<lock>: joint {name!r} has more than one dof", where=source, todo="Make it a fixed joint."
                    )
                at = posed.get(name, (0.0,))[0] if lock.position is None else lock.position
                if found.setdefault(name, at) != at:
                    raise ModelError(f"<lock>: joint {name!r} is locked at two positions", where=source)
    return found


def matching(pattern: str, names: Sequence[str]) -> list[str]:
    """Joints that a name or a regular expression of whole names means; ModelError if it is none or fits none."""
    try:
        chosen = [name for name in names if name == pattern or re.fullmatch(pattern, name)]
    except re.error as error:
        raise ModelError(f"{pattern!r} is no regular expression ({error})") from None
    if not chosen:
        raise ModelError(f"no moving joint {pattern!r}", todo=legal_names(pattern, names, "joints"))
    return chosen


def without(model: Any, locked: dict[str, float]) -> Any:
    """The tree with these joints rigid where they stand."""
    if not locked:
        return model
    q = pin.neutral(model)
    for name, position in locked.items():
        q[model.joints[model.getJointId(name)].idx_q] = position
    return pin.buildReducedModel(model, [model.getJointId(name) for name in locked], q)
