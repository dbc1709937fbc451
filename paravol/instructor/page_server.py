"""The instructor's page, served on this machine to whoever knows its address.

The server is Python's own, a thread for each connection: there is one page with two
endless answers (pictures, states), all of it read-only, and a framework would bring a
dozen packages for that. It listens on the loopback interface, answers only GET under a
path that nobody can guess, and only where a browser asked for this very host, so that
no page from elsewhere gets at it under a name of its own (DNS rebinding).
"""

import hmac
import json
import math
import os
import secrets
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from socketserver import TCPServer
from typing import Any

from devices.port import Closing
from paravol.debrief.colours import templates
from paravol.flight.flight_events import Hear
from paravol.instructor.flight_watcher import FlightWatcher
from scenarios import Scenario
from system import UserError

LOOPBACK = "127.0.0.1"

PICTURES_PER_S = 6.0
STATES_PER_S = 5.0

MOST_CONNECTIONS = 16
"""A page takes two. More are turned away: each costs a thread. Of those that have not
shown the token there are so many as well; the oldest goes for a new one."""

REQUEST_S = 5.0
"""A connection that has not shown the token by then is closed, however busily it
speaks."""

PATIENCE_S = 10.0
"""A connection that takes or says nothing for so long is closed."""

HEARTBEAT_S = 2.0
"""Something is said at least so often: who has gone is found out by that."""

SEND_BUFFER_BYTES = 1 << 16
"""What waits for a slow reader in the system; about one picture."""

_BOUNDARY = "picture"
_BETWEEN = f"\r\n--{_BOUNDARY}\r\n".encode()
_TEMPLATES = Path(__file__).parent / "templates"

_HEADERS = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'none'; img-src 'self'; style-src 'self'; "
    "script-src 'self'; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


class InstructorPage(Closing):
    """Serve the page until it is closed; `watcher` gives it a flight to show."""

    def __init__(self, port: int = 0) -> None:
        """Listen at a port of this machine, 0 for any that is free.

        Raises UserError where nobody can listen there.
        """
        self._token = secrets.token_urlsafe(18)
        self.shown: FlightWatcher | None = None
        """The flight that is shown now."""
        self.is_closed = False
        page = self

        class Handler(_Handler):
            owner = page

        try:
            self._server = _Server((LOOPBACK, port), Handler)
        except (OSError, OverflowError) as error:
            raise UserError(
                f"The instructor's page cannot be served at port {port} ({error}); "
                "choose another one, or 0 for any."
            ) from error
        self._thread = threading.Thread(
            target=self._server.serve_forever,
            kwargs={"poll_interval": 0.05},
            name="instructor's page",
            daemon=True,
        )
        self._thread.start()

    @property
    def port(self) -> int:
        """Return where it listens."""
        return int(self._server.server_address[1])

    @property
    def address(self) -> str:
        """Return what to open in a browser; it is as secret as the flight."""
        return f"http://{LOOPBACK}:{self.port}/{self._token}/"

    def watcher(self, scenario: Scenario) -> Hear:
        """Return who hears of a flight; the page shows it as soon as it has begun."""
        return FlightWatcher(scenario, self._show).hear

    def _show(self, watcher: FlightWatcher) -> None:
        before, self.shown = self.shown, watcher
        if before is not None:
            before.wake()

    def close(self) -> None:
        """End all answers and stop listening; harmless when repeated."""
        if self.is_closed:
            return
        self.is_closed = True
        if self.shown is not None:
            self.shown.wake()
        self._server.shutdown()
        self._server.server_close()
        self._server.drop_all()
        self._thread.join()

    def knows(self, token: str) -> bool:
        """Return whether that is the page's path; the time taken tells nothing."""
        return hmac.compare_digest(token.encode(), self._token.encode())

    def hosts(self) -> frozenset[str]:
        """Return what a browser on this machine calls the host of the page."""
        return frozenset(f"{name}:{self.port}" for name in (LOOPBACK, "localhost"))


