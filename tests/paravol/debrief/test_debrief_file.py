"""A debrief is the same each time, whole or not there, and compares what can be."""

import re
import shutil
from pathlib import Path

import msgspec
import pytest

from paravol.debrief import DebriefOrder, write_debrief
from system import UserError
from tests.paravol.debrief.conftest import Recorded


def test_the_same_session_gives_the_same_file(
    recorded: Recorded, tmp_path: Path
) -> None:
    assert recorded.written(tmp_path / "again.html") == recorded.text
    assert list(tmp_path.iterdir()) == [tmp_path / "again.html"]


def test_a_session_is_compared_with_itself(recorded: Recorded, tmp_path: Path) -> None:
    text = recorded.written(tmp_path / "a.html", compare=recorded.folder)
    assert "This session beside flight.paravol" in text
    rows = text[text.index("Table of the comparison") :].split("</tbody>")[0]
    cells = re.findall(r'<td class="number"[^>]*>(.*?)</td>', rows)
    assert len(cells) >= 20
    assert cells[0::2] == cells[1::2]


def test_another_head_is_refused(recorded: Recorded, tmp_path: Path) -> None:
    other = tmp_path / "other.paravol"
    shutil.copytree(recorded.folder, other)
    info = msgspec.json.decode((other / "session.json").read_bytes())
    info["surface_sha256"] = "b" * 64
    (other / "session.json").write_bytes(msgspec.json.encode(info))
    out = tmp_path / "a.html"
    with pytest.raises(UserError, match="another head"):
        recorded.written(out, compare=other)
    assert not out.exists()


def test_pictures_are_bounded(recorded: Recorded, tmp_path: Path) -> None:
    order = DebriefOrder(recorded.folder, tmp_path / "a.html", pictures=-1)
    with pytest.raises(UserError, match="--pictures"):
        write_debrief(order, patient=recorded.patient)


@pytest.mark.slow
def test_events_and_wounds_get_pictures(recorded: Recorded, tmp_path: Path) -> None:
    out = tmp_path / "a.html"
    order = DebriefOrder(recorded.folder, out, pictures=2, size=48)
    written = write_debrief(order, patient=recorded.patient)
    assert written.pictures == 4
    text = out.read_text("utf-8")
    # the mucosa that was seen is drawn, too
    assert text.count("<img ") == 5
    assert 'alt="The same view at the end of the session"' in text
    before, after = (
        text.split(f"{word} view")[0].rsplit('src="', 1)[1].split('"')[0]
        for word in ("The endoscope's", "The same")
    )
    assert before != after
    write_debrief(order, patient=recorded.patient)
    assert out.read_text("utf-8") == text
