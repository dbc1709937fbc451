"""Only who knows the address sees the page, nobody can hold it up, and it ends."""

import contextlib
import http.client
import json
import shutil
import socket
import subprocess
import threading
import time
import urllib.parse
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from paravol.flight.flight_events import HeadLoaded, Injured, Progressed, RecordingBegan
from paravol.instructor import InstructorPage, page_server
from paravol.instructor.flight_watcher import FlightWatcher
from paravol.instructor.page_server import MOST_CONNECTIONS, PICTURES_PER_S
from scenarios import load_scenario
from system import UserError
from tests.paravol.instructor.made_flight import Hazards, frame

SCENARIO = load_scenario("first_flight")[0]
CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium-headless-shell", "chromium"))), None
)
PARTS = "instructor.css", "instructor.js", "picture.jpg", "state.json"
LIMIT_S = 30.0


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch) -> Iterator[InstructorPage]:
    monkeypatch.setattr(page_server, "HEARTBEAT_S", 0.1)
    monkeypatch.setattr(page_server, "PICTURES_PER_S", 100.0)
    monkeypatch.setattr(page_server, "STATES_PER_S", 100.0)
    with InstructorPage() as served:
        yield served


@pytest.fixture
def watcher(page: InstructorPage) -> FlightWatcher:
    page.watcher(SCENARIO)(frame(1))
    assert page.shown is not None
    return page.shown


def ask(
    page: InstructorPage, path: str, *, host: str | None = None, method: str = "GET"
) -> tuple[int, bytes, dict[str, str]]:
    """Ask for a path of the server; host: what a browser says it asks."""
    asked = http.client.HTTPConnection("127.0.0.1", page.port, timeout=LIMIT_S)
    asked.putrequest(method, path, skip_host=True)
    if host != "":
        asked.putheader("Host", host or f"127.0.0.1:{page.port}")
    asked.endheaders()
    answer = asked.getresponse()
    told = answer.status, answer.read(), dict(answer.headers)
    asked.close()
    return told


def way(page: InstructorPage, name: str = "") -> str:
    return urllib.parse.urlsplit(page.address).path + name


def stream(page: InstructorPage, name: str) -> socket.socket:
    """Begin an endless answer."""
    made = socket.create_connection(("127.0.0.1", page.port), LIMIT_S)
    line = f"GET {way(page, name)} HTTP/1.1\r\nHost: localhost:{page.port}\r\n\r\n"
    made.sendall(line.encode())
    return made


def until(holds: Callable[[], bool]) -> None:
    ends = time.monotonic() + LIMIT_S
    while not holds():
        assert time.monotonic() < ends
        time.sleep(0.005)


def read_until(reader: socket.socket, words: bytes) -> bytes:
    data = b""
    while words not in data:
        part = reader.recv(1 << 16)
        assert part
        data += part
    return data


def test_who_knows_the_address_sees_the_page(
    page: InstructorPage, watcher: FlightWatcher
) -> None:
    status, text, headers = ask(page, way(page))
    assert status == 200
    assert b"<h1" in text
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert b"style=" not in text
    assert text.count(b"<script") == 1
    for part in PARTS:
        status, content, headers = ask(page, way(page, part))
        assert status == 200
        assert content
        assert headers["Cache-Control"] == "no-store"
    assert json.loads(ask(page, way(page, "state.json"))[1])["clock_s"] == 0.1
    assert ask(page, way(page), host=f"localhost:{page.port}")[0] == 200


@pytest.mark.parametrize("part", ["", *PARTS, "pictures", "states"])
def test_without_the_token_there_is_nothing(page: InstructorPage, part: str) -> None:
    token = way(page).strip("/")
    wrong = "x" * len(token), token[:-1], token + "x", "", "%00", token.swapcase()
    for words in wrong:
        assert ask(page, f"/{words}/{part}")[0] == 404
    assert ask(page, f"/{token}")[0] == 404
    assert token.encode() not in ask(page, "/")[1]


