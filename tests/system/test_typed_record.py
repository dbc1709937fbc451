"""What people write wrong is named: file, line, value, allowed, the nearest word."""

import json
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from system import ForeignFileError
from system.line_finder import json_line, toml_line
from system.typed_record import decode_json, decode_toml, read_kept


class Round(msgspec.Struct, forbid_unknown_fields=True, tag="round", tag_field="kind"):
    radius_mm: float = 1.0


class Square(
    msgspec.Struct, forbid_unknown_fields=True, tag="square", tag_field="kind"
):
    side_mm: float = 1.0


class Sketch(msgspec.Struct, forbid_unknown_fields=True):
    title: str
    paths: Annotated[int, msgspec.Meta(ge=32, le=64)] = 32
    look: Literal["scope", "classic"] = "scope"
    place: tuple[float, float, float] = (0, 0, 0)
    shapes: tuple[Round | Square, ...] = ()
    gain: float | None = None


@pytest.mark.parametrize(
    ("text", "line", "told"),
    [
        ('{"title":\n"a",\n"paths": 3}', 3, "paths must be a whole number, at least"),
        ('{"title":\n"a",\n"paths": 3}', 3, "got 3"),
        ('{"title": "a",\n"path": 3}', 2, "'path' is not known; did you mean 'paths'?"),
        ('{"paths": 40}', 1, "'title' is missing"),
        ('{"title":\n7}', 2, "title must be text, got 7"),
        ('{"title":"","look":\n"scop"}', 2, "look cannot be 'scop'; did you mean"),
        ('{"title":"","gain":\n"x"}', 2, 'gain must be a number or nothing, got "x"'),
        ('{"title":"","place":\n[1, 2]}', 2, "place must be a list of 3 entries"),
        ('{"title":"","place":[1,2,\ntrue]}', 2, "place[2] must be a number, got true"),
        (
            '{"title":"","shapes":[{"kind":"round"},\n{"kind":"sqare"}]}',
            2,
            "shapes[1].kind cannot be 'sqare'; did you mean 'square'?",
        ),
        (
            '{"title":"","shapes":[{"kind":"round"},\n{"kind":"round",\n"radius": 3}]}',
            3,
            "'radius' is not known in shapes[1]; did you mean 'radius_mm'?",
        ),
        ('{"title":"",\n\n"x":}', 3, "JSON is malformed"),
    ],
)
def test_json(text: str, line: int, told: str) -> None:
    with pytest.raises(ForeignFileError) as caught:
        decode_json(text.encode(), Sketch, "a.json", "a sketch")
    said = str(caught.value)
    assert said.startswith(f"a.json, line {line}, is not valid as a sketch: ")
    assert told in said
    assert "`" not in said
    assert "$" not in said


@pytest.mark.parametrize(
    ("text", "line", "told"),
    [
        ('title = "a"\npaths = 3', 2, "paths must be a whole number, at least 32"),
        ('title = "a"\n# more\npath = 3', 3, "did you mean 'paths'?"),
        (
            'title = "a"\n[[shapes]]\nkind = "round"\n[[shapes]]\nkind = "round"\n'
            'radius_mm = "wide"',
            6,
            'shapes[1].radius_mm must be a number, got "wide"',
        ),
        ('title = "a"\nplace = [\n1,\n"b", 2]', 2, "place[1] must be a number, got"),
    ],
)
def test_toml(text: str, line: int, told: str) -> None:
    with pytest.raises(ForeignFileError) as caught:
        decode_toml(text.encode(), Sketch, "a.toml", "a sketch")
    said = str(caught.value)
    assert said.startswith(f"a.toml, line {line}, is not valid as a sketch: ")
    assert told in said


@pytest.mark.parametrize("content", [b"", b'{"title":', b"\xff", b'{"\xff":1}', b"["])
def test_what_is_no_json_names_the_file(content: bytes) -> None:
    with pytest.raises(ForeignFileError, match=r"^a\.json"):
        decode_json(content, Sketch, "a.json", "a sketch")


def test_what_is_no_toml_names_the_file_and_line() -> None:
    with pytest.raises(ForeignFileError, match=r"^a\.toml is not .*line 2"):
        decode_toml(b'title = "a"\npaths ==', Sketch, "a.toml", "a sketch")


VALUES = st.recursive(
    st.integers() | st.text() | st.none(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
)


@given(value=VALUES, data=st.data())
def test_every_value_is_found_on_its_line(value: object, data: st.DataObject) -> None:
    """Where each value stands on a line of its own, the line says which it is."""
    place: list[str | int] = []
    inner = value
    while isinstance(inner, list | dict) and inner and data.draw(st.booleans()):
        steps = list(range(len(inner))) if isinstance(inner, list) else list(inner)
        step = data.draw(st.sampled_from(steps))
        place.append(step)
        inner = inner[step]
    text = msgspec.json.format(msgspec.json.encode(value), indent=1).decode()
    shown = msgspec.json.encode(inner).decode()
    line = text.split("\n")[json_line(text, place) - 1]
    if not isinstance(inner, list | dict):
        assert line.strip().removesuffix(",").endswith(shown)


def test_tables_and_keys_are_told_apart() -> None:
    text = 'a = 1\n[b]\na = 2\n["c".d] # which\na = 3\n"x y" = 4\n'
    assert toml_line(text, ["a"]) == 1
    assert toml_line(text, ["b", "a"]) == 3
    assert toml_line(text, ["c", "d", "a"]) == 5
    assert toml_line(text, ["c", "d", "x y"]) == 6
    assert toml_line(text, ["b", "nothing"]) == 2


@pytest.mark.parametrize("end", ["\n", "\r\n", "\u2028"])
@pytest.mark.parametrize(
    "record",
    [{"title": "", "paths": "3{}4"}, {"title": "", "3{}4": 4}, {"look": "3{}4"}],
)
def test_ends_of_lines_in_what_is_quoted_are_escaped(
    record: dict[str, object], end: str
) -> None:
    text = json.dumps(record).replace("{}", json.dumps(end)[1:-1])
    with pytest.raises(ForeignFileError) as caught:
        decode_json(text.encode(), Sketch, "a.json", "a sketch")
    told = str(caught.value)
    assert told.splitlines() == [told]
    assert "3\\" in told


@pytest.mark.parametrize(
    "held",
    [
        b"",
        b"{",
        b"[]",
        b'{"title": 1}',
        b'{"title": "\xff"}',
        b'{"title": "a", "x": 1}',
    ],
)
def test_what_is_damaged_counts_as_not_kept(tmp_path: Path, held: bytes) -> None:
    """Bytes that are no text raise another error than JSON that is none."""
    assert read_kept(tmp_path / "kept.json", Sketch) is None
    (tmp_path / "kept.json").write_bytes(held)
    assert read_kept(tmp_path / "kept.json", Sketch) is None
    (tmp_path / "kept.json").write_bytes(b'{"title": "a"}')
    assert read_kept(tmp_path / "kept.json", Sketch) == Sketch("a")


def test_what_is_nested_without_end_counts_as_not_kept(tmp_path: Path) -> None:
    deep = b'{"title": "a", "x": ' + b"[" * 100_000 + b"}"
    (tmp_path / "kept.json").write_bytes(deep)

    class Loose(msgspec.Struct):
        title: str

    assert read_kept(tmp_path / "kept.json", Loose) is None
