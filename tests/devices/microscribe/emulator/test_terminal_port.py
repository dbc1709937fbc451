import os
import sys
from pathlib import Path

import pytest

if sys.platform == "win32":
    pytest.skip("pseudo-terminals need POSIX", allow_module_level=True)

import serial

from devices.microscribe.emulator.emulated_line import RATES
from devices.microscribe.emulator.terminal_port import TerminalPort, client_rate

linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="of Linux")


@linux
@pytest.mark.parametrize("baud", RATES)
def test_the_clients_rate_is_read_from_the_terminal(baud: int) -> None:
    port = TerminalPort()
    with serial.Serial(port.name, baud):
        assert port.client_rate() == baud
    port.close()


def test_nobody_can_tell_the_rate_of_what_is_no_terminal() -> None:
    reading, writing = os.pipe()
    assert client_rate(reading) is None
    os.close(reading)
    os.close(writing)


def test_every_byte_passes_raw_both_ways() -> None:
    """Interrupts, line ends and flow control are ordinary bytes here."""
    port = TerminalPort()
    every = bytes(range(256))
    with serial.Serial(port.name, 115200, timeout=5.0) as client:
        port.write(every)
        assert client.read(256) == every
        client.write(every)
        heard = b""
        while len(heard) < 256:
            heard += port.read()
        assert heard == every
    port.close()


def test_it_outlives_its_clients_and_drops_what_nobody_reads() -> None:
    port = TerminalPort()
    for _ in range(2):
        with serial.Serial(port.name, timeout=5.0) as client:
            port.write(b"x")
            assert client.read(1) == b"x"
    for _ in range(100):
        port.write(bytes(1000))
    port.close()
    port.close()


def test_pulled_and_put_in_again_it_has_another_name(tmp_path: Path) -> None:
    link = tmp_path / "arm"
    port = TerminalPort(link)
    first = port.name
    assert link.readlink() == Path(first)
    client = serial.Serial(str(link), timeout=5.0)
    port.pull()
    port.pull()
    with pytest.raises(OSError, match=r"."):
        client.read(1)
    client.close()
    assert port.sources() == []
    with pytest.raises(OSError, match="not plugged"):
        port.read()
    port.plug()
    assert port.name != first
    assert link.readlink() == Path(port.name)
    port.close()
    assert not link.is_symlink()
    assert list(tmp_path.iterdir()) == []


def test_a_link_never_replaces_a_file(tmp_path: Path) -> None:
    file = tmp_path / "notes.txt"
    file.write_text("mine")
    with pytest.raises(FileExistsError):
        TerminalPort(file)
    assert file.read_text() == "mine"
    stale = tmp_path / "arm"
    stale.symlink_to("/dev/nowhere")
    port = TerminalPort(stale)
    assert stale.readlink() == Path(port.name)
    port.close()