class _Server(ThreadingHTTPServer):
    """Serve a bounded number of connections, and know them."""

    daemon_threads = True
    request_queue_size = MOST_CONNECTIONS
    # elsewhere it would let another program listen at the same port
    allow_reuse_address = os.name == "posix"

    def __init__(self, *words: Any) -> None:
        self._open: dict[socket.socket, float] = {}
        """When each was made; inf once it has shown the token."""
        self._lock = threading.Lock()
        super().__init__(*words)

    def server_bind(self) -> None:
        """Bind without asking anybody for this machine's name."""
        TCPServer.server_bind(self)
        self.server_name, self.server_port = LOOPBACK, int(self.server_address[1])

    def process_request(self, request: Any, client_address: Any) -> None:
        """Serve a connection in a thread of its own, or turn it away."""
        with self._lock:
            strangers = [(s, c) for c, s in self._open.items() if s < math.inf]
            self._open[request] = time.monotonic()
        if len(strangers) >= MOST_CONNECTIONS:
            _drop(min(strangers, key=lambda each: each[0])[1])
        request.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER_BYTES)
        super().process_request(request, client_address)

    def shutdown_request(self, request: Any) -> None:
        """Forget a connection."""
        with self._lock:
            self._open.pop(request, None)
        super().shutdown_request(request)

    def admit(self, request: socket.socket) -> bool:
        """Keep a connection that has shown the token; False for one too many."""
        with self._lock:
            known = sum(made == math.inf for made in self._open.values())
            if known < MOST_CONNECTIONS and request in self._open:
                self._open[request] = math.inf
                return True
        return False

    def service_actions(self) -> None:
        """Close those that take too long to show the token."""
        oldest_s = time.monotonic() - REQUEST_S
        with self._lock:
            late = [c for c, made in self._open.items() if made < oldest_s]
        for connection in late:
            _drop(connection)

    def drop_all(self) -> None:
        """Close what is still being served."""
        with self._lock:
            left = list(self._open)
        for connection in left:
            _drop(connection)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of a reader that went away."""


def _drop(connection: socket.socket) -> None:
    """Let whoever serves or asks there find the end of it."""
    with suppress(OSError):
        connection.shutdown(socket.SHUT_RDWR)


class _Handler(BaseHTTPRequestHandler):
    """Answer one request."""

    owner: InstructorPage
    timeout = PATIENCE_S
    server_version = "paravol"
    sys_version = ""

    def do_GET(self) -> None:
        """Answer with a part of the page."""
        if self.headers.get("Host", "") not in self.owner.hosts():
            self._refuse(HTTPStatus.MISDIRECTED_REQUEST)
            return
        _, _, rest = self.path.partition("?")[0].partition("/")
        token, slash, name = rest.partition("/")
        parts: dict[str, Callable[[], None]] = {
            "": lambda: self._fill("html"),
            "instructor.css": lambda: self._fill("css"),
            "instructor.js": lambda: self._fill("javascript"),
            "picture.jpg": self._picture,
            "pictures": self._pictures,
            "state.json": self._state,
            "states": self._states,
        }
        if not slash or not self.owner.knows(token) or name not in parts:
            self._refuse(HTTPStatus.NOT_FOUND)
            return
        server = self.server
        assert isinstance(server, _Server)
        if not server.admit(self.connection):
            return
        parts[name]()

    def log_message(self, format: str, *words: object) -> None:
        """Say nothing: the terminal is the trainee's."""

    def _refuse(self, status: HTTPStatus) -> None:
        self._say("text/plain", status.phrase.encode(), status)

    def _begin(self, kind: str, status: HTTPStatus = HTTPStatus.OK) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        for name, value in _HEADERS.items():
            self.send_header(name, value)

    def _say(
        self, kind: str, content: bytes, status: HTTPStatus = HTTPStatus.OK
    ) -> None:
        text = kind.startswith("text/")
        self._begin(f"{kind}; charset=utf-8" if text else kind, status)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def _fill(self, kind: str) -> None:
        """Send one of the page's files; its colours are those of the debrief."""
        name = f"instructor.{kind.replace('javascript', 'js')}"
        content = templates(_TEMPLATES).get_template(name).render()
        self._say(f"text/{kind}", content.encode())

    def _picture(self) -> None:
        watcher = self.owner.shown
        picture = None if watcher is None else watcher.picture()
        if picture is None:
            self._refuse(HTTPStatus.SERVICE_UNAVAILABLE)
            return
        self._say("image/jpeg", picture)

    def _state(self) -> None:
        self._say("application/json", _text_of(self.owner.shown).encode())

    def _pictures(self) -> None:
        """Send picture after picture; who reads slowly gets fewer, never old ones."""
        self._begin(f"multipart/x-mixed-replace; boundary={_BOUNDARY}")
        self.end_headers()
        self.wfile.write(_BETWEEN)
        sent: bytes | None = None
        sent_s = -math.inf
        for watcher in self._news(PICTURES_PER_S):
            picture = None if watcher is None else watcher.picture()
            is_due = time.monotonic() > sent_s + HEARTBEAT_S
            if picture is None or (picture is sent and not is_due):
                continue
            # the boundary right behind it: by that a browser knows it is whole
            head = f"Content-Type: image/jpeg\r\nContent-Length: {len(picture)}\r\n"
            self.wfile.write(f"{head}\r\n".encode() + picture + _BETWEEN)
            sent, sent_s = picture, time.monotonic()

    def _states(self) -> None:
        """Send state after state, as server-sent events."""
        self._begin("text/event-stream")
        self.end_headers()
        sent, sent_s = "", -math.inf
        for watcher in self._news(STATES_PER_S):
            text = _text_of(watcher)
            if text != sent:
                self.wfile.write(f"data: {text}\n\n".encode())
            elif time.monotonic() > sent_s + HEARTBEAT_S:
                self.wfile.write(b": still here\n\n")
            else:
                continue
            sent, sent_s = text, time.monotonic()

    def _news(self, per_s: float) -> Iterator[FlightWatcher | None]:
        """Yield the shown flight when it has something new, at most so often.

        Also now and then without news; ends with the page.
        """
        version = -1
        while not self.owner.is_closed:
            watcher = self.owner.shown
            yield watcher
            time.sleep(1.0 / per_s)
            if watcher is None:
                continue
            if watcher is not self.owner.shown:
                version = -1
                continue
            version = watcher.wait(version, HEARTBEAT_S / 2)


def _text_of(watcher: FlightWatcher | None) -> str:
    told = {"stage": "No flight yet"} if watcher is None else watcher.state()
    return json.dumps(told, allow_nan=False)
