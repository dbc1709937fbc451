"""Whatever a library raises over foreign bytes is one sentence naming the file."""

import io
import tokenize
import zipfile
from pathlib import Path

import numpy as np
import pytest

from system import ForeignFileError, UserError, foreign_file


@pytest.mark.parametrize(
    "error",
    [
        RuntimeError("itk::ERROR: NrrdImageIO(0x1):\nError reading header"),
        tokenize.TokenError("EOF in multi-line statement", (1, 0)),
        zipfile.BadZipFile("File is not a zip file"),
        NotImplementedError("Unknown Value Representation 'UX'"),
        RecursionError("maximum recursion depth exceeded"),
        MemoryError("Unable to allocate 8 EiB"),
        OSError("Not a gzipped file"),
        KeyError("state"),
        UnboundLocalError("cannot access local variable 'prop_pop'"),
        AssertionError(),
        UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid start byte"),
    ],
)
def test_every_exception_becomes_one_sentence(error: Exception) -> None:
    with pytest.raises(ForeignFileError) as caught, foreign_file("a.bin", "a scan"):
        raise error
    said = str(caught.value)
    assert said.startswith("a.bin cannot be read as a scan: ")
    assert "\n" not in said
    assert said.endswith(".")
    assert caught.value.__cause__ is error


def test_the_library_that_was_met() -> None:
    buffer = io.BytesIO()
    np.save(buffer, np.zeros(3))
    whole = buffer.getvalue()
    # the header's closing brace is gone, its length is as said
    cut = whole[:40] + b" " * (len(whole) - 40)
    with (
        pytest.raises(ForeignFileError, match=r"^a\.npy cannot be read"),
        foreign_file("a.npy", "an array"),
    ):
        np.load(io.BytesIO(cut), allow_pickle=False)


def test_own_words_and_the_system_pass(tmp_path: Path) -> None:
    with (
        pytest.raises(ForeignFileError, match=r"^a\.bin .* scan: it has no pixels\.$"),
        foreign_file("b.bin", "a head"),
        foreign_file("a.bin", "a scan"),
    ):
        raise UserError("it has no pixels.")
    with pytest.raises(FileNotFoundError), foreign_file("a.bin", "a scan"):
        (tmp_path / "none").read_bytes()
    with pytest.raises(KeyboardInterrupt), foreign_file("a.bin", "a scan"):
        raise KeyboardInterrupt


@pytest.mark.parametrize("error", [NameError("name 'x'"), ImportError("no module x")])
def test_what_is_missing_in_the_program_is_no_files_fault(error: Exception) -> None:
    with pytest.raises(type(error)), foreign_file("a.bin", "a scan"):
        raise error
