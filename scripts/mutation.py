"""Run mutmut as pyproject.toml says and write the page that shows what the tests notice; see scripts/mutation.sh."""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))

from validation.measured import keep  # noqa: E402

MUTANTS, PAGE, REASONS = ROOT / "mutants", ROOT / "tests" / "MUTATION.md", ROOT / "tests" / "mutation_survivors.yaml"
BAR = 90.0

HEAD = """\
# Planted faults

`bash scripts/mutation.sh` plants one fault at a time in the force laws and in what assembles and solves the
constraints: a sign turned, a number changed, an argument dropped. The tests named in `pyproject.toml` (`[tool.mutmut]`)
run on the Python engine with each. **{noticed} of {count} are noticed, {percent:.1f} %** (bar: {bar:.0f} %){untried}.

| file | faults | noticed | not |
|---|---:|---:|---:|
{table}

## Not noticed

Most change nothing that could be noticed. The line as it is, the line with the fault, and why nothing notices it.

"""


@dataclass(frozen=True)
class Survivor:
    """A fault that no test noticed."""

    name: str
    file: str
    function: str
    before: str
    after: str


def main() -> int:
    """Run, then write the page."""
    import yaml

    if "--summary" not in sys.argv:
        _mutmut("run", "--max-children", "1")
    ends: dict[str, Counter[bool]] = {}
    survivors = []
    untried = 0
    for meta in sorted((MUTANTS / "drillrig_pin").rglob("*.meta")):
        file = str(meta.relative_to(MUTANTS)).removesuffix(".meta")
        codes: dict[str, int | None] = json.loads(meta.read_text())["exit_code_by_key"]
        for name, code in codes.items():
            if code is None:
                untried += 1
                continue
            # 0: all tests passed; 33: no test runs the function.
            noticed = code not in (0, 33)
            ends.setdefault(file, Counter())[noticed] += 1
            if not noticed:
                survivors.append(_survivor(name, file))
    reasons = yaml.safe_load(REASONS.read_text(encoding="utf-8")) or []
    if not ends:
        print("nothing was tried")
        return 1
    count, noticed = sum(c.total() for c in ends.values()), sum(c[True] for c in ends.values())
    percent = 100 * noticed / count
    table = "\n".join(f"| {file} | {c.total()} | {c[True]} | {c[False]} |" for file, c in ends.items())
    left = f"; {untried} more were not tried in this run" if untried else ""
    page = HEAD.format(noticed=noticed, count=count, percent=percent, bar=BAR, table=table, untried=left)
    told = [(survivor, _reason(survivor, reasons)) for survivor in survivors]
    PAGE.write_text(page + "\n".join(_entry(survivor, why) for survivor, why in told), encoding="utf-8")
    keep("mutation", {"mutants": count, "noticed": noticed, "percent": percent, "untried": untried})
    unexplained = [survivor for survivor, why in told if not why]
    for survivor in unexplained:
        print(f"{survivor.file} {survivor.function}\n  - {survivor.before}\n  + {survivor.after}")
    print(f"{noticed} of {count} faults noticed, {percent:.1f} %; {len(unexplained)} unexplained; {PAGE}")
    return int(percent < BAR or bool(unexplained))


def _mutmut(*words: str) -> None:
    """Run mutmut without the import hook of an editable install, which would load the code without faults."""
    code = (
        "import sys; sys.meta_path = [f for f in sys.meta_path if 'ScikitBuild' not in type(f).__name__]; "
        f"sys.argv = ['mutmut', *{words!r}]; from mutmut.__main__ import cli; cli()"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False)


def _survivor(name: str, file: str) -> Survivor:
    show = [sys.executable, "-m", "mutmut", "show", name]
    lines = subprocess.run(show, cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
    before = " ".join(line[1:].strip() for line in lines if line.startswith("-") and not line.startswith("---"))
    after = " ".join(line[1:].strip() for line in lines if line.startswith("+") and not line.startswith("+++"))
    function = name.rpartition(".")[2].rpartition("__mutmut_")[0].removeprefix("x").strip("ǁ_").replace("ǁ", ".")
    return Survivor(name, file, function, before, after)


def _reason(survivor: Survivor, reasons: list[dict[str, Any]]) -> str:
    """Why a fault is not noticed: the first entry whose words stand in file, function and changed line."""
    for entry in reasons:
        wanted = {
            "file": survivor.file,
            "function": survivor.function,
            "line": survivor.before,
            "fault": survivor.after,
        }
        if all(str(entry.get(key, "")) in text for key, text in wanted.items()):
            return str(entry["why"])
    return ""


def _entry(survivor: Survivor, why: str) -> str:
    return (
        f"- `{survivor.file}`, {survivor.function}: {why or '**not explained**'}\n\n"
        f"  ```diff\n  - {survivor.before}\n  + {survivor.after}\n  ```\n"
    )


if __name__ == "__main__":
    sys.exit(main())
