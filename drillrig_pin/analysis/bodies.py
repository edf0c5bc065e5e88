"""Where the elements of a model sit: which links move as one body, and what holds the body that touches the rock."""

from __future__ import annotations

from collections.abc import Iterator

from drillrig_pin.model.modelfile import ModelFile
from drillrig_pin.model.nodes import Node


class Bodies:
    """Links of a model that fixed joints make one body, and the points on them.

    A body is named for its link nearest to the root.
    """

    def __init__(self, file: ModelFile) -> None:
        self._above: dict[str, tuple[str, bool]] = {}
        for joint in file.root.named("joint"):
            parent, child = (self._link(joint, end) for end in ("parent", "child"))
            self._above[child] = parent, joint.attributes.get("type") == "fixed"
        points = (node for node in file.elements() if node.tag == "point")
        self._points = {node.attributes.get("name", ""): node.attributes.get("link", "") for node in points}
        links = [link.attributes.get("name", "") for link in file.root.named("link")]
        self.ground = next((link for link in links if link not in self._above), "")

    @staticmethod
    def _link(joint: Node, end: str) -> str:
        return next((node.attributes.get("link", "") for node in joint.named(end)), "")

    def of(self, point: str) -> str | None:
        """Body a point is on; None for a point the model does not have."""
        return self._body(self._points[point]) if point in self._points else None

    def apart(self, upper: str, lower: str) -> int | None:
        """How many moving joints lie between a point and one that it carries; None if it does not carry it."""
        goal, at = self.of(upper), self.of(lower)
        if goal is None or at is None or goal == self.ground:
            return None
        for count, body in enumerate(self._upwards(at)):
            if body == goal:
                return count
        return None

    def _upwards(self, body: str) -> Iterator[str]:
        yield body
        while body in self._above:
            body = self._body(self._above[body][0])
            yield body

    def _body(self, link: str) -> str:
        while link in self._above and self._above[link][1]:
            link = self._above[link][0]
        return link


def ties(file: ModelFile, tip: str) -> tuple[str, ...]:
    """Constraints that hold the body of a contact's point to the ground, in words: ``hold face (y z of E)``.

    They go on acting while the tip is off the face.
    """
    bodies, found = Bodies(file), []
    body = bodies.of(tip)
    for node in file.elements():
        name = node.attributes.get("name", "")
        if node.tag == "hold" and bodies.of(node.attributes.get("point", "")) == body:
            found.append(f"hold {name} ({node.attributes.get('axes', '')} of {node.attributes.get('point', '')})")
        elif node.tag == "loop":
            ends = {bodies.of(node.attributes.get(end, "")) for end in ("from", "to")}
            if ends == {body, bodies.ground}:
                found.append(f"loop {name}")
    return tuple(found)


def placed(file: ModelFile, tips: list[str]) -> dict[str, str]:
    """What every constraint element of the model is: ``tip`` (a hold on the body of a tip), ``hold`` or ``loop``."""
    bodies = Bodies(file)
    touching = {bodies.of(tip) for tip in tips}
    found = {}
    for node in file.elements():
        if node.tag in ("hold", "loop"):
            at_tip = node.tag == "hold" and bodies.of(node.attributes.get("point", "")) in touching
            found[node.attributes.get("name", "")] = "tip" if at_tip else node.tag
    return found
