"""Expressions of models compute and do nothing else: no way out of them, no value without bound, all that is legal."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
import xacro

from drillrig_pin.errors import ModelError
from drillrig_pin.model import budget
from drillrig_pin.model.budget import Budget, ExpressionError
from drillrig_pin.model.expression import Scope, evaluate
from drillrig_pin.model.expression_functions import Functions
from drillrig_pin.model.modelfile import read_model
from drillrig_pin.model.xacro_guard import guarding

#: Fewer steps than a model has in truth: what goes on without end does so sooner.
FEW = 100_000
XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
#: Where the class of open files is found from any value at all, and what is done with it.
SUBCLASSES = "().__class__.__base__.__subclasses__()"
OPEN = "[c for c in ().__class__.__base__.__subclasses__() if c.__name__ == '_wrap_close'][0].__init__.__globals__"
WRITE = "['__builtins__']['open']('PROOF','w').write('ran')"

ESCAPES = {
    "lambda": f"(lambda: {OPEN}{WRITE})()",
    "comprehension": f"[{OPEN}{WRITE} for _ in [1]]",
    "generator": f"list({OPEN}{WRITE} for _ in [1])",
    "nested lambdas": f"(lambda: (lambda: {OPEN}{WRITE})())()",
    "default of a lambda": f"(lambda x={OPEN}: x)(){WRITE}",
    "class of a value": "().__class__",
    "bases": "(1).__class__.__mro__[1].__subclasses__()",
    "f-string": f"f'{{{SUBCLASSES}}}'",
    "format reads attributes": "'{0.__class__.__base__}'.format(1)",
    "format reads globals": "'{0.__globals__}'.format(xacro.tokenize)",
    "format by a map": "'{a.__class__}'.format_map({'a': 1})",
    "walrus": f"[x := {SUBCLASSES}, x][1]",
    "import": "__import__('os').system('touch PROOF')",
    "builtins by name": "__builtins__['open']('PROOF', 'w')",
    "getattr": "getattr((), '__class__')",
    "vars of a type": "python.vars(python.type(xacro.tokenize))['__globals__']",
    "a class made by type": "python.type('X', (), {'__init__': lambda s: 0})()",
    "type called": "python.type(python.type(1))('X', (), {})",
    "function by map": "list(map(python.type(xacro.tokenize), [1]))",
    "globals of a function": "xacro.load_yaml.__globals__",
    "closure of a function": "xacro.warning.func_closure",
    "frame of a generator": "(x for x in [1]).gi_frame.f_globals",
    "code of a function": "xacro.fatal.__code__",
    "attribute of a table": "xacro.dotify({'a': 1}).__class__",
    "init of a table": "xacro.dotify.__init__",
    "module behind math": "math.__loader__",
    "names of xacro changed": "math.update({'sin': 1})",
    "names of xacro listed": "xacro._setitem('a', 1, False)",
    "parent of a namespace": "math.parent.root",
    "methods of a class": "str.__subclasses__()",
    "bytes": "b'x'.__class__",
    "await": "await x",
    "star": "*[1]",
    "two statements": "1\nimport os",
    "eval": "eval('1')",
    "exec": "exec('1')",
    "open": "open('PROOF', 'w')",
}


def model(folder: Path, body: str, name: str = "own.urdf.xacro") -> Path:
    path = folder / name
    path.write_text(f'<robot name="own" {XACRO}>\n{body}\n<link name="base"/></robot>')
    return path


def quoted(expression: str) -> str:
    return expression.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;")


def refused(path: Path, line: int = 2, place: str = "own.urdf.xacro") -> str:
    with pytest.raises(ModelError) as raised:
        read_model(path)
    assert f"{place}:{line}" in str(raised.value)
    assert not Path("PROOF").exists()
    return str(raised.value)


@pytest.mark.parametrize("escape", ESCAPES.values(), ids=ESCAPES)
def test_no_expression_gets_out(escape: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with guarding(xacro), pytest.raises(Exception) as raised:  # noqa: PT011 (whatever Python would raise)
        xacro.safe_eval(escape, xacro._global_symbols)
    assert isinstance(raised.value, ExpressionError | NameError | SyntaxError | xacro.XacroException), raised.value
    if "}" not in escape:
        # A brace ends the expression for xacro.
        refused(model(tmp_path, f'<link name="${{{quoted(escape)}}}"/>'))
    assert not Path("PROOF").exists()


INDIRECT = {
    "eval with real builtins": """<xacro:property name="c" value=")"/>