@pytest.mark.parametrize("name", ["../page_server.py", "instructor.html", "x", "/"])
def test_nothing_else_of_the_disk_is_served(page: InstructorPage, name: str) -> None:
    assert ask(page, way(page, name))[0] == 404


@pytest.mark.parametrize(
    "host", ["", "evil.example", "127.0.0.1", "localhost", "evil.example:{port}"]
)
def test_another_host_is_refused_whatever_it_knows(
    page: InstructorPage, watcher: FlightWatcher, host: str
) -> None:
    """A page from elsewhere can let its name mean this machine, not hide the name."""
    for name in ("", "state.json", "pictures"):
        told = ask(page, way(page, name), host=host.format(port=page.port))
        assert (told[0], told[1]) == (421, b"Misdirected Request")


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS"])
def test_nothing_can_be_written(page: InstructorPage, method: str) -> None:
    assert ask(page, way(page), method=method)[0] == 501


def test_the_token_is_long_and_never_the_same() -> None:
    with InstructorPage() as first, InstructorPage() as second:
        tokens = {way(page).strip("/") for page in (first, second)}
        assert first.port != second.port
    assert len(tokens) == 2
    assert min(map(len, tokens)) >= 22  # 128 bits at 6 bits a letter


def test_it_listens_on_this_machine_only(page: InstructorPage) -> None:
    assert page._server.server_address[0] == "127.0.0.1"
    with pytest.raises(UserError, match="choose another"):
        InstructorPage(page.port)
    with pytest.raises(UserError, match="choose another"):
        InstructorPage(70000)


def test_before_a_flight_it_says_so(page: InstructorPage) -> None:
    page.watcher(SCENARIO)  # of one that nobody has begun
    assert json.loads(ask(page, way(page, "state.json"))[1]) == {
        "stage": "No flight yet"
    }
    assert ask(page, way(page, "picture.jpg"))[0] == 503


def test_pictures_and_states_follow_the_flight_and_the_next(
    page: InstructorPage, watcher: FlightWatcher
) -> None:
    with stream(page, "pictures") as pictures, stream(page, "states") as states:
        for number in range(2, 6):
            watcher.hear(frame(number))
            picture = watcher.picture()
            assert picture is not None
            assert picture in read_until(pictures, picture)
            read_until(states, f'"clock_s": {0.1 * number}'.encode())
        follow = page.watcher(SCENARIO)
        watcher.hear(frame(6))
        read_until(states, b'"clock_s": 0.6000')  # the next has not begun
        follow(Progressed("Building the head", 0.1))
        read_until(states, b'"stage": "Building the head: 10 %"')
        follow(frame(9))
        assert page.shown is not None
        picture = page.shown.picture()
        assert picture is not None
        read_until(pictures, picture)


def test_a_reader_that_does_not_read_gets_the_newest_and_holds_nobody_up(
    page: InstructorPage, watcher: FlightWatcher
) -> None:
    noise, newest = np.random.default_rng(3), None
    with stream(page, "pictures") as slow, stream(page, "pictures") as quick:
        for number in range(60):
            pixels = noise.integers(0, 256, (512, 512, 3), np.uint8)
            watcher.hear(frame(number, pixels))
            newest = watcher.picture()
            assert newest is not None
            read_until(quick, newest)  # whoever reads sees every one
        # what waits for the slow one: in the system's buffers, some pictures of 60
        assert newest is not None
        data = read_until(slow, newest)
        assert data.count(b"image/jpeg") < 40


def test_more_than_so_many_are_turned_away_and_make_room_when_they_leave(
    page: InstructorPage, watcher: FlightWatcher
) -> None:
    readers = [stream(page, "states") for _ in range(MOST_CONNECTIONS)]
    for reader in readers:
        read_until(reader, b"clock_s")
    assert len(page._server._open) == MOST_CONNECTIONS
    with stream(page, "states") as late, contextlib.suppress(ConnectionResetError):
        assert late.recv(1) == b""
    for reader in readers:
        reader.close()
    until(lambda: len(page._server._open) == 0)
    assert ask(page, way(page))[0] == 200


