"""Is every element and attribute of the URDF part one that is read, or known to be harmless: with file and line."""

from __future__ import annotations

from collections.abc import Iterator

from drillrig_pin.errors import legal_names, shown
from drillrig_pin.model.nodes import Node
from drillrig_pin.model.numbers import numbers
from drillrig_pin.model.problem import Problem
from drillrig_pin.model.urdf_table import ACTS_ELSEWHERE, ROBOT, Attribute, Element, Use, is_used
from drillrig_pin.model.xacro_words import XACRO_TAGS
from drillrig_pin.series import LARGEST

BLOCK = "drillrig"
#: Blocks for other programs in which a word that acts there is worth a warning.
_SIMULATORS = ("gazebo", "mujoco")


def check_table(root: Node) -> Iterator[Problem]:
    """Findings in file order; errors keep numbers that act from being read, warnings name what is left out."""
    yield from _element(root, ROBOT, "robot")


def _element(node: Node, known: Element, path: str) -> Iterator[Problem]:
    yield from _attributes(node, known)
    yield from _text(node, known)
    if node.tag == "geometry" and len(node.children) > 1:
        others = ", ".join(f"<{child.tag}>" for child in node.children[1:])
        yield Problem(
            "warning",
            f"<geometry> holds more than one shape: {others} is ignored",
            node.source,
            "Write a <visual> for each.",
        )
    seen: dict[str, Node] = {}
    for child in node.children:
        spec = known.children.get(child.tag)
        if child.tag == BLOCK and node.tag != "robot":
            yield _misplaced(child)
        elif spec is None:
            yield _unknown(child, node, known)
            yield from _blocks_below(child)
            continue
        if spec is None:
            continue
        if child.tag in seen and not spec.many:
            yield Problem(
                "warning",
                f"a second <{child.tag}> in {_label(node)} is ignored, the first stands at {seen[child.tag].source}",
                child.source,
                "Keep one.",
            )
        elif spec.open:
            yield from _open(child)
        elif node.tag != "joint" or is_used(spec, node.attributes.get("type", "")):
            yield from _element(child, spec, f"{path}/{child.tag}")
        seen.setdefault(child.tag, child)


def _attributes(node: Node, known: Element) -> Iterator[Problem]:
    for name, text in node.attributes.items():
        attribute = known.attributes.get(name)
        if attribute is not None:
            yield from _value(node, name, text, attribute)
        elif name.partition(":")[0] != "xmlns":
            yield Problem(
                "warning",
                f"{_label(node)} has no attribute {name!r}, it is ignored",
                node.source,
                legal_names(name, known.attributes, "attributes"),
            )
    for name, attribute in known.attributes.items():
        if attribute.required and name not in node.attributes and name != "name":
            bare = numbers(node.text) if node.text else None
            value = f' Write <{node.tag} {name}="{node.text}"/>.' if bare is not None else ""
            yield Problem(
                _severity(attribute), f"{_label(node)} lacks the attribute {name!r}", node.source, value.strip()
            )


def _value(node: Node, name: str, text: str, attribute: Attribute) -> Iterator[Problem]:
    if not attribute.count or attribute.use is Use.IGNORED:
        return
    severity = _severity(attribute)
    if not text.strip():
        if name == "rpy":
            # What exporters write for "no rotation"; an empty position or mass is more likely a slip.
            yield Problem("warning", f"{_label(node)} rpy is empty and read as 0 0 0", node.source)
        else:
            yield Problem(severity, f"{_label(node)} {name} is empty", node.source, _wanted(attribute))
        return
    values = numbers(text)
    if values is None:
        word = next(word for word in text.split() if numbers(word) is None)
        advice = "Write the decimal point as a point." if numbers(word.replace(",", ".")) is not None else ""
        many = "a finite number" if attribute.count == 1 else "made of finite numbers"
        yield Problem(severity, f"{_label(node)} {name} = {shown(text)} is not {many}", node.source, advice)
    elif node.tag != "limit" and any(abs(value) > LARGEST for value in values):
        # A limit beyond all bounds is how some exporters write that there is none.
        words = f"{_label(node)} {name} = {shown(text)} is beyond {LARGEST:g}, larger than any number of a machine"
        yield Problem(severity, words, node.source)
    elif len(values) != attribute.count:
        counted = f"{len(values)} number{'s' if len(values) > 1 else ''}"
        yield Problem(
            severity,
            f"{_label(node)} {name} = {shown(text)} holds {counted}, not {attribute.count}",
            node.source,
            _wanted(attribute),
        )


