"""The verbs of this package, carried out by a server.

A script moves from this machine to a server by one line:

    import drillrig_pin as drillrig                          # here
    drillrig = connect("http://rigs.example:8000")           # there

    rig = drillrig.load_rig("mkz49", boom_length=2.0)
    trajectory = drillrig.simulate(rig, drillrig.Scenario(duration=0.2))
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

from drillrig_pin import errors
from drillrig_pin.errors import DrillrigError, ModelError
from drillrig_pin.litter import temporary_folder
from drillrig_pin.scenario import Scenario as Case
from drillrig_pin.scenario import load_scenario
from drillrig_pin.trajectory import Trajectory, load_trajectory

if TYPE_CHECKING:
    import httpx

TOKEN = "DRILLRIG_TOKEN"
PREFIX = "urn:drillrig:error:"
#: A full queue is waited for this long [s].
PATIENCE = 120.0
#: One long poll [s].
POLL = 20.0


class ServerError(DrillrigError):
    """The server cannot be reached, or refuses. ``status``: of its answer, 0 without one."""

    def __init__(self, what: str, *, where: object = None, todo: str = "", status: int = 0) -> None:
        super().__init__(what, where=where, todo=todo)
        self.status = status


@dataclass(frozen=True, slots=True)
class RemoteRig:
    """A rig on a server: its name there, and the arguments that differ from its own numbers."""

    name: str
    arguments: dict[str, Any] = field(default_factory=dict)


def connect(url: str, token: str | None = None, *, transport: Any = None) -> Client:
    """A server as an object with the verbs of this package.

    Args:
        url: e.g. ``http://127.0.0.1:8000``.
        token: of the server; None: that of the environment variable ``DRILLRIG_TOKEN``, if it is set.
        transport: of httpx, for tests.

    Raises:
        ServerError: no drillrig server answers there.
    """
    client = Client(url, token, transport=transport)
    client.health()
    return client


class Client:
    """One server. Every method raises the error the same verb raises locally, or :class:`ServerError`."""

    Scenario: ClassVar[type[Case]] = Case
    load_scenario = staticmethod(load_scenario)
    load_trajectory = staticmethod(load_trajectory)

    def __init__(self, url: str, token: str | None = None, *, transport: Any = None) -> None:
        import httpx

        token = token or os.environ.get(TOKEN)
        headers = {"Authorization": f"Bearer {token}"} if token else {}
        limits = httpx.Timeout(30.0, read=POLL + 40.0)
        self.url = url.rstrip("/")
        self._http = httpx.Client(base_url=self.url, headers=headers, timeout=limits, transport=transport)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection."""
        self._http.close()

    def health(self) -> dict[str, Any]:
        """Version of the server, and how much it has to do."""
        return self._json("GET", "/healthz")

    def models(self) -> list[dict[str, Any]]:
        """The models the server offers."""
        found: list[dict[str, Any]] = self._answer("GET", "/v1/models").json()
        return found

    def load_rig(self, path_or_name: str | Path, **arguments: Any) -> RemoteRig:
        """A rig of the server's library, or a plain ``.urdf`` file of this machine, which is uploaded.

        Raises:
            ModelError: no such model or argument; a xacro file, which a server evaluates only in its own library.
        """
        path = Path(path_or_name)
        if path.suffix == ".xacro":
            raise ModelError(
                "a server takes no xacro, which is a program",
                where=str(path),
                todo=f"Send what `drillrig expand {path}` writes.",
            )
        if path.suffix != ".urdf":
            rig = RemoteRig(str(path_or_name), arguments)
            self._json("GET", f"/v1/models/{rig.name}")
            return rig
        try:
            text = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise ModelError(f"cannot be read ({error})", where=str(path), todo="Check the path.") from None
        if arguments:
            raise ModelError(f"a plain URDF has no argument {next(iter(arguments))!r}", where=str(path))
        return self.load_rig_text(text)

    def load_rig_text(self, text: str) -> RemoteRig:
        """Upload a plain URDF."""
        found = self._json("POST", "/v1/uploads", content=text.encode(), headers={"Content-Type": "application/xml"})
        return RemoteRig(found["model"])

    def check_model(self, path_or_name: str | Path, arguments: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Everything wrong or suspicious in a model, as ``drillrig check --json``."""
        rig = self.load_rig(path_or_name)
        return self._json("POST", f"/v1/models/{rig.name}/check", json={"arguments": dict(arguments or {})})

    def simulate(
        self, rig: RemoteRig, scenario: Case | None = None, progress: Callable[[float], None] | None = None
    ) -> Trajectory:
        """Simulate one case there and bring its trajectory here; see :func:`drillrig_pin.simulation.simulate`.

        A case the server has computed before is not computed again. Ctrl-C cancels it.
        """
        scenario = scenario or Case()
        run = self.submit(rig, scenario)
        try:
            run = self._ended("/v1/runs", run, lambda share: progress and progress(share * scenario.duration))
        except KeyboardInterrupt:
            self._json("POST", f"/v1/runs/{run['id']}/cancel")
            raise
        return self.fetch(run["id"])

    def simulate_many(
        self, cases: Iterable[tuple[RemoteRig, Case]], keep: Callable[[Trajectory], Any] | None = None
    ) -> list[Any]:
        """Simulate many cases side by side; see :func:`drillrig_pin.simulation.simulate_many`."""
        runs = [self.submit(*case) for case in cases]
        found = []
        for run in runs:
            trajectory = self.fetch(self._ended("/v1/runs", run)["id"])
            found.append(trajectory if keep is None else keep(trajectory))
        return found

    def submit(self, rig: RemoteRig, scenario: Case) -> dict[str, Any]:
        """Ask for a run and do not wait for it; gives how it stands."""
        fields = scenario.model_dump(mode="json", exclude_unset=True, exclude={"model", "arguments"})
        request = {"model": rig.name, "arguments": rig.arguments, "scenario": fields}
        return self._json("POST", "/v1/runs", json=request)

    def run(self, number: str) -> dict[str, Any]:
        """How a run stands."""
        return self._json("GET", f"/v1/runs/{number}")

    def runs(self, search: str = "") -> Iterator[dict[str, Any]]:
        """Runs of the server, latest first."""
        after: dict[str, str] = {}
        while True:
            page = self._json("GET", "/v1/runs", params={"search": search, "limit": "200", **after})
            yield from page["items"]
            if page["next"] is None:
                return
            after = {"after": page["next"]}

    def fetch(self, number: str) -> Trajectory:
        """The trajectory of a completed run."""
        with temporary_folder() as folder:
            path = Path(folder, "run.nc")
            path.write_bytes(self._answer("GET", f"/v1/runs/{number}/result").content)
            return load_trajectory(path)

    def metrics(self, number: str) -> dict[str, Any]:
        """The numbers of a completed run with unit, limit and verdict. SI units, pressures absolute."""
        return self._json("GET", f"/v1/runs/{number}/metrics")

    def report(self, number: str) -> str:
        """The report of a completed run: one HTML page."""
        return self._answer("GET", f"/v1/runs/{number}/report").text

    def compare(self, reference: str, other: str) -> dict[str, Any]:
        """In what two runs differ, as ``drillrig compare --json``."""
        return self._json("GET", "/v1/compare", params={"a": reference, "b": other})

    def run_study(
        self, study: Mapping[str, Any], target: str | Path, listener: Callable[[dict[str, Any]], None] | None = None
    ) -> Path:
        """Carry out a study there and write its table here, as Parquet.

        Args:
            study: the document, as in a study file.
            target: the table.
            listener: called now and then with how it stands.
        """
        found = self._json("POST", "/v1/studies", json=dict(study))
        found = self._ended("/v1/studies", found, lambda _: None, listener)
        path = Path(target)
        path.write_bytes(self._answer("GET", f"/v1/studies/{found['id']}/table", params={"format": "parquet"}).content)
        return path

    def _ended(
        self,
        base: str,
        job: dict[str, Any],
        progress: Callable[[float], Any] = lambda _: None,
        listener: Callable[[dict[str, Any]], None] | None = None,
    ) -> dict[str, Any]:
        wait = 1.0
        while job["status"] in ("queued", "running"):
            progress(job["progress"])
            if listener is not None:
                listener(job)
            job = self._json("GET", f"{base}/{job['id']}", params={"wait": str(wait)})
            # Somebody who watches is told often; a connection need not be opened every second for nobody.
            wait = min(POLL, 2 * wait) if listener is None else 1.0
        if job["status"] == "failed":
            raise _error(job["error"])
        if job["status"] == "cancelled":
            raise ServerError("it was cancelled on the server", where=f"{self.url}{base}/{job['id']}")
        progress(1.0)
        return job

    def _json(self, method: str, path: str, **options: Any) -> dict[str, Any]:
        found: dict[str, Any] = self._answer(method, path, **options).json()
        return found

    def _answer(self, method: str, path: str, **options: Any) -> httpx.Response:
        import httpx

        end = time.monotonic() + PATIENCE
        while True:
            try:
                answer = self._http.request(method, path, **options)
            except httpx.TransportError as error:
                raise ServerError(
                    f"the server cannot be reached ({error or type(error).__name__})",
                    where=self.url,
                    todo="Start it with: drillrig serve",
                ) from None
            wait = answer.headers.get("retry-after", "")
            if answer.status_code == 429 and wait.isdecimal() and time.monotonic() + int(wait) < end:
                time.sleep(int(wait))
                continue
            if answer.is_success:
                return answer
            raise self._refused(answer)

    def _refused(self, answer: httpx.Response) -> DrillrigError:
        try:
            return _error(answer.json())
        except (json.JSONDecodeError, KeyError, TypeError):
            return ServerError(
                f"this is no answer of a drillrig server (status {answer.status_code})",
                where=self.url,
                todo="Check the address.",
            )


def _error(problem: Mapping[str, Any]) -> DrillrigError:
    """The error a problem stands for."""
    what, where, todo = problem["what"], problem["where"], problem["todo"]
    kind = getattr(errors, str(problem["type"]).removeprefix(PREFIX), None)
    if isinstance(kind, type) and issubclass(kind, DrillrigError):
        error = kind(what, where=where, todo=todo)
        error.field = problem.get("field")
        return error
    return ServerError(what, where=where, todo=todo, status=int(problem["status"]))
