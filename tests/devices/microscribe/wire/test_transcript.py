import io
from collections.abc import Callable
from typing import Any

from devices.microscribe.wire.transcript import Transcript


def test_every_byte_of_a_session_is_written_with_its_meaning(
    rehearse: Callable[..., Any],
) -> None:
    log = io.StringIO()
    bench = rehearse("f8=5@packet:20")
    keeper = bench.connect(transcript=Transcript(log))
    bench.run(keeper, 0.6)
    keeper.close()
    lines = log.getvalue().splitlines()
    seconds = [float(line.split()[0]) for line in lines]
    assert seconds == sorted(seconds)
    assert {line.split()[1] for line in lines} == {"<", ">"}
    told = "\n".join(lines)
    for words in (
        "C5 49 4D 4D 43",
        "end any session, ask for attention",
        "attention",
        "begin a session",
        "product 'MSCR'",
        "ask joint parameters",
        "serial number = 'EMU00001'",
        "poll 23",
        "counts (13903, 6238, 6868, 4098, 3193, 8416) buttons 0",
        "ask end of the session",
    ):
        assert words in told
    sent = b"".join(
        bytes.fromhex(line.split(maxsplit=3)[3][:47].strip())
        for line in lines
        if line.split()[1] == ">" and len(line.split(maxsplit=3)[3]) > 47
    )
    assert sent.count(b"\x23") == bench.written.count(b"\x23")
