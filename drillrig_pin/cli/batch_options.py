"""Options that all commands about studies share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

StudyName = Annotated[
    str, typer.Argument(metavar="STUDY", help="Path of a study (.yaml), or name of a shipped one.", show_default=False)
]
Folder = Annotated[
    Path, typer.Option("--output", "-o", metavar="DIR", help="Folder of the results; made if it is not there.")
]
Workers = Annotated[
    int | None,
    typer.Option(
        "--workers",
        metavar="N",
        min=1,
        max=1024,
        help="Processes on this machine. Default: one a core.",
        show_default=False,
    ),
]
Scheduler = Annotated[
    str | None,
    typer.Option("--scheduler", metavar="ADDRESS", help="Run on a Dask cluster instead, e.g. tcp://host:8786."),
]
Keep = Annotated[str, typer.Option("--keep", metavar="WHICH", help="Trajectories to keep: all, worst:10 or none.")]
TimeLimit = Annotated[
    float,
    typer.Option("--time-limit", metavar="S", min=0.01, help="Seconds a case may take; then it becomes a failed row."),
]
Over = Annotated[
    str | None,
    typer.Option(
        "--over",
        metavar="WHICH",
        help="What a design is worth that is run at several holes: worst or mean. Default: worst.",
        show_default=False,
    ),
]
Seed = Annotated[
    int | None,
    typer.Option("--seed", metavar="N", min=0, help="Another seed, other samples. Default: 0.", show_default=False),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress bar and no tables.")]
