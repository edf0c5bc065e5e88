"""What an operator sees: one line of JSON for every request and every step of a job, and numbers for Prometheus."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import MutableMapping
from typing import Any, TextIO

import prometheus_client as prometheus
import structlog

from drillrig_pin.escaping import visible
from drillrig_pin.service.records import Job


def make_log(stream: TextIO | None = None) -> Any:
    """A logger that writes to stderr: lines of JSON, or for a person at a terminal plain ones."""
    stream = stream or sys.stderr
    shown = structlog.dev.ConsoleRenderer() if stream.isatty() else structlog.processors.JSONRenderer()
    return structlog.wrap_logger(
        _Lines(stream),
        processors=[
            structlog.processors.add_log_level,
            structlog.processors.TimeStamper(fmt="iso", utc=True),
            *((_written_out,) if stream.isatty() else (structlog.processors.format_exc_info,)),
            shown,
        ],
        wrapper_class=structlog.BoundLogger,
    )


class _Lines(structlog.PrintLogger):
    """Lines for a stream; one that cannot be written, since the disk is full or nobody reads, is left out."""

    def msg(self, message: str) -> None:
        """Write a line."""
        with contextlib.suppress(OSError, ValueError):
            super().msg(message)

    log = debug = info = warn = warning = msg
    fatal = failure = err = error = critical = exception = msg


def _written_out(_: Any, __: str, event: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
    """Names of jobs and paths of requests as a terminal may see them; in JSON they are escaped anyway."""
    return {key: visible(value) if isinstance(value, str) else value for key, value in event.items()}


class Numbers:
    """Counters of one server."""

    def __init__(self) -> None:
        self.registry = prometheus.CollectorRegistry()
        self.requests = prometheus.Counter(
            "drillrig_requests", "HTTP requests", ["method", "route", "status"], registry=self.registry
        )
        self.latency = prometheus.Histogram(
            "drillrig_request_seconds", "Time to the end of an answer", ["route"], registry=self.registry
        )
        self.jobs = prometheus.Counter(
            "drillrig_job_steps",
            "Steps of jobs: queued, running, and how they ended",
            ["kind", "step"],
            registry=self.registry,
        )
        self.durations = prometheus.Histogram(
            "drillrig_job_seconds",
            "Time a job took",
            ["kind"],
            registry=self.registry,
            buckets=(0.1, 0.3, 1, 3, 10, 30, 100, 300, 1000),
        )
        self.waiting = prometheus.Gauge("drillrig_jobs_waiting", "Jobs that wait", registry=self.registry)
        self.running = prometheus.Gauge("drillrig_jobs_running", "Jobs under way", registry=self.registry)

    def text(self) -> bytes:
        """All of them, as Prometheus reads them."""
        return prometheus.generate_latest(self.registry)

    def job(self, step: str, job: Job) -> None:
        """Count a step of a job."""
        self.jobs.labels(job.kind, step).inc()
        if job.started is not None and job.finished is not None and step == job.status:
            self.durations.labels(job.kind).observe(job.finished - job.started)
