"""Tasks in scenario files: all kinds come back, and what is wrong is named."""

import msgspec
import pytest

from scenarios.tasks import task as tasks
from system import UserError
from system.typed_record import decode_toml

EVERY_KIND: tuple[tasks.Task, ...] = (
    tasks.Reach(name="a", title="A", place="choana", radius_mm=2.0),
    tasks.LookTask(name="b", title="B", place=(1.0, 2.0, 3.0), after=("a",)),
    tasks.Hold(name="c", title="C", place="x", radius_mm=3, still_mm=1, hold_s=2),
    tasks.Follow(name="d", title="D", rings=(tasks.Ring("x", (0, 1, 0), 4.0),)),
    tasks.Inject(name="e", title="E", place="x", tool="needle", hint="Go slowly."),
    tasks.Remove(name="f", title="F", walls={"uncinate": tasks.Limits(5.0, 90.0)}),
    tasks.Open(name="g", title="G", start="x", end="y", radius_mm=2.0),
    tasks.KeepAway(name="h", title="H", hazards=("orbit",), margin_mm=1, most_dose_s=2),
    tasks.Survey(name="i", title="I", sites={"choana": 80.0}, is_optional=True),
)


class Sheet(msgspec.Struct, forbid_unknown_fields=True):
    """A file of tasks alone."""

    tasks: tuple[tasks.Task, ...]


def test_every_kind_comes_back_from_a_recording() -> None:
    content = msgspec.json.encode(Sheet(EVERY_KIND))
    assert msgspec.json.decode(content, type=Sheet).tasks == EVERY_KIND


def test_a_file_for_people_says_the_same() -> None:
    content = b"""
[[tasks]]
kind = "look"
name = "b"
title = "B"
place = [1.0, 2.0, 3.0]
after = ["a"]

[[tasks]]
kind = "remove"
name = "f"
title = "F"
walls = {uncinate = {least_mm3 = 5, most_mm3 = 90.0}}
"""
    found = decode_toml(content, Sheet, "t.toml", "tasks").tasks
    assert found == (EVERY_KIND[1], EVERY_KIND[5])


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('kind = "reech"', "reech"),
        ('kind = "reach"\nradius = 2', "radius"),
        ('kind = "reach"\nplace = 4', "place"),
    ],
)
def test_a_misspelt_task_is_refused_with_its_line(line: str, words: str) -> None:
    content = f'[[tasks]]\nname = "a"\ntitle = "A"\n{line}\n'.encode()
    with pytest.raises(UserError, match=words) as told:
        decode_toml(content, Sheet, "t.toml", "tasks")
    assert "t.toml" in str(told.value)
