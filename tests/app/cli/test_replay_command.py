"""What `paravol replay` says of a recording that is not whole."""

from pathlib import Path

import pytest

from app.cli.replay_command import run_replay
from app.cli.replay_options import ReplayOptions
from paravol.sessions import session_replay
from paravol.sessions.session_replay import ReplayReport
from scenarios import Score
from scenarios.bundle import Damage
from system import UserError


def report(*damages: Damage, complete: bool = True) -> ReplayReport:
    return ReplayReport(
        complete=complete,
        samples=3750,
        frames=1000,
        differing_frames=[],
        differing_clearances=[],
        score=Score(
            duration_s=38.0,
            path_length_mm=100.0,
            contacts=0,
            min_clearance_mm=1.0,
            target_distance_mm={},
        ),
        same_score=None if damages else True,
        same_look=True,
        damages=damages,
        seconds=38.0,
    )


@pytest.mark.parametrize(
    ("found", "lines"),
    [
        (report(), ["complete"]),
        (report(complete=False), ["ends in the middle, after 38.0 s"]),
        (
            report(Damage(41_000, 45_000, 3.5, 4.0, 50)),
            [
                "damaged, bytes 41,000 to 45,000: 3.50 to 4.00 s lost, 50 samples",
                "37.5 of 38.0 s are good",
                "not compared: a part is lost",
            ],
        ),
        (
            report(Damage(41_000, 45_000, 3.5, 3.5, None)),
            ["damaged, bytes 41,000 to 45,000: no flight is lost"],
        ),
    ],
)
def test_damage_is_told_with_place_and_seconds(
    found: ReplayReport,
    lines: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(session_replay, "replay_session", lambda *words, **named: found)
    monkeypatch.setenv("COLUMNS", "160")
    status = run_replay(Path("a"), check=True, video=None, threads=1, as_json=False)
    said = capsys.readouterr().out
    for line in lines:
        assert line in said
    assert ("ends in the middle" in said) == (not found.complete)
    assert status == (1 if found.damages else 0)


def test_the_figures_of_damage_are_in_the_json(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    found = report(Damage(1, 2, 3.5, 4.0, 50))
    monkeypatch.setattr(session_replay, "replay_session", lambda *words, **named: found)
    run_replay(Path("a"), check=False, video=None, threads=1, as_json=True)
    said = capsys.readouterr().out
    assert '"first_byte": 1' in said
    assert '"good_s": 37.5' in said


@pytest.mark.parametrize(
    ("typed", "refused"),
    [
        (ReplayOptions(window=True, check=True), "--check"),
        (ReplayOptions(window=True, video=Path("a.mp4")), "--video"),
        (ReplayOptions(window=True, at=1.0), "--at"),
    ],
)
def test_the_window_is_refused_with_what_needs_none(
    typed: ReplayOptions, refused: str
) -> None:
    with pytest.raises(UserError, match=f"--window goes without {refused}"):
        typed.require_sense()


def test_the_window_takes_a_second_session_and_a_case() -> None:
    ReplayOptions(window=True, beside=Path("b"), case=Path("c")).require_sense()
