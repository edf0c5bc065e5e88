"""Where work goes: processes of this machine, or a Dask cluster. Both answer with futures."""

from __future__ import annotations

import asyncio
import atexit
import contextlib
import multiprocessing
import multiprocessing.process
import os
import shutil
import signal
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError, Future
from pathlib import Path
from typing import Any, Protocol

from drillrig_pin.errors import DrillrigError
from drillrig_pin.litter import FOLDER, marked, remove_litter

#: Environment of the workers. No library starts threads of its own: the cores are taken already. glibc keeps the memory
#: of one run's arrays for the next one: asking the system for zeroed pages again costs 2 % of the time.
ENVIRONMENT = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "MALLOC_MMAP_THRESHOLD_": str(32 << 20),
    "MALLOC_TRIM_THRESHOLD_": str(512 << 20),
}


#: How Dask says that a connection is no more. Timeouts and closed sockets are OSErrors; a closed loop or client is a
#: RuntimeError; a question that its loop cancels in the middle leaves no answer to return: UnboundLocalError.
BROKEN = (OSError, RuntimeError, CancelledError, asyncio.CancelledError, UnboundLocalError)


#: Longest name of a socket [bytes].
SOCKET = 107


class BatchError(DrillrigError):
    """The study cannot go on; what is recorded is safe."""


class TimeOutError(Exception):
    """A task was stopped because it took too long."""


class DiedError(Exception):
    """The process that worked on a task ended."""


