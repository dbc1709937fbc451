"""Records of a known type in JSON and TOML files that people write."""

import re
from pathlib import Path
from typing import TypeVar

import msgspec

from system.foreign_file import ForeignFileError, foreign_file
from system.line_finder import json_line, toml_line
from system.validation_message import decode_untyped, place_of, validation_message

_T = TypeVar("_T")


def read_kept(file: Path, kind: type[_T]) -> _T | None:
    """Read JSON that the program kept for itself; None where it is gone or damaged."""
    try:
        return msgspec.json.decode(file.read_bytes(), type=kind)
    except (OSError, ValueError, RecursionError):
        return None


def decode_json(content: bytes, kind: type[_T], file: Path | str, what: str) -> _T:
    """Decode JSON as `kind`.

    Raise ForeignFileError with file, line, value and the nearest known word. what: the
    kind of file, with its article.
    """
    with foreign_file(file, what):
        try:
            try:
                return msgspec.json.decode(content, type=kind)
            except msgspec.ValidationError as error:
                found = decode_untyped(content)
                if found is msgspec.UNSET:
                    # no JSON at all, further on
                    msgspec.json.decode(content)
                line = json_line(content.decode(), _place(error))
                words = validation_message(error, kind, found)
                raise _error(file, line, words, what) from error
        except msgspec.DecodeError as error:
            if isinstance(error, msgspec.ValidationError):
                words = validation_message(error, kind)
                raise ForeignFileError(
                    f"{file} is not valid as {what}: {words}."
                ) from error
            byte = re.search(r"\(byte (\d+)\)", str(error))
            at = int(byte[1]) if byte else len(content)
            line = content.count(b"\n", 0, at) + 1
            raise _error(file, line, str(error), what) from error


def decode_toml(content: bytes, kind: type[_T], file: Path | str, what: str) -> _T:
    """Decode TOML as `kind`; see `decode_json`."""
    with foreign_file(file, what):
        try:
            return msgspec.toml.decode(content, type=kind)
        except msgspec.ValidationError as error:
            found = msgspec.toml.decode(content)
            line = toml_line(content.decode(), _place(error))
            raise _error(
                file, line, validation_message(error, kind, found), what
            ) from error
        except msgspec.DecodeError as error:
            raise ForeignFileError(
                f"{file} is not valid as {what}: {error}."
            ) from error


def _place(error: msgspec.ValidationError) -> list[str | int]:
    """Return the place of what is wrong; an unknown name stands in that place."""
    place = place_of(error)
    if unknown := re.match(r"Object contains unknown field `([^`]*)`", str(error)):
        return [*place, unknown[1]]
    return place


def _error(file: Path | str, line: int, words: str, what: str) -> ForeignFileError:
    end = "" if words.endswith("?") else "."
    return ForeignFileError(
        f"{file}, line {line}, is not valid as {what}: {words}{end}"
    )