def _severity(attribute: Attribute) -> str:
    """A fault of looks never keeps a machine from running."""
    return "error" if attribute.use is Use.READ else "warning"


def _wanted(attribute: Attribute) -> str:
    return f"It takes {attribute.count} number{'s' if attribute.count > 1 else ''}: {attribute.text}."


def _text(node: Node, known: Element) -> Iterator[Problem]:
    if node.text and not any(a.required and n not in node.attributes for n, a in known.attributes.items()):
        text = " ".join(node.text.split())
        yield Problem(
            "warning", f"the text {shown(text)} inside {_label(node)} is ignored", node.source, "Write attributes."
        )


def _unknown(child: Node, parent: Node, known: Element) -> Problem:
    where = f"in {_label(parent)}" if parent.tag != "robot" else "below <robot>"
    if child.tag in XACRO_TAGS:
        advice = f"Write xacro:{child.tag}, in a file named *.xacro."
    elif place := _home(child.tag, ROBOT):
        advice = f"It belongs into <{place}>."
        if any(child.tag == tag for tag in known.children):
            advice = ""
    else:
        advice = legal_names(child.tag, known.children, "elements")
    return Problem("warning", f"unknown element <{child.tag}> {where} is ignored", child.source, advice)


def _home(tag: str, element: Element) -> str:
    """Tag of the elements that hold elements with this tag, if there is just one such."""
    homes: set[str] = set()
    todo = [("robot", element)]
    while todo:
        name, current = todo.pop()
        if tag in current.children:
            homes.add(name)
        todo += list(current.children.items())
    return homes.pop() if len(homes) == 1 else ""


def _open(node: Node) -> Iterator[Problem]:
    """A block for another program, or a drillrig block: nothing of ours may hide in it."""
    if node.tag == BLOCK:
        for inner in _all_below(node):
            if inner.tag == BLOCK:
                yield _misplaced(inner)
        return
    for inner in _all_below(node):
        if inner.tag == BLOCK:
            yield _misplaced(inner)
        elif node.tag in _SIMULATORS and inner.tag in ACTS_ELSEWHERE and _acts(inner, node):
            yield Problem(
                "warning",
                f"<{inner.tag}> in <{node.tag}> acts only in that program and is ignored",
                inner.source,
                ACTS_ELSEWHERE[inner.tag],
            )


def _acts(inner: Node, block: Node) -> bool:
    """Whether what stands in a block of another simulator changes the motion there, and is not a word of a plugin."""
    if inner.tag == "joint":
        return "type" in inner.attributes
    if inner.tag == "gravity":
        return inner in block.children and inner.text.lower() in ("0", "false")
    return not (inner.tag == "turnGravityOff" and inner.text.lower() in ("0", "false"))


def _blocks_below(node: Node) -> Iterator[Problem]:
    return (_misplaced(inner) for inner in _all_below(node) if inner.tag == BLOCK)


def _misplaced(block: Node) -> Problem:
    held = ", ".join(f"<{child.tag}>" for child in block.children[:3])
    return Problem(
        "error",
        f"a <{BLOCK}> block{f' with {held}' if held else ''} does not stand directly below <robot>",
        block.source,
        "Move it there: nothing of it would be read.",
    )


def _all_below(node: Node) -> Iterator[Node]:
    todo = list(reversed(node.children))
    while todo:
        inner = todo.pop()
        yield inner
        todo += reversed(inner.children)


def _label(node: Node) -> str:
    name = node.attributes.get("name")
    return f"<{node.tag} {name!r}>" if name else f"<{node.tag}>"