class Pool(Protocol):
    """Something that works on tasks side by side."""

    @property
    def workers(self) -> int:
        """How many tasks are worked on at once."""

    @property
    def local(self) -> bool:
        """Whether the workers see the files of this machine."""

    def submit(self, timeout: float | None, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Start a task; see :func:`outcome_of` for what comes of it."""

    def require_alive(self) -> None:
        """Raise :class:`BatchError` if no task will ever be answered."""

    def close(self) -> None:
        """Stop at once, whatever is under way."""


class LocalPool:
    """Worker processes of this machine, kept alive by Pebble: one that dies is replaced, one that hangs is killed.

    Args:
        workers: how many; None: one a core.
        preload: modules that every worker finds imported.
    """

    local = True

    def __init__(self, workers: int | None = None, preload: Sequence[str] = ("drillrig_pin.batch.worker",)) -> None:
        self._preload = ["drillrig_pin.batch.orphans", *preload]
        self.workers = workers or len(os.sched_getaffinity(0))
        self._environment = {name: os.environ.get(name) for name in ENVIRONMENT}
        os.environ.update(ENVIRONMENT)
        self._pool = self._made()

    def _made(self) -> Any:
        import pebble

        _shorten_sockets()
        # Forking this process would copy its threads in mid-flight. A server that has none imports everything once and
        # forks the workers, also those that replace a dead one.
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload(self._preload)
        return pebble.ProcessPool(self.workers, context=context)

    def submit(self, timeout: float | None, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """See :class:`Pool`. A pool all of whose idle workers were killed is made anew."""
        # Workers inherit that they ignore Ctrl-C, which otherwise reaches them before they can say so themselves.
        before = signal.signal(signal.SIGINT, signal.SIG_IGN) if _in_main_thread() else None
        try:
            return self._schedule(timeout, function, arguments)
        finally:
            if before is not None:
                signal.signal(signal.SIGINT, before)

    def _schedule(self, timeout: float | None, function: Callable[..., Any], arguments: Any) -> Future[Any]:
        try:
            future: Future[Any] = self._pool.schedule(function, args=arguments, timeout=timeout)
        except RuntimeError:
            self._end()
            self._pool = self._made()
            try:
                future = self._pool.schedule(function, args=arguments, timeout=timeout)
            except (RuntimeError, OSError) as error:
                raise _no_workers(error) from None
        except OSError as error:
            raise _no_workers(error) from None
        return future

    def require_alive(self) -> None:
        """Workers of this machine are replaced when they end."""

    def close(self) -> None:
        """Kill the workers."""
        self._end()
        for name, value in self._environment.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value

    def _end(self) -> None:
        self._pool.stop()
        self._pool.join()


def _no_workers(error: Exception) -> BatchError:
    reason = " ".join(str(error).split())[:160]
    return BatchError(
        f"worker processes cannot be started{f' ({reason})' if reason else ''}",
        where=tempfile.gettempdir(),
        todo="They need a folder for temporary files (TMPDIR), /dev/shm, and room under ulimit -n, -u and -v.",
    )


def _shorten_sockets() -> None:
    """Give multiprocessing a folder for its sockets whose name is short enough, and that a later command removes."""
    config = multiprocessing.process.current_process()._config  # type: ignore[attr-defined]
    if config.get("tempdir") is not None:
        return
    for place in (tempfile.gettempdir(), "/tmp", "/var/tmp"):
        folder = Path(place, marked(FOLDER))
        if len(os.fsencode(folder)) + len("/listener-12345678") > SOCKET:
            continue
        with contextlib.suppress(OSError):
            remove_litter(folder.parent, FOLDER)
            folder.mkdir(mode=0o700)
            config["tempdir"] = str(folder)
            atexit.register(shutil.rmtree, folder, ignore_errors=True)
            return


def _in_main_thread() -> bool:
    import threading

    return threading.current_thread() is threading.main_thread()


class ClusterPool:
    """Workers of a Dask cluster. They need the same version of this package, and model files at the same paths.

    Whatever breaks between here and there comes out as :class:`BatchError`: its libraries tell of it in many ways.

    Raises:
        BatchError: no scheduler answers, it is of another version, or it has no workers.
    """

    local = False
    #: Until the first worker is there [s].
    PATIENCE = 30
    #: Until a scheduler that listens, but is busy, answers [s]. One that does not listen refuses at once.
    SLOW = 300

    def __init__(self, address: str) -> None:
        import logging

        import distributed

        # What it would tell of a lost connection, at length, is said in one sentence here.
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        self.address = address
        self._broken = (*BROKEN, distributed.client.ClosedClientError)
        try:
            _require_listener(address, self.SLOW)
            make: Any = distributed.Client
            self._client: Any = make(address, timeout=self.SLOW, set_as_default=False)
        except ImportError as error:
            raise BatchError(
                f"the scheduler cannot be used ({_in_short(error)})",
                where=address,
                todo="Scheduler, workers and this command need the same versions.",
            ) from None
        except (*self._broken, TypeError, ValueError) as error:
            raise BatchError(
                f"no scheduler answers ({_in_short(error)})", where=address, todo="Start one with: dask scheduler"
            ) from None
        try:
            self._client.wait_for_workers(1, timeout=self.PATIENCE)
        except TimeoutError:
            self.close()
            raise BatchError(
                "the scheduler has no workers", where=address, todo=f"Start some with: dask worker {address}"
            ) from None
        except self._broken:
            self.close()
            raise self._gone() from None

    @property
    def workers(self) -> int:
        """Threads of all workers there are now; 1 if nobody can say."""
        try:
            threads: dict[str, int] = self._client.nthreads()
        except self._broken:
            return 1
        return max(1, sum(threads.values()))

    def submit(self, timeout: float | None, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """See :class:`Pool`. A task of a cluster cannot be killed from here: the worker itself watches the time."""
        try:
            task: Future[Any] = self._client.submit(function, *arguments, pure=False)
        except self._broken:
            # The connection broke before the client noticed.
            raise self._gone() from None
        return task

    def require_alive(self) -> None:
        """BatchError once the scheduler is gone."""
        if self._client.status != "running":
            raise self._gone()

    def _gone(self) -> BatchError:
        return BatchError(
            "the scheduler went away",
            where=self.address,
            todo="Everything recorded is safe; with a scheduler again, the same command goes on from there.",
        )

    def close(self) -> None:
        """Give up what is under way."""
        # A scheduler that is gone cannot be told, and need not be. Its client may then doubt its state: AssertionError.
        with contextlib.suppress(*self._broken, AssertionError):
            self._client.close(timeout=2)


def _in_short(error: BaseException) -> str:
    return " ".join(str(error).split())[:120] or type(error).__name__


def _require_listener(address: str, patience: float) -> None:
    """OSError if nothing listens there: Dask would try again until its patience ends."""
    import socket

    from distributed.comm.addressing import parse_address, parse_host_port

    scheme, place = parse_address(address)
    if scheme in ("tcp", "tls"):
        socket.create_connection(parse_host_port(place, 8786), timeout=patience).close()


def outcome_of(future: Any) -> tuple[Any, BaseException | None]:
    """What a task gave, or why it gave nothing, in the words of this module.

    Nothing is raised: also an answer that is there, but cannot be fetched any more, is a reason.
    """
    if future.cancelled():
        return None, DiedError("cancelled")
    try:
        error: BaseException | None = future.exception()
        if error is None:
            return future.result(), None
    except BROKEN as lost:
        return None, DiedError(f"its answer did not arrive: {_in_short(lost)}")
    except Exception as unreadable:
        return None, unreadable
    if isinstance(error, TimeoutError):
        return None, TimeOutError(str(error))
    if type(error).__name__ in ("ProcessExpired", "BrokenProcessPool", "KilledWorker"):
        code = getattr(error, "exitcode", None)
        return None, DiedError(f"exit code {code}" if code is not None else str(error))
    return None, error
