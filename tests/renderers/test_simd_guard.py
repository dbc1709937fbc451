"""Vectors are tried out before anything is drawn with them."""

import logging
from collections.abc import Iterator
from typing import Any

import pytest

from renderers.lanes import self_check as check
from renderers.simd_guard import VectorError, demand_vectors, vector_problem


@pytest.fixture(autouse=True)
def _forgotten() -> Iterator[None]:
    vector_problem.cache_clear()
    yield
    vector_problem.cache_clear()


def test_vectors_run_here(caplog: pytest.LogCaptureFixture) -> None:
    assert vector_problem() == ""
    assert not caplog.records


def test_a_compiler_that_turns_them_down_is_told_of_once(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail() -> bool:
        raise AttributeError("no such builder\nand much more")

    monkeypatch.setattr(check, "agrees_with_scalars", fail)
    assert "AttributeError: no such builder)" in vector_problem()
    assert vector_problem()
    [record] = caplog.records
    assert record.levelno == logging.WARNING
    assert "no such builder" in record.message


def test_wrong_results_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(check, "agrees_with_scalars", lambda: False)
    assert "wrong" in vector_problem()


def test_the_check_finds_a_wrong_instruction(monkeypatch: pytest.MonkeyPatch) -> None:
    """One bit of one lane is enough."""
    right = check._vectors

    def wrong(*args: Any) -> int:
        word: int = right(*args)
        return word ^ 1

    monkeypatch.setattr(check, "_vectors", wrong)
    assert not check.agrees_with_scalars()


def test_what_cannot_do_without_vectors_says_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    demand_vectors("Light")
    vector_problem.cache_clear()
    monkeypatch.setattr(check, "agrees_with_scalars", lambda: False)
    with pytest.raises(VectorError, match=r"Light needs .*requirements\.lock"):
        demand_vectors("Light")
