"""A validation error of msgspec as a sentence for whoever wrote the file.

msgspec speaks of its schema: "Expected `int` >= 32 - at `$.paths`". A person needs the
name, the value, what is allowed and the nearest known word.
"""

import difflib
import re
from collections.abc import Iterable, Iterator
from typing import Any

import msgspec
from msgspec import inspect

Place = list[str | int]

_AT = re.compile(
    r"^(?P<what>.*?)(?: - at (?:`key` in )?`\$(?P<place>.*)`)?$", re.DOTALL
)
_STEP = re.compile(r"\.([^.\[\]]+)|\[(\d+|\.\.\.)\]")
_TYPES = {
    "int": "a whole number",
    "float": "a number",
    "str": "text",
    "bool": "true or false",
    "array": "a list",
    "object": "a table of names and values",
    "null": "nothing",
}
_BOUNDS = {">=": "at least", ">": "more than", "<=": "at most", "<": "less than"}
_LONGEST_VALUE = 60


def place_of(error: Exception) -> Place:
    """Return the keys and indices of the value that failed, as far as known."""
    found = _AT.match(str(error))
    place: Place = []
    for name, index in _STEP.findall((found and found["place"]) or ""):
        if index == "...":
            break
        place.append(name or int(index))
    return place


def decode_untyped(content: bytes) -> Any:
    """Decode JSON without a type, for `validation_message`; UNSET if it is none."""
    try:
        return msgspec.json.decode(content)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return msgspec.UNSET


def validation_message(error: Exception, kind: Any, value: Any = msgspec.UNSET) -> str:
    """Say what is wrong, on one line; no full stop at the end.

    error: of msgspec, or of a record's own check. kind: the type that was wanted.
    value: all that was read, without types.
    """
    # names and values that are quoted may hold ends of lines
    return "\\n".join(_message(error, kind, value).splitlines())


def _message(error: Exception, kind: Any, value: Any) -> str:
    found = _AT.match(str(error))
    what = found["what"] if found else str(error)
    place = place_of(error)
    name = _name(place)
    quoted = re.search(r"`([^`]*)`|'(.*)'", what, re.DOTALL)
    word = quoted and (quoted[1] or quoted[2])
    kinds = list(_kinds(kind, place))
    if what.startswith("Object contains unknown field"):
        last = place[-1] if place else None
        where = f" in {_name(place)}" if isinstance(last, str | int) else ""
        return f"{word!r} is not known{where}{_nearest(str(word), _names(kinds))}"
    if what.startswith("Object missing required field"):
        return f"{name} has no {word!r}" if place else f"{word!r} is missing"
    if what.startswith(("Invalid enum value", "Invalid value")):
        allowed = list(_allowed(kind, place))
        wrong = what.partition("value ")[2].strip("'")
        if len(allowed) == 1:
            return f"{name} must be {allowed[0]!r}, got {wrong!r}"
        return f"{name} cannot be {wrong!r}{_nearest(wrong, allowed)}"
    got = _got(value, place)
    if what == "Number out of range":
        return f"{name} is too large a number{got}"
    if what.startswith("Expected"):
        return f"{name} must be {_expected(what)}{got}"
    return f"{name}: {what}" if place else what


def _name(place: Place) -> str:
    text = ""
    for step in place:
        if isinstance(step, int):
            text += f"[{step}]"
        else:
            text += f".{step}" if text else step
    return text or "it"


def _expected(what: str) -> str:
    rest = what.partition("Expected ")[2].partition(", got")[0]
    types = re.match(r"`([^`]*)`", rest)
    if not types:
        return rest
    words = [_TYPES.get(one, one) for one in types[1].split(" | ")]
    said = " or ".join(dict.fromkeys(words))
    tail = rest[types.end() :].strip().replace("matching regex", "of the form")
    if bound := re.match(r"(of length )?(>=|>|<=|<)? ?(\S+)$", tail):
        how = _BOUNDS.get(bound[2] or "", "")
        number = bound[3].removesuffix(".0")
        if bound[1]:
            return f"{said} of {how} {number} entries".replace("  ", " ")
        return f"{said}, {how} {number}"
    return f"{said} {tail}".strip()


def _got(value: Any, place: Place) -> str:
    for step in place:
        try:
            value = value[step]
        except (TypeError, KeyError, IndexError):
            return ""
    if value is msgspec.UNSET:
        return ""
    text = repr(value) if not isinstance(value, str) else f'"{value}"'
    if isinstance(value, bool) or value is None:
        text = str(value).lower().replace("none", "nothing")
    if len(text) > _LONGEST_VALUE:
        text = text[:_LONGEST_VALUE] + "..."
    return f", got {text}"


def _nearest(word: str, known: Iterable[str]) -> str:
    words = sorted(set(known))
    near = difflib.get_close_matches(word, words, 1)
    folded = [known for known in words if known.lower() == word.lower()]
    if folded or near:
        return f"; did you mean {(folded or near)[0]!r}?"
    return f"; known are {', '.join(words)}" if words else ""


def _kinds(kind: Any, place: Place) -> Iterator[inspect.Type]:
    """Return the types that may stand at a place."""
    try:
        waiting = [inspect.type_info(kind)]
    except TypeError:
        return
    for step in place:
        waiting = [inner for one in waiting for inner in _inside(one, step)]
    for one in waiting:
        yield from one.types if isinstance(one, inspect.UnionType) else [one]


def _inside(kind: inspect.Type, step: str | int) -> Iterator[inspect.Type]:
    match kind:
        case inspect.UnionType(types=types):
            for one in types:
                yield from _inside(one, step)
        case inspect.StructType(fields=fields):
            yield from (field.type for field in fields if field.encode_name == step)
        case inspect.ListType(item_type=item) | inspect.VarTupleType(item_type=item):
            yield item
        case inspect.TupleType(item_types=items) if isinstance(step, int):
            yield from items[step : step + 1]
        case inspect.DictType(value_type=value):
            yield value


def _names(kinds: Iterable[inspect.Type]) -> Iterator[str]:
    for kind in kinds:
        if isinstance(kind, inspect.StructType):
            yield from (field.encode_name for field in kind.fields)


def _allowed(kind: Any, place: Place) -> Iterator[str]:
    for one in _kinds(kind, place):
        if isinstance(one, inspect.LiteralType):
            yield from (str(value) for value in one.values)
        if isinstance(one, inspect.EnumType):
            yield from (str(member.value) for member in one.cls)
    # the word that tells one kind of table from another is no field of it
    for one in _kinds(kind, place[:-1]):
        if isinstance(one, inspect.StructType) and one.tag_field == place[-1]:
            yield str(one.tag)
