"""The command that turns a study's folder into one page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from drillrig_pin.cli.case import Json
from drillrig_pin.cli.files import require_folder
from drillrig_pin.cli.output import console, print_json, working
from drillrig_pin.cli.subject import LimitSettings, LimitsFile
from drillrig_pin.cli.targets import Force, require_target, require_targets


def sweep_report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a study, as drillrig sweep -o makes it.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE.html", help="Default: report.html in the folder.")
    ] = None,
    metric: Annotated[
        str | None,
        typer.Option("--metric", "-m", metavar="M", help="Rank by this metric first. Default: the study's own."),
    ] = None,
    limit: LimitSettings = None,
    limits: LimitsFile = None,
    figures: Annotated[
        Path | None,
        typer.Option("--figures", metavar="FOLDER", help="Write the picture of the rock face there too, PNG and SVG."),
    ] = None,
    animations: Annotated[
        bool,
        typer.Option("--animations", help="Write every kept case as an animation beside the page, and link to it."),
    ] = False,
    open_page: Annotated[bool, typer.Option("--open", help="Open the page in the browser.")] = False,
    force: Force = False,
    json: Json = False,
) -> None:
    """Write a study as one page: best and worst, the rock face, effects of the axes, ranking, failures.

    The page opens in any browser without network. Every case in it says how to open it in replay:

    drillrig replay DIR --case N.

    Example:  [bold]drillrig sweep-report holes[/]

    Example:  [bold]drillrig sweep-report resonance -o resonance.html --metric hole.toe_6m.worst --limit toe_6m=50mm[/]
    """
    from drillrig_pin.analysis.limits import read_limits
    from drillrig_pin.figures.face import NAME as FACE
    from drillrig_pin.figures.printed import file_names
    from drillrig_pin.studyreport.write import write_study_report

    target = output if output is not None else folder / "report.html"
    allowed = read_limits(limits, limit or ())
    if output is not None or folder.is_dir():
        require_target(target, "page", reads=(limits, *_files_of(folder)), force=force)
    if figures is not None:
        require_folder(figures)
        require_targets(figures, file_names([FACE]), reads=(limits, *_files_of(folder)), force=force)
    with working("writing the report"):
        written = write_study_report(
            folder, target, metric=metric, limits=allowed, figures=figures, animations=animations
        )
    content, size = written.content, target.stat().st_size
    if json:
        subject = content.subject
        ranked = subject.table.ranked(subject.metric)
        print_json(
            {
                "folder": str(folder),
                "report": str(target),
                "bytes": size,
                "metric": subject.metric,
                "worst": ranked[0] if ranked else None,
                "best": ranked[-1] if ranked else None,
                "headline": content.headline.sentence,
                "statements": [
                    {"level": s.level.name, "title": s.title, "sentence": s.sentence} for s in content.statements
                ],
                "figures": [str(path) for path in written.pictures],
                "animations": {str(case): str(path) for case, path in written.animations.items()},
            }
        )
    else:
        out = console()
        out.print(content.headline.sentence, markup=False, style="bold")
        for statement in content.statements:
            out.print(f"  {statement.title}: {statement.sentence}", markup=False)
        for path in written.pictures:
            out.print(f"{path} written.", markup=False, soft_wrap=True)
        if written.animations:
            where = next(iter(written.animations.values())).parent
            out.print(f"{len(written.animations)} animations in {where}.", markup=False, soft_wrap=True)
        out.print(f"{target} written ({size / 1e6:.1f} MB). Open it in a browser.", markup=False, soft_wrap=True)
    if open_page:
        import webbrowser

        webbrowser.open(target.absolute().as_uri())


def _files_of(folder: Path) -> list[Path]:
    """What a study has computed."""
    return [folder / "results.parquet", *folder.glob("trajectories/*.nc")]
