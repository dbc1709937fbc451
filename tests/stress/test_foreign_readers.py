"""Whatever the damage, a reader of foreign bytes gives a value or one sentence."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.stress.foreign_readers import READERS, STREAMS, array, is_told

ROUNDS = 120


def damages(whole: bytes, seed: int) -> Iterator[bytes]:
    """Cut, change, repeat and replace; what a header says is hit more often."""
    random = np.random.default_rng(seed)
    yield b""
    yield b"\xff" * 40
    yield b"[" * 20_000
    yield b'{"a":' * 20_000
    yield b"a=" + b"[" * 5_000
    for _ in range(ROUNDS):
        made = bytearray(whole)
        at = int(random.integers(len(whole)))
        if random.random() < 0.5:
            at = int(random.integers(min(len(whole), 400)))
        match int(random.integers(5)):
            case 0:
                made = made[:at]
            case 1:
                made[at] ^= 1 << int(random.integers(8))
            case 2:
                made[at : at + 8] = random.bytes(8)
            case 3:
                made[at:at] = made[at : at + int(random.integers(1, 60))]
            case 4:
                # an unended header: the rest is blank
                made[at:] = b" " * (len(made) - at)
        yield bytes(made)


@pytest.mark.slow
@pytest.mark.parametrize("name", READERS)
def test_damage_is_one_sentence(tmp_path: Path, name: str) -> None:
    file = tmp_path / name
    read = READERS[name](file)
    whole = file.read_bytes()
    refused = 0
    for number, content in enumerate(damages(whole, sum(name.encode()))):
        file.write_bytes(content)
        try:
            read(file)
        except Exception as error:
            if not is_told(error):
                raise AssertionError((number, content[:80])) from error
            refused += 1
    print(f"{name}: {refused} refused")
    assert refused >= (1 if name == "stream.mcap" else 5)


@pytest.mark.parametrize("name", STREAMS)
def test_any_bytes_from_a_line_are_heard_out(name: str) -> None:
    whole, hear = STREAMS[name]
    assert hear(whole)
    for content in damages(whole, sum(name.encode())):
        hear(content[:2_000])


def test_an_array_without_its_headers_end(tmp_path: Path) -> None:
    """numpy's parser of headers raised `tokenize.TokenError`."""
    read = array(tmp_path / "a.npy")
    whole = (tmp_path / "a.npy").read_bytes()
    (tmp_path / "a.npy").write_bytes(whole[:40] + b" " * 87 + b"\n" + whole[128:])
    with pytest.raises(ValueError, match="cannot be read as an array"):
        read(tmp_path / "a.npy")
