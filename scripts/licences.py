"""Write LICENCES.md: every locked library that runs with the package, with its licence, from what is installed here.

    python scripts/licences.py             write it
    python scripts/licences.py --check     status 1 if the lock names a library that the page lacks

Libraries of other platforms and versions of Python are in the lock and not installed: they are listed by name.
"""

from __future__ import annotations

import re
import sys
from email.message import Message
from importlib.metadata import PackageNotFoundError, files, metadata
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LOCK, PAGE = ROOT / "requirements.lock", ROOT / "LICENCES.md"
LOCKED = re.compile(r"^([A-Za-z0-9._-]+)==([^\s;\\]+)(?:\s*;\s*([^\\]+?))?\s*\\?$", re.MULTILINE)
#: Licences that ask for something of those who hand on what is made with them; LGPL and MPL leave other files alone.
COPYLEFT = re.compile(r"\b(A?GPL|LGPL|GNU|MPL|Mozilla|EPL|CDDL|EUPL)", re.IGNORECASE)
#: Words of a licence's text, and its name.
KNOWN = {
    "Redistribution and use in source and binary forms": "BSD",
    "Permission is hereby granted, free of charge": "MIT",
    "Qhull": "Qhull",
}
HEAD = """# Licences of the libraries

Every library that `requirements.lock` pins, with the licence that its own metadata states. This page is written by
`python scripts/licences.py`; drillrig_pin itself is under the BSD 2-clause licence of `LICENSE`.

**Copyleft** marks licences that ask for something of whoever hands the library on: its source, or changes to its files.
drillrig_pin imports these libraries as they are, and ships none of them in its wheel; a container image does. What a
library's own wheel brings along in compiled form (GEOS, libgfortran, HDF5) stands in its folder of licences.

| library | version | licence | | where |
|---|---|---|---|---|
"""


def locked() -> list[tuple[str, str, str]]:
    """Name, version and condition (empty: always) of every library in the lock."""
    return [(name.lower(), version, condition or "") for name, version, condition in LOCKED.findall(LOCK.read_text())]


def licence_of(found: Message, texts: str = "") -> str:
    """What the metadata of a library says: SPDX expression, else classifiers, else its word for it, else its text."""
    if found["License-Expression"]:
        return str(found["License-Expression"])
    named = [c.rpartition(" :: ")[2] for c in found.get_all("Classifier", []) if c.startswith("License :: ")]
    named = [name for name in named if name != "OSI Approved"]
    given = str(found["License"] or "").strip()
    if named or (given and "\n" not in given):
        return "; ".join(named) or given[:80]
    text = " ".join(f"{given} {texts}".split())
    return next((f"{name}, by its text" for words, name in KNOWN.items() if words in text), "not stated")


def texts_of(name: str) -> str:
    """The licence files that a library brings along, on one line."""
    found = [path for path in files(name) or [] if re.search(r"(licen[cs]e|copying)", path.name, re.IGNORECASE)]
    return " ".join(" ".join(path.read_text().split()) for path in found if path.locate().is_file())


def link_of(found: Message) -> str:
    """Its home page or source."""
    places = [str(found["Home-page"])] if found["Home-page"] else []
    for entry in found.get_all("Project-URL", []):
        label, _, place = entry.partition(", ")
        places.insert(0 if re.search(r"home|source|repository|code", label, re.IGNORECASE) else len(places), place)
    return places[0] if places else ""


def page() -> str:
    """The whole page."""
    rows = []
    for name, version, condition in sorted(locked()):
        try:
            found = metadata(name)
        except PackageNotFoundError:
            why = f"not installed where this page was written; only if {condition or '?'}"
            rows.append(f"| {name} | {version} | {why} | | |")
            continue
        if found["Version"] != version:
            rows.append(f"| {name} | {version} | see version {found['Version']}; only if {condition or '?'} | | |")
            continue
        licence = licence_of(found, texts_of(name))
        mark = "**copyleft**" if COPYLEFT.search(licence) else ""
        rows.append(f"| {name} | {version} | {licence.replace('|', '/')} | {mark} | {link_of(found)} |")
    return HEAD + "\n".join(rows) + "\n"


def missing() -> list[str]:
    """Libraries of the lock that the page does not list in their version."""
    text = PAGE.read_text(encoding="utf-8")
    return [f"{name} {version}" for name, version, _ in locked() if f"| {name} | {version} |" not in text]


def main() -> int:
    """Write the page, or look at it."""
    if "--check" in sys.argv[1:]:
        print("\n".join(missing()))
        return int(bool(missing()))
    PAGE.write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
