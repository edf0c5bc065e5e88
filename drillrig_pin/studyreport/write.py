"""Write the report of a study's folder: what command line and service call."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from drillrig_pin.analysis.limits import Limit
from drillrig_pin.errors import DrillrigError, ResultFileError
from drillrig_pin.figures.face import caption, save_face
from drillrig_pin.files import saving
from drillrig_pin.litter import temporary_folder
from drillrig_pin.studyreport.content import StudyContent, gather
from drillrig_pin.studyreport.page import study_page
from drillrig_pin.studyreport.subject import read_subject


@dataclass(frozen=True)
class Written:
    """What was written.

    Attributes:
        page: the page.
        content: what it says.
        pictures: figures for print.
        animations: pages with the animation of a case, by case.
    """

    page: Path
    content: StudyContent
    pictures: tuple[Path, ...]
    animations: dict[int, Path]


def write_study_report(
    folder: str | Path,
    target: str | Path | None = None,
    *,
    metric: str | None = None,
    limits: Mapping[str, Limit] | None = None,
    figures: str | Path | None = None,
    animations: bool = False,
    links: Mapping[int, Mapping[str, str]] | None = None,
) -> Written:
    """Write one self-contained HTML page about a study's folder.

    Args:
        folder: as ``drillrig sweep -o`` makes it.
        target: the page; None: ``report.html`` in that folder.
        metric: by which cases are ranked first, a name or pattern; None: the one that tells the study's worst case.
        limits: to judge by, see :func:`drillrig_pin.analysis.limits.read_limits`; None: the shipped examples.
        figures: existing folder for the picture of the rock face as PNG and SVG; None: only on the page.
        animations: write the animation of every kept case as a page of its own into ``TARGET_cases`` and link to it.
        links: further addresses by case and words, e.g. of a service: ``{3: {"replay": "/cases/3/replay"}}``.

    Raises:
        ResultFileError: no folder of a study, no such metric, or a file that cannot be written.
    """
    subject = read_subject(folder, metric, limits)
    content = gather(subject)
    page = Path(target) if target is not None else subject.table.folder / "report.html"
    title = subject.table.study.text or subject.table.study.name
    picture, words, printed = "", "", []
    if subject.face is not None:
        words = caption(subject.face)
        with temporary_folder() as aside:
            picture = save_face(subject.face, title, Path(aside), ["svg"])[0].read_text(encoding="utf-8")
        if figures is not None:
            printed = save_face(subject.face, title, Path(figures))
    played = _animations(content, page) if animations else {}
    addresses: dict[int, dict[str, str]] = {case: dict(found) for case, found in (links or {}).items()}
    for case, path in subject.table.kept.items():
        addresses.setdefault(case, {})["result file"] = _address(path, page)
    for case, path in played.items():
        addresses.setdefault(case, {})["animation"] = _address(path, page)
    _write(page, study_page(content, picture, words, addresses))
    return Written(page, content, tuple(printed), played)


def _animations(content: StudyContent, page: Path) -> dict[int, Path]:
    """Animations of the kept cases; a case that cannot be drawn has none."""
    from drillrig_pin.batch.again import other_holes
    from drillrig_pin.replay.page import animation_page
    from drillrig_pin.scene.options import ReplayOptions
    from drillrig_pin.trajectory import load_trajectory

    table = content.subject.table
    folder = page.with_name(f"{page.stem}_cases")
    found: dict[int, Path] = {}
    for case, path in table.kept.items():
        try:
            options = ReplayOptions(holes=other_holes(table, case))
            text = animation_page([load_trajectory(path)], options, [f"case {case}"])
        except DrillrigError:
            continue
        try:
            folder.mkdir(exist_ok=True)
        except OSError as error:
            raise ResultFileError(f"the folder cannot be made ({error.strerror})", where=folder) from None
        found[case] = folder / f"case_{case:05d}.html"
        _write(found[case], text)
    return found


def _address(path: Path, page: Path) -> str:
    """Where a file is, seen from the page."""
    return quote(Path(os.path.relpath(path.absolute(), page.absolute().parent)).as_posix())


def _write(target: Path, text: str) -> None:
    with saving(target, where=target) as aside:
        aside.write_text(text, encoding="utf-8")
