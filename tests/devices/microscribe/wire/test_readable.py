import pytest

from devices.microscribe.wire.readable import readable


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"", "nothing"),
        (b"IBOX", "'IBOX'"),
        (b"it's", "'it's'"),
        (b"IB\xe9X", "the bytes 49 42 E9 58"),
        (b"MSCR\0", "the bytes 4D 53 43 52 00"),
        (b"x" * 42, f"'{'x' * 40}' and 2 bytes more"),
    ],
)
def test_bytes_are_told_as_text_where_they_are_text(data: bytes, told: str) -> None:
    assert readable(data) == told