<link name="$(eval open('PROOF','w'${c}.write('ran'${c})"/>""",
    "eval of a class": '<link name="$(eval [].append.__self__)"/>',
    "argument within an expression": f"""<xacro:arg name="a" default="{OPEN}{WRITE}"/>
<link name="${{$(arg a)}}"/>""",
    "property within an expression": f"""<xacro:property name="a" value="{OPEN}{WRITE}"/>
<link name="${{1 + ${{a}}}}"/>""",
    "tag of a table": """<xacro:property name="t" value="${xacro.load_yaml('python.yaml')}"/>
<link name="${t}"/>""",
    "unit of a table": """<xacro:property name="t" value="${xacro.load_yaml('unit.yaml')}"/>
<link name="${t}"/>""",
    "environment": '<link name="a"/>\n<link name="$(env NO_SUCH)"/>',
    "package": '<link name="a"/>\n<link name="$(find ../../etc)"/>',
    "device": '<link name="a"/>\n<xacro:include filename="/dev/zero"/>',
    "device as a table": '<link name="a"/>\n<link name="${xacro.load_yaml(\'/dev/zero\')}"/>',
}


@pytest.mark.parametrize("body", INDIRECT.values(), ids=INDIRECT)
def test_nothing_runs_by_a_way_around(body: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "python.yaml").write_text("a: !!python/object/apply:os.system ['touch PROOF']\n")
    (tmp_path / "unit.yaml").write_text(f'a: !degrees "{OPEN}{WRITE}"\n')
    with pytest.raises(ModelError) as raised:
        read_model(model(tmp_path, body))
    assert raised.value.where is not None
    assert not Path("PROOF").exists()


TOO_MUCH = {
    "power": "9**9**9",
    "powers of powers": "((((9**99)**99)**99)**99)",
    "shift": "1 << 10**9",
    "word repeated": "'a' * 10**10",
    "list repeated": "[0] * 10**9",
    "list of lists repeated": "[[[0] * 1000] * 1000] * 1000",
    "range": "list(range(10**9))",
    "sum of a range": "sum(range(10**12))",
    "loops": "[0 for a in range(9999) for b in range(9999) for c in range(9999)]",
    "sum over loops": "sum(1 for a in range(9999) for b in range(9999))",
    "width": "'%99999999d' % 1",
    "width given": "'%*d' % (10**9, 1)",
    "format": "'{:>999999999}'.format(1)",
    "many values": "'{0}{0}{0}{0}' .format('a' * 999999)",
    "replace": "('a' * 99999).replace('a', 'b' * 99999)",
    "join": "('a' * 99999).join(['b'] * 9999)",
    "padding": "'a'.ljust(10**10)",
    "factorial": "math.factorial(10**7)",
    "choices": "math.comb(10**7, 10**6)",
    "product": "math.prod([10**1000] * 9999)",
    "digits": "round(5, -10**9)",
    "recursion": "(lambda f: f(f))(lambda f: f(f))",
    "two recursions": "(lambda f, n: f(f, n))(lambda f, n: f(f, n-1) + f(f, n-1) if n else 1, 60)",
    "minus signs": "-" * 15000 + "1",
    "sums": "+".join("1" * 9000),
    "long": "+".join("1" * 20000),
}


@pytest.mark.parametrize("expression", TOO_MUCH.values(), ids=TOO_MUCH)
def test_an_expression_without_measure_is_refused_at_its_line(
    expression: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(budget, "MAX_STEPS", FEW)
    body = f'<xacro:property name="x" value="${{{quoted(expression)}}}"/>\n<link name="a"/><link name="${{x}}"/>'
    refused(model(tmp_path, body))


DOUBLING = "".join(f'<xacro:property name="p{n + 1}" value="${{p{n}}}${{p{n}}}"/>\n' for n in range(40))
MACROS = "".join(f'<xacro:macro name="m{n}"><xacro:m{n + 1}/><xacro:m{n + 1}/></xacro:macro>\n' for n in range(40))
UNFOLDING = {
    "properties": f'<xacro:property name="p0" value="abcdefgh"/>\n{DOUBLING}<link name="${{p40}}"/>',
    "macros": f'<xacro:macro name="m40"><link name="a"/></xacro:macro>\n{MACROS}<xacro:m0/>',
    "macro of itself": '<xacro:macro name="m"><xacro:m/></xacro:macro>\n<xacro:m/>',
    "block of itself": '<xacro:property name="b"><xacro:insert_block name="b"/></xacro:property>\n'
    '<xacro:insert_block name="b"/>',
    "parameters": f'<xacro:macro name="m" params="a:={"b" * 60}\'"><link name="x"/></xacro:macro>\n<xacro:m/>',
    "file of itself": '<xacro:include filename="own.urdf.xacro"/>',
    "files of each other": '<xacro:include filename="two.xacro"/>',
}


@pytest.mark.parametrize("body", UNFOLDING.values(), ids=UNFOLDING)
def test_a_model_that_unfolds_without_measure_is_refused(
    body: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(budget, "MAX_STEPS", FEW)
    path = model(tmp_path, body)
    model(tmp_path, '<xacro:include filename="own.urdf.xacro"/>', "two.xacro")
    with pytest.raises(ModelError) as raised:
        read_model(path)
    assert ".xacro:" in str(raised.value)


LEGAL: dict[str, Any] = {
    "2 * pi / 3 + sin(0.5) ** 2 // 1 % 7 - -3": 2 * math.pi / 3 + math.sin(0.5) ** 2 // 1 % 7 - -3,
    "math.radians(30) if a > 2 and not b else 'x'": math.radians(30),
    "1 < a <= 3 != 4 and 'k' in d and d is not None": True,
    "d['k']['x'] + t.k.x + t['k'].x + l[1:][0] + l[-1]": 5 + 5 + 5 + 2 + 3,
    "[x * y for x in l for y in (1, 2) if x != y]": [2, 2, 3, 6],
    "{k: v for k, v in zip(['a', 'b'], range(2))}": {"a": 0, "b": 1},
    "{x % 2 for x in l} | {7}": {0, 1, 7},
    "sum(x for x in l) + max(*l) + min(l, key=lambda x: -x)": 6 + 3 + 3,
    "sorted(['bb', 'a'], key=len, reverse=False)": ["a", "bb"],
    "list(map(lambda x: 2 * x, filter(lambda x: x > 1, l)))": [4, 6],
    "'%.3f m of %s' % (1.23456, 'x')": "1.235 m of x",
    "'{:.2f} {n} {}'.format(1.234, 'b', n=3)": "1.23 3 b",
    "f'{a + 0.5:.3f}|{a!r:>4}'": "3.500|   3",
    "'a b'.split()[0].upper() + '-'.join(str(x) for x in l)": "A1-2-3",
    "d.get('none', 7) + len(list(d.items()))": 8,
    "python.isinstance('x', str) and type(a) == int": True,
    "(lambda x, y: x + y)(*[1, 2])": 3,
    "dict(**{'a': 1}, b=2)['b'] | 8 & 12 ^ 1 << 2": 2 | 8 & 12 ^ 1 << 2,
    "round(2.675, 1) + round(2.5) + abs(-1) + int('7') + float('1e-3')": 2.7 + 2 + 1 + 7 + 1e-3,
    "math.prod([1, 2, 3.5]) + math.hypot(3, 4) + math.comb(5, 2)": 7.0 + 5 + 10,
    "(1).real if False else l[::2]": [1, 3],
}


@pytest.mark.parametrize("expression", LEGAL)
def test_what_is_legal_gives_what_python_gives(expression: str) -> None:
    tables = {"d": {"k": {"x": 5}}, "t": xacro.YamlDictWrapper({"k": {"x": 5}}), "l": [1, 2, 3], "a": 3, "b": False}
    functions = {f.__name__: f for f in (range, sorted, filter, sum, zip, type, abs)}
    names = {**dict.copy(xacro._global_symbols), **functions, **tables}
    assert evaluate(expression, Scope(names, Functions(Budget()))) == LEGAL[expression]


def test_eval_and_units_of_tables_still_compute(tmp_path: Path) -> None:
    (tmp_path / "t.yaml").write_text("a: !degrees 90*2\nb: {c: 3}\n")
    body = """<xacro:arg name="n" default="3"/><xacro:property name="t" value="${xacro.load_yaml('t.yaml')}"/>
<link name="$(eval n + n)_${round(t.a, 3)}_${t.b.c}_${xacro.arg('n')}"/>
<link name="${xacro.message('hello')}x_${len(xacro.tokenize('1,2 3'))}"/>"""
    found = read_model(model(tmp_path, body))
    assert 'name="6_3.142_3_3"' in found.text
    assert 'name="x_3"' in found.text
    assert any("hello" in problem.message for problem in found.warnings)
