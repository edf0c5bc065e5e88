"""Expressions of models, evaluated without Python's own ``eval``: what is not listed here cannot be done in one.

The text is parsed into Python's syntax tree, and every kind of node has a function of its own here: numbers and words,
arithmetic, comparisons, conditions, lists and dictionaries, comprehensions, and calls of what
:mod:`drillrig_pin.model.expression_functions` lists. Names with a leading ``__``, attributes of anything but
namespaces, tables, lists and words, assignments and statements do not exist. An expression becomes nested Python
functions once and is kept: a study expands the same model a thousand times. What it may cost is counted by
:class:`drillrig_pin.model.budget.Budget`.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from drillrig_pin.model.budget import ExpressionError, formatted, is_namespace, multiplied, power, printed, shifted
from drillrig_pin.model.expression_functions import Functions, Written
from drillrig_pin.model.expression_methods import attribute

#: Longer expressions nobody writes; the parser of Python exhausts its stack on absurd ones.
MAX_LENGTH = 20_000


@dataclass(slots=True)
class Scope:
    """What an expression is evaluated in: names, what may be called at what cost, variables of comprehensions."""

    names: Mapping[str, Any]
    functions: Functions
    inner: Mapping[str, Any] | None = None

    def look(self, name: str) -> Any:
        """The value of a name; NameError if there is none."""
        if self.inner is not None and name in self.inner:
            return self.inner[name]
        try:
            return self.names[name]
        except KeyError:
            raise NameError(f"name {name!r} is not defined") from None

    def within(self, variables: Mapping[str, Any]) -> Scope:
        """The scope inside a comprehension or a lambda."""
        return Scope(self.names, self.functions, {**(self.inner or {}), **variables})

    def weigh(self, value: Any) -> Any:
        """The value, if it is of a size that a model may have."""
        return self.functions.budget.weigh(value)

    def each(self, values: Any) -> Iterator[Any]:
        """What is gone through one by one, each step counted."""
        return self.functions.budget.few(values)


Part = Callable[[Scope], Any]


def evaluate(text: str, scope: Scope) -> Any:
    """The value of an expression.

    Raises:
        ExpressionError: it does what no expression may, or costs more than any model needs.
        Exception: whatever its arithmetic raises, as Python would.
    """
    scope.functions.budget.spend()
    value = compiled(text)(scope)
    if isinstance(value, dict) and is_namespace(value):
        raise ExpressionError("a namespace is no value")
    return scope.weigh(value)


@lru_cache(maxsize=4096)
def compiled(text: str) -> Part:
    """An expression as one Python function of its scope."""
    if len(text) > MAX_LENGTH:
        raise ExpressionError(f"the expression is longer than {MAX_LENGTH} characters")
    try:
        return part(ast.parse(text.strip(), "<expression>", "eval").body)
    except (RecursionError, MemoryError):
        raise ExpressionError("the expression nests too deeply") from None
    except ValueError as error:
        raise SyntaxError(str(error)) from None


def part(node: ast.AST) -> Part:
    """One node of the tree, and all below it, as a function; ExpressionError for a kind no expression may have."""
    make = _NODES.get(type(node))
    if make is None:
        raise ExpressionError(f"{_WORDS.get(type(node), type(node).__name__)} is not allowed in an expression")
    return make(node)


def _constant(node: Any) -> Part:
    value = node.value
    if not isinstance(value, bool | int | float | complex | str | None):
        raise ExpressionError(f"{value!r} is not allowed in an expression")
    return lambda _: value


def _name(node: Any) -> Part:
    name = _plain(node.id)
    return lambda scope: scope.look(name)


def _plain(name: str) -> str:
    if name.startswith("__"):
        raise ExpressionError(f"the name {name} is not allowed in an expression")
    return name


_BINARY: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: multiplied,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: lambda left, right: printed(left, right) if isinstance(left, str) else operator.mod(left, right),
    ast.Pow: power,
    ast.LShift: shifted,
    ast.RShift: operator.rshift,
    ast.BitAnd: operator.and_,
    ast.BitOr: operator.or_,
    ast.BitXor: operator.xor,
}


def _binary(node: Any) -> Part:
    left, right, function = part(node.left), part(node.right), _BINARY.get(type(node.op))
    if function is None:
        raise ExpressionError("the operator @ is not allowed in an expression")
    return lambda scope: scope.weigh(function(left(scope), right(scope)))


_UNARY: dict[type, Callable[[Any], Any]] = {
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
    ast.Not: operator.not_,
    ast.Invert: operator.invert,
}


def _unary(node: Any) -> Part:
    function, inner = _UNARY[type(node.op)], part(node.operand)
    return lambda scope: function(inner(scope))


def _boolean(node: Any) -> Part:
    parts, stops_at = [part(value) for value in node.values], isinstance(node.op, ast.Or)

    def value(scope: Scope) -> Any:
        found = None
        for inner in parts:
            found = inner(scope)
            if bool(found) is stops_at:
                break
        return found

    return value


_COMPARE: dict[type, Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Is: operator.is_,
    ast.IsNot: operator.is_not,
    ast.In: lambda left, right: left in right,
    ast.NotIn: lambda left, right: left not in right,
}


def _compare(node: Any) -> Part:
    first, rest = part(node.left), [part(right) for right in node.comparators]
    functions = [_COMPARE[type(op)] for op in node.ops]

    def value(scope: Scope) -> Any:
        left, found = first(scope), True
        for function, inner in zip(functions, rest, strict=True):
            right = inner(scope)
            found = function(left, right)
            if not found:
                break
            left = right
        return found

    return value


def _choice(node: Any) -> Part:
    test, body, other = part(node.test), part(node.body), part(node.orelse)
    return lambda scope: body(scope) if test(scope) else other(scope)


def _call(node: Any) -> Part:
    function, several = part(node.func), _several(node.args)
    named = [(word.arg and _plain(word.arg), part(word.value)) for word in node.keywords]

    def value(scope: Scope) -> Any:
        given: dict[str, Any] = {}
        for name, inner in named:
            given |= {name: inner(scope)} if name else dict(inner(scope))
        return scope.functions.call(function(scope), several(scope), given)

    return value


def _several(nodes: list[Any]) -> Callable[[Scope], list[Any]]:
    """Values side by side, ``*given`` unfolded."""
    parts = [(isinstance(n, ast.Starred), part(n.value if isinstance(n, ast.Starred) else n)) for n in nodes]

    def values(scope: Scope) -> list[Any]:
        found: list[Any] = []
        for starred, inner in parts:
            found.extend(scope.each(inner(scope))) if starred else found.append(inner(scope))
        return found

    return values


def _attribute(node: Any) -> Part:
    inner, name = part(node.value), node.attr
    if name.startswith("_"):
        raise ExpressionError(f"the attribute {name} is not allowed in an expression")
    return lambda scope: attribute(inner(scope), name)


def _subscript(node: Any) -> Part:
    inner, index = part(node.value), part(node.slice)

    def value(scope: Scope) -> Any:
        given = inner(scope)
        if not isinstance(given, str | list | tuple | dict | range):
            raise ExpressionError(f"{type(given).__name__} has no entries that an expression may take")
        return given[index(scope)]

    return value


def _slice(node: Any) -> Part:
    ends = [part(end) if end is not None else None for end in (node.lower, node.upper, node.step)]
    return lambda scope: slice(*(end(scope) if end is not None else None for end in ends))


def _display(kind: Callable[[list[Any]], Any]) -> Callable[[Any], Part]:
    def make(node: Any) -> Part:
        several = _several(node.elts)
        return lambda scope: scope.weigh(kind(several(scope)))

    return make


def _dictionary(node: Any) -> Part:
    pairs = [(key and part(key), part(value)) for key, value in zip(node.keys, node.values, strict=True)]

    def value(scope: Scope) -> Any:
        found: dict[Any, Any] = {}
        for key, inner in pairs:
            # `**given` has no key.
            found |= {key(scope): inner(scope)} if key is not None else dict(inner(scope))
        return scope.weigh(found)

    return value


def _comprehension(kind: Callable[[Iterator[Any]], Any]) -> Callable[[Any], Part]:
    def make(node: Any) -> Part:
        is_pair = isinstance(node, ast.DictComp)
        item = part(ast.Tuple([node.key, node.value])) if is_pair else part(node.elt)
        loops = [(_target(loop.target), part(loop.iter), [part(test) for test in loop.ifs]) for loop in node.generators]

        def items(scope: Scope, depth: int) -> Iterator[Any]:
            if depth == len(loops):
                yield item(scope)
                return
            assign, source, tests = loops[depth]
            for value in scope.each(source(scope)):
                inner = scope.within(dict(assign(value)))
                if all(test(inner) for test in tests):
                    yield from items(inner, depth + 1)

        def value(scope: Scope) -> Any:
            return scope.weigh(kind(scope.each(items(scope, 0))))

        return value

    return make


def _target(node: Any) -> Callable[[Any], Iterator[tuple[str, Any]]]:
    """Names that a comprehension gives to a value: one, or some side by side."""
    if isinstance(node, ast.Name):
        name = _plain(node.id)
        return lambda value: iter(((name, value),))
    if not isinstance(node, ast.Tuple | ast.List):
        raise ExpressionError("a comprehension gives its values to plain names only")
    targets = [_target(inner) for inner in node.elts]

    def assign(value: Any) -> Iterator[tuple[str, Any]]:
        for target, inner in zip(targets, value, strict=True):
            yield from target(inner)

    return assign


def _lambda(node: Any) -> Part:
    given, body = node.args, part(node.body)
    if given.posonlyargs or given.kwonlyargs or given.vararg or given.kwarg or given.defaults:
        raise ExpressionError("a lambda takes plain parameters only")
    parameters = tuple(_plain(parameter.arg) for parameter in given.args)

    def value(scope: Scope) -> Written:
        return Written(lambda *given: body(scope.within(dict(zip(parameters, given, strict=True)))))

    return value


def _joined(node: Any) -> Part:
    parts = [part(value) for value in node.values]
    return lambda scope: scope.weigh("".join(inner(scope) for inner in parts))


def _formatted(node: Any) -> Part:
    inner = part(node.value)
    form: Part = part(node.format_spec) if node.format_spec is not None else lambda _: ""
    ways: dict[int, Callable[[Any], Any]] = {115: str, 114: repr, 97: ascii}
    change = ways.get(node.conversion, lambda value: value)
    return lambda scope: formatted(change(inner(scope)), form(scope))


_NODES: dict[type, Callable[[Any], Part]] = {
    ast.Constant: _constant,
    ast.Name: _name,
    ast.BinOp: _binary,
    ast.UnaryOp: _unary,
    ast.BoolOp: _boolean,
    ast.Compare: _compare,
    ast.IfExp: _choice,
    ast.Call: _call,
    ast.Attribute: _attribute,
    ast.Subscript: _subscript,
    ast.Slice: _slice,
    ast.List: _display(list),
    ast.Tuple: _display(tuple),
    ast.Set: _display(set),
    ast.Dict: _dictionary,
    ast.ListComp: _comprehension(list),
    ast.SetComp: _comprehension(set),
    ast.DictComp: _comprehension(dict),
    ast.GeneratorExp: _comprehension(list),
    ast.Lambda: _lambda,
    ast.JoinedStr: _joined,
    ast.FormattedValue: _formatted,
}
_WORDS: dict[type, str] = {ast.NamedExpr: "an assignment with :=", ast.Starred: "a star here"}
