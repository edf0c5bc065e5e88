"""The live page: one small HTTP server in this process, so that nothing is left when the process ends."""

from __future__ import annotations

import json
import queue
import threading
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from drillrig_pin.errors import ScenarioError
from drillrig_pin.replay.page import live_page, viewer_script

#: Ports tried when none is asked for, so that the address is nearly always the same one; after them any free one.
USUAL_PORTS = range(7000, 7020)
LOOPBACK = ("127.0.0.1", "localhost", "::1")
#: A silent connection is spoken to this often [s], so that both ends notice when the other has gone.
HEARTBEAT = 15.0


class LiveServer:
    """Serves the page, Meshcat's viewer, the newest scene, and an event for every change.

    Args:
        title: of the page until the scene brings its own.
        host: address to listen on; the default is reached from this machine only.
        port: None: the first usual one that is free.

    Raises:
        ScenarioError: the address or port cannot be had.
    """

    def __init__(self, title: str, host: str = "127.0.0.1", port: int | None = None) -> None:
        self._page = live_page(title).encode()
        self._viewer = viewer_script().encode()
        self._scene: bytes | None = None
        self._state: tuple[str, str] | None = None
        self._listeners: set[queue.SimpleQueue[tuple[str, str]]] = set()
        self._lock = threading.Lock()
        self.frames: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._http = _listen(host, port, self)
        self.host = host
        threading.Thread(target=self._http.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True).start()

    @property
    def port(self) -> int:
        """The port it listens on."""
        return int(self._http.server_address[1])

    @property
    def url(self) -> str:
        """Where a browser of this machine finds it."""
        local = "localhost" if self.host in (*LOOPBACK, "0.0.0.0", "::", "") else self.host
        return f"http://{local}:{self.port}/"

    def show(self, scene: bytes, words: dict[str, Any]) -> None:
        """Show a scene in every open page, in place of the one before."""
        head = json.dumps(words).encode()
        with self._lock:
            self._scene = len(head).to_bytes(4, "little") + head + scene
            self._state = None
        self._tell("scene", "")

    def say(self, event: str, text: str) -> None:
        """Write a sentence over every open page: ``trouble`` or ``busy``; empty: take it away."""
        message = (event, json.dumps(text))
        with self._lock:
            self._state = message if text else None
        self._tell(*message)

    def close(self) -> None:
        """Stop listening."""
        self._http.shutdown()
        self._http.server_close()

    def _tell(self, event: str, data: str) -> None:
        with self._lock:
            for listener in self._listeners:
                listener.put((event, data))

    def _listen(self) -> queue.SimpleQueue[tuple[str, str]]:
        listener: queue.SimpleQueue[tuple[str, str]] = queue.SimpleQueue()
        with self._lock:
            if self._scene is not None:
                listener.put(("scene", ""))
            if self._state is not None:
                listener.put(self._state)
            self._listeners.add(listener)
        return listener

    def _forget(self, listener: queue.SimpleQueue[tuple[str, str]]) -> None:
        with self._lock:
            self._listeners.discard(listener)

    def answer(self, path: str) -> tuple[str, bytes] | None:
        """Type and content of a path; None if there is nothing."""
        with self._lock:
            scene = self._scene
        found = {
            "/": ("text/html; charset=utf-8", self._page),
            "/meshcat.js": ("text/javascript; charset=utf-8", self._viewer),
            "/scene": ("application/octet-stream", scene),
        }.get(path)
        return None if found is None or found[1] is None else (found[0], found[1])

    def follow(self, write: Any) -> None:
        """Write events to one page until it is gone."""
        listener = self._listen()
        try:
            while True:
                try:
                    event, data = listener.get(timeout=HEARTBEAT)
                    write(f"event: {event}\ndata: {data}\n\n".encode())
                except queue.Empty:
                    write(b": still here\n\n")
        except OSError:
            pass
        finally:
            self._forget(listener)


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    live: LiveServer

    def do_GET(self) -> None:
        path = self.path.partition("?")[0]
        if not self._asked_for_us():
            self.send_error(HTTPStatus.FORBIDDEN)
        elif path == "/events":
            self.send_response(HTTPStatus.OK)
            self.send_header("Content-Type", "text/event-stream")
            self.send_header("Cache-Control", "no-store")
            self.send_header("Connection", "close")
            self.end_headers()
            self.close_connection = True
            self.live.follow(self._write)
        elif (found := self.live.answer(path)) is not None:
            kind, content = found
            self.send_response(HTTPStatus.OK)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(content)))
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            self._write(content)
        else:
            self.send_error(HTTPStatus.NOT_FOUND)

    def do_POST(self) -> None:
        """A picture of one frame, from the page that films itself."""
        length = int(self.headers.get("Content-Length", 0))
        if not self._asked_for_us() or self.path != "/frame" or not 0 <= length < 50_000_000:
            self.send_error(HTTPStatus.NOT_FOUND)
            return
        self.live.frames.put(self.rfile.read(length))
        self.send_response(HTTPStatus.NO_CONTENT)
        self.end_headers()

    def _asked_for_us(self) -> bool:
        """A page of another site that a browser was tricked into asking us carries that site's name."""
        host = self.headers.get("Host", "").rsplit(":", 1)[0].strip("[]")
        return self.live.host not in LOOPBACK or host in LOOPBACK

    def _write(self, content: bytes) -> None:
        try:
            self.wfile.write(content)
            self.wfile.flush()
        except OSError:
            self.close_connection = True
            raise

    def log_message(self, format: str, *args: Any) -> None:
        """Requests are nobody's business."""


class _QuietServer(ThreadingHTTPServer):
    daemon_threads = True
    allow_reuse_address = True

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A page that was closed while it was being answered is no error."""


def _listen(host: str, port: int | None, live: LiveServer) -> _QuietServer:
    handler = type("Handler", (_Handler,), {"live": live})
    reason = ""
    for candidate in (*USUAL_PORTS, 0) if port is None else (port,):
        try:
            return _QuietServer((host, candidate), handler)
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            if not isinstance(error, OSError):
                break
    where = host if port is None else f"{host}:{port}"
    raise ScenarioError(f"cannot listen on {where} ({reason})", where="replay", todo="Choose another --host or --port.")
