"""What a person is told, and what keeps its traceback."""

import numpy as np
import pytest

from app import __main__
from app import errors as faults
from system import UserError


def raising(error: Exception) -> object:
    def run(words: list[str]) -> int:
        raise error

    return run


def numpys() -> ValueError:
    try:
        np.zeros(2) + np.zeros(3)
    except ValueError as error:
        return error
    raise AssertionError


def test_only_a_users_error_is_a_sentence() -> None:
    assert faults.sentence(UserError("--size must be 16 or more")) is not None
    assert faults.sentence(numpys()) is None
    assert faults.sentence(KeyError("x")) is None


def test_a_defect_keeps_its_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(__main__, "_run", raising(numpys()))
    with pytest.raises(ValueError, match="broadcast"):
        __main__.main(["doctor"])


def test_debug_shows_the_traceback_of_a_users_error(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(__main__, "_run", raising(UserError("no folder x; make it")))
    assert __main__.main(["doctor"]) == 1
    assert capsys.readouterr().err == "paravol: no folder x; make it\n"
    with pytest.raises(UserError):
        __main__.main(["doctor", "--debug"])


def test_what_a_damaged_file_says_is_told_in_one_line() -> None:
    """A fuzzer put breaks of lines, and kilobytes, where a number belongs."""
    told = faults.sentence(
        UserError("a.dcm has an unusable PixelSpacing: 1\n2\x0b3\u20284")
    )
    assert told == "a.dcm has an unusable PixelSpacing: 1 2 3 4"
    assert len(faults.sentence(UserError("x" * 10**6)) or "") < 3000