def test_who_says_nothing_is_let_go(
    page: InstructorPage, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(page_server._Handler, "timeout", 0.05)
    with socket.create_connection(("127.0.0.1", page.port), LIMIT_S) as mute:
        mute.sendall(b"GET /")
        assert mute.recv(1) == b""
    until(lambda: len(page._server._open) == 0)


def test_strangers_lock_nobody_out(
    page: InstructorPage, watcher: FlightWatcher, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However many there are, and though each says a byte now and then."""
    monkeypatch.setattr(page_server, "REQUEST_S", 1.0)
    made = [
        socket.create_connection(("127.0.0.1", page.port), LIMIT_S)
        for _ in range(3 * MOST_CONNECTIONS)
    ]
    until(lambda: len(page._server._open) <= MOST_CONNECTIONS + 1)
    assert ask(page, way(page))[0] == 200
    with stream(page, "states") as reader:
        read_until(reader, b"clock_s")
        ends = time.monotonic() + LIMIT_S
        # they drip, and are let go all the same; who knows the token is not
        while len(page._server._open) > 1 and time.monotonic() < ends:
            for stranger in made:
                with contextlib.suppress(OSError):
                    stranger.send(b"G")
            time.sleep(0.1)
        assert len(page._server._open) == 1
        watcher.hear(frame(2))
        read_until(reader, b"clock_s")
    for stranger in made:
        stranger.close()


def test_the_end_ends_all_answers_and_threads(
    page: InstructorPage, watcher: FlightWatcher
) -> None:
    before = set(threading.enumerate())
    readers = [stream(page, name) for name in ("pictures", "states", "states")]
    for reader in readers:
        read_until(reader, b"Content-Type")
    serving = set(threading.enumerate()) - before
    assert len(serving) == 3
    page.close()
    page.close()
    for reader in readers:
        while reader.recv(1 << 16):
            pass
        reader.close()
    for thread in serving:
        thread.join(LIMIT_S)
        assert not thread.is_alive()
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", page.port), LIMIT_S)


def test_everybody_sees_few_pictures_a_second() -> None:
    """Encoding one takes 2 ms of a machine that draws 60 a second for the trainee."""
    assert 2.0 <= PICTURES_PER_S <= 10.0


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium to look with")
def test_a_browser_shows_the_live_picture_and_the_words(tmp_path: Path) -> None:
    """Titles from a file are text, whatever they look like."""
    hostile = "<img src=x onerror=document.body.remove()>"
    scenario = SimpleNamespace(title=hostile, tasks=(), scope=SCENARIO.scope)
    with InstructorPage() as page:
        hear = page.watcher(scenario)  # type: ignore[arg-type]
        hazards = Hazards(orbit=2.0, **{"optic nerve": 6.0})
        hear(HeadLoaded(SimpleNamespace(hazards=hazards)))  # type: ignore[arg-type]
        hear(RecordingBegan(None))
        hear(Injured("orbit, right: through the lamina papyracea, by the forceps"))
        pixels = np.zeros((256, 256, 3), np.uint8)
        pixels[..., 0] = 230
        hear(frame(77, pixels))
        shot = tmp_path / "page.png"
        command = [str(CHROMIUM), "--no-sandbox", "--disable-gpu", "--hide-scrollbars"]
        command += [f"--screenshot={shot}", "--window-size=1280,800"]
        command += ["--timeout=6000", page.address]
        subprocess.run(command, capture_output=True, timeout=120, check=True)
    image = np.asarray(Image.open(shot).convert("RGB")).astype(int)
    red = (image[..., 0] > 200) & (image[..., 1:].max(-1) < 40)
    assert red.sum() > 0.2 * red.size  # the live picture
    ink = (image.max(-1) < 90).sum()
    assert ink > 2000  # the words, which a title that runs would have removed
