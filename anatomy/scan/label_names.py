"""What segmentation programs call the structures of a head, and which are hazards."""

import re

import msgspec

from anatomy.table_file import read_table


class _Table(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Hold ``label_names.toml``."""

    no_hazards: tuple[str, ...]
    hazards: dict[str, tuple[str, ...]]
    tasks: dict[str, tuple[str, ...]]
    whole_body: dict[int, str]


_TABLE = read_table(__file__, "label_names.toml", _Table)

HAZARDS = _TABLE.hazards
"""Names of labels by the hazard that they are; sides are taken off beforehand."""

TASKS: dict[str, tuple[str, ...]] = {
    "total": tuple(
        _TABLE.whole_body.get(value, "other structure") for value in range(1, 118)
    ),
    **_TABLE.tasks,
}
"""Names by label value, from 1, of tasks whose label maps may come without names."""

_KNOWN = {name: hazard for hazard, names in HAZARDS.items() for name in names}
_KNOWN |= dict.fromkeys(_TABLE.no_hazards, "")
_KNOWN |= {
    " ".join(part.removesuffix("s") for part in name.split()): hazard
    for name, hazard in _KNOWN.items()
}

_IDLE = frozenset(("muscle", "muscles", "the", "of"))

_LAST = frozenset(("incisor", "canine", "premolar", "molar", "tooth"))
"""Words that say what a structure is, whatever goes before them."""

_SIDES = frozenset(("left", "right", "l", "r", "lt", "rt", "both", "bilateral"))


def hazard_of(name: str) -> str | None:
    """Return the hazard that a label of this name is.

    "" for a known structure that is none; None for an unknown name.
    """
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    parts = [p for p in re.split(r"[^a-z0-9]+", words.lower()) if p]
    own = [p for p in parts if p not in _SIDES]
    # pieces are counted, and several are one
    uncounted = [p for p in own if not p.isdecimal() and p not in _IDLE]
    single = [p.removesuffix("s") for p in uncounted]
    for found in (own, uncounted, single):
        hazard = _KNOWN.get(" ".join(found))
        if hazard is not None:
            return hazard
    # a name that says where in a structure it is
    return _KNOWN.get(uncounted[-1]) if uncounted and uncounted[-1] in _LAST else None
