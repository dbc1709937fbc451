"""Made-up sessions of made-up trainees."""

import hashlib

from paravol.progress.session_entry import PartPoints, Scored, SessionEntry, Value


def entry(
    trainee: str = "ann",
    number: int = 1,
    *,
    exercise: str = "hoops",
    path_mm: float | None = 200.0,
    percent: float | None = None,
    has_passed: bool | None = None,
) -> SessionEntry:
    """Make a trainee's attempt."""
    sha256 = hashlib.sha256(f"{trainee} {exercise} {number}".encode()).hexdigest()
    scored = None
    if percent is not None:
        parts = (PartPoints("time", "Time", percent / 2, 50.0, "scored"),)
        scored = Scored("first", 2, "ab" * 32, percent, 1.5, 60.0, "passed", parts)
    return SessionEntry(
        trainee,
        sha256,
        f"flight-{number}.paravol",
        exercise,
        "Through the hoops",
        f"2026-03-{number:02d}T10:00:00+00:00",
        60.5 + number,
        True,
        has_passed,
        (
            Value("scope", "path length", "mm", path_mm, 0.25),
            Value("scope", "SPARC", "1", -2.0, None, True),
            Value("tool", "path length", "mm", None),
        ),
        {"course 1": "done", "stop 1": "failed"},
        scored,
    )


ENTRIES = [
    entry(),
    entry(number=2, percent=81.5, has_passed=True),
    entry("", 3, path_mm=None, has_passed=False, exercise="Größer: 45° (links)"),
]
"""Unscored, passed, and of somebody without a name."""
