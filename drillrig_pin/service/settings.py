"""What a server is told when it starts: where its data lives, who may use it, and how much anybody may ask of it."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

MEGABYTE = 1_000_000


@dataclass(frozen=True, slots=True)
class Limits:
    """Bounds that keep one user from taking the machine away from the others.

    Attributes:
        job_time: wall time of a run, and of one case of a study [s].
        study_time: wall time of a whole study [s].
        job_memory: memory a job may take on top of what an idle worker has [bytes].
        output: size of one result file [bytes].
        queue: jobs that may wait.
        body: size of a request [bytes].
        upload: size of an uploaded model [bytes].
        body_time: time a client has to send a request [s].
        uploads: models kept.
        links, elements, dofs: of an uploaded model; as many joints as links, and of them so many degrees of freedom.
        nodes, attributes, comments: XML elements of any kind in it, attributes of one of them, comments.
        samples: of a run, duration x output_rate.
        steps: of a run with a given step, duration / step.
        cases, names: of a study: its rows, and what it varies.
        requests: that one client may send a minute.
        submissions: of them those that start something.
        logins: wrong tokens a client may try a minute; a right one always passes.
        under_way: requests of one client that may wait for their answer at once.
        connections: of one address, a proxy's not counted.
        made: figures, pages, checks, plans and uploads of one kind that one client may wait for.
        made_memory: that making one of them may take on top of what an idle worker has [bytes].
    """

    job_time: float = 600.0
    study_time: float = 86_400.0
    job_memory: int = 2_000 * MEGABYTE
    output: int = 500 * MEGABYTE
    queue: int = 200
    body: int = 1 * MEGABYTE
    upload: int = 2 * MEGABYTE
    body_time: float = 20.0
    uploads: int = 200
    links: int = 200
    elements: int = 500
    dofs: int = 200
    nodes: int = 20_000
    attributes: int = 100
    comments: int = 20_000
    samples: int = 500_000
    steps: int = 50_000_000
    cases: int = 10_000
    names: int = 100
    requests: int = 12_000
    submissions: int = 1_200
    logins: int = 20
    under_way: int = 1_000
    connections: int = 2_000
    made: int = 16
    made_memory: int = 1_000 * MEGABYTE


@dataclass(frozen=True, slots=True)
class Settings:
    """One server.

    Attributes:
        data: folder of records and files.
        host, port: where it listens.
        token: what a client has to know; None: nothing, which only an address of this machine allows.
        workers: runs at once.
        scheduler: Dask scheduler that gets the jobs instead of processes of this machine.
        library: folder with more models, besides the shipped ones.
        hosts: names under which clients may speak to it; empty: on a local address the local ones, otherwise any.
        proxies: addresses and networks whose X-Forwarded headers are believed.
        limits: bounds.
    """

    data: Path
    host: str = "127.0.0.1"
    port: int = 8000
    token: str | None = field(default=None, repr=False)
    workers: int = field(default_factory=lambda: len(os.sched_getaffinity(0)))
    scheduler: str | None = None
    library: Path | None = None
    hosts: tuple[str, ...] = ()
    proxies: tuple[str, ...] = ()
    limits: Limits = field(default_factory=Limits)

    @property
    def local(self) -> bool:
        """True when only this machine can reach the server."""
        return self.host in LOCAL_HOSTS


LOCAL_HOSTS = ("127.0.0.1", "localhost", "::1")
