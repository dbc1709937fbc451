"""Where a volume's header says that its values are: beside it, and nowhere else.

A header of text may name any path of the machine, and a pipe that never ends.
"""

import os
import re
from pathlib import Path

from disk import UserError

LONGEST_HEADER = 1 << 20

MOST_FILES = 20_000

LONGEST_TOLD = 200
"""Characters of a name that an error repeats."""

LOCAL = ("local", "list")
"""What a header says in place of a name: in this file, or in the lines that follow."""

_NRRD = re.compile(rb"data ?file\s*:=?\s*(.*)", re.IGNORECASE)
_META = re.compile(rb"\s*ElementDataFile\s*[=:]\s*(.*)", re.IGNORECASE)
_DIMENSIONS = re.compile(rb"\s*NDims\s*[=:]\s*\d{1,2}\s*")
_PATTERN = re.compile(r"%\d{0,2}d")


def check_data_files(path: Path) -> None:
    """Refuse a header whose values are not in plain files of its own folder.

    Of NRRD, MetaImage and paired NIfTI files. Raises ValueError naming the header and
    the file that it names.
    """
    ending = path.suffix.lower()
    if ending in (".hdr", ".img"):
        for partner in (".hdr", ".img"):
            _check(path, path.with_suffix(partner).name)
        return
    with path.open("rb") as file:
        head = file.read(LONGEST_HEADER)
    if head.startswith(b"NRRD"):
        found = _NRRD
        text = re.split(rb"\r?\n\r?\n", head, maxsplit=1)[0]
    elif ending in (".mhd", ".mha"):
        found, text = _META, head
    else:
        return
    lines = text.splitlines()
    for n, line in enumerate(lines):
        if found is _META and b"NDims" in line and not _DIMENSIONS.fullmatch(line):
            # ITK's reader never comes back from a negative number, or a huge one
            raise UserError(f"{path} does not say how many dimensions it has")
        match = found.match(line)
        if match is None:
            continue
        words = match[1].decode("utf-8", "replace").strip()
        kind = words.split(" ")[0].lower()
        if kind not in LOCAL:
            _check_named(path, words)
        elif kind == "list":
            listed = lines[n + 1 : n + 1 + MOST_FILES]
            for name in (one.decode("utf-8", "replace").strip() for one in listed):
                if name:
                    _check(path, name)
        if found is _META:
            return  # what follows are values
    if len(head) == LONGEST_HEADER and (found is _META or text == head):
        raise UserError(f"{path} has a header without an end")


def _check_named(path: Path, words: str) -> None:
    """Check one name, or a pattern with the numbers of its first and last file."""
    name, *numbers = words.rsplit(" ", 3) if _PATTERN.search(words) else [words]
    pattern = _PATTERN.search(name)
    if pattern is None:
        # a name may hold spaces
        _check(path, words)
        return
    try:
        first, last, step = [*(int(n) for n in numbers), 1][:3]
    except ValueError as error:
        raise UserError(f"{path} names its values wrongly: {words!r}") from error
    listed = range(first, last + 1, max(abs(step), 1))
    for number in listed[:MOST_FILES]:
        _check(
            path, name[: pattern.start()] + pattern[0] % number + name[pattern.end() :]
        )


def _check(path: Path, name: str) -> None:
    told = f"{path} takes its values from {name[:LONGEST_TOLD]}"
    folder = path.parent.resolve()
    target = Path(name)
    if target.is_absolute() or not (folder / target).resolve().is_relative_to(folder):
        raise UserError(
            f"{told}, outside its own folder; put both into one folder, and name the "
            "file alone"
        )
    # a name that no file system holds is not there either; Path.exists would raise
    if not os.path.exists(folder / target):
        raise UserError(f"{told}, which is not there")
    if not (folder / target).is_file():
        raise UserError(f"{told}, which is no plain file")
