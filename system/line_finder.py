"""The line of a JSON or TOML text on which a value stands."""

import json
import re

_SPACE = re.compile(r"[\s,:]*")
_TABLE = re.compile(r"\s*(\[{1,2})\s*([^\]]+?)\s*\]{1,2}\s*(?:#.*)?$")
_KEY = re.compile(r"""\s*(?:"([^"]*)"|'([^']*)'|([\w-]+))\s*=""")


def json_line(text: str, place: list[str | int]) -> int:
    """Return the line, from 1, of the value at `place`, or of what it would stand in.

    text: valid JSON.
    """
    at = _skip(text, 0)
    for step in place:
        inner = _member(text, at, step)
        if inner is None:
            break
        at = inner
    return text.count("\n", 0, at) + 1


def toml_line(text: str, place: list[str | int]) -> int:
    """Return the line, from 1, of the key at `place`, or of the table it belongs to.

    Keys inside of inline tables and lists count as the line of these.
    """
    table: list[str | int] = []
    counts: dict[str, int] = {}
    best, depth = 1, 0
    for number, line in enumerate(text.splitlines(), 1):
        here: list[str | int] | None = None
        if header := _TABLE.match(line):
            table = [part.strip("\"' ") for part in header[2].split(".")]
            if header[1] == "[[":
                counts[header[2]] = counts.get(header[2], -1) + 1
                table.append(counts[header[2]])
            here = table
        elif key := _KEY.match(line):
            here = [*table, key[1] or key[2] or key[3]]
        if here and len(here) > depth and place[: len(here)] == here:
            best, depth = number, len(here)
    return best


def _member(text: str, at: int, step: str | int) -> int | None:
    """Find where a member's value begins; a member of a table by its name."""
    decoder = json.JSONDecoder(strict=False)
    opening, at = text[at], _skip(text, at + 1)
    if opening not in ("{" if isinstance(step, str) else "["):
        return None
    count = 0
    while text[at] not in "]}":
        name: str | int = count
        if opening == "{":
            name, at = decoder.raw_decode(text, at)
            at = _skip(text, at)
        if name == step:
            return at
        at = _skip(text, decoder.raw_decode(text, at)[1])
        count += 1
    return None


def _skip(text: str, at: int) -> int:
    found = _SPACE.match(text, at)
    return at if found is None else found.end()
