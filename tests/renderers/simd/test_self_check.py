"""Vectors are tried out before anything is drawn with them."""

from collections.abc import Iterator
from typing import Any

import pytest

from renderers.simd import self_check as check
from renderers.simd.self_check import VectorError, require_vectors, vector_problem


@pytest.fixture(autouse=True)
def _forgotten() -> Iterator[None]:
    vector_problem.cache_clear()
    yield
    vector_problem.cache_clear()


def test_vectors_run_here() -> None:
    assert vector_problem() == ""


def test_a_compiler_that_turns_them_down_is_asked_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = []

    def fail() -> bool:
        asked.append(1)
        raise AttributeError("no such builder\nand much more")

    monkeypatch.setattr(check, "agrees_with_numpy", fail)
    assert "AttributeError: no such builder)" in vector_problem()
    assert vector_problem()
    assert len(asked) == 1


def test_wrong_results_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(check, "agrees_with_numpy", lambda: False)
    assert "wrong" in vector_problem()


def test_the_check_finds_a_wrong_instruction(monkeypatch: pytest.MonkeyPatch) -> None:
    """One bit of one lane is enough."""
    right = check._vectors

    def wrong(*args: Any) -> int:
        word: int = right(*args)
        return word ^ 1

    monkeypatch.setattr(check, "_vectors", wrong)
    assert not check.agrees_with_numpy()


def test_what_cannot_do_without_vectors_says_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    require_vectors("Light")
    vector_problem.cache_clear()
    monkeypatch.setattr(check, "agrees_with_numpy", lambda: False)
    with pytest.raises(VectorError, match=r"Light needs .*requirements\.lock"):
        require_vectors("Light")
