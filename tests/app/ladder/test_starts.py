"""Every exercise is begun by clicks in the real window, from its home page.

Those that the person does in the fast run are begun there, by the same clicks.

On a machine without a screen, or without OpenGL, all this is skipped.
"""

from pathlib import Path

import pytest

pytest.importorskip(
    "PySide6.QtWidgets", reason="the extra 'desktop'", exc_type=ImportError
)

from tests.app.ladder.sitting_process import EVERY, IMPORTED, MADE, QUICK, Verdict, sat

pytestmark = pytest.mark.display

BEGUN = [*(name for name in EVERY if name not in QUICK), MADE, IMPORTED]


@pytest.fixture(scope="module")
def starts(
    tmp_path_factory: pytest.TempPathFactory, cases: list[Path]
) -> dict[str, Verdict]:
    """Begin all there is, one after the other, in one window; heads are coarse."""
    words = [*BEGUN, "--only-start", "--coarse"]
    for case in cases:
        words += ["--case", str(case)]
    return sat(tmp_path_factory.mktemp("starts"), *words, limit_s=1500.0)


@pytest.mark.timeout(1600)
@pytest.mark.parametrize("exercise", BEGUN)
def test_it_begins_by_clicks_from_the_home_page(
    starts: dict[str, Verdict], exercise: str
) -> None:
    verdict = starts[exercise.removeprefix("case:")]
    assert verdict["began"], verdict
    assert verdict["why"] == ""
