"""The description of a recorded session, and how a bundle's JSON is written."""

import hashlib
import json
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal

import msgspec

from scenarios.scenario import Scenario
from system import whole_file
from system.typed_record import decode_json


class SessionInfo(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Describe a session well enough to run it again.

    scenario: the scenario file's text, so that a replay does not depend on it.
    world_from_device: the registration, 16 numbers in row order.
    surface_sha256: hash of the air distance values that were flown through.
    look: version of the picture's look; recordings from before it was counted have 1.
    structures_sha256: hash of what names the structures that were touched; "" in
        recordings from before they were named.
    automatic: recorded without a request; removed when space runs short.
    visible_sets: surfels were culled by visible sets, as they always were before this
        was written down. They leave out what shows through pinholes between discs.
    operated: the samples' tools take tissue away, as none did before.
    hazards_sha256: hash of the distances to hazards; "" where they were not known.
    """

    scenario_name: str
    scenario: str
    picture_size: tuple[int, int]
    tier: str
    seed: int
    world_from_device: list[float]
    registration_rms_mm: float
    surface_sha256: str
    has_instrument: bool
    created: str
    versions: dict[str, str]
    look: int = 1
    structures_sha256: str = ""
    automatic: bool = False
    visible_sets: bool = True
    operated: bool = False
    hazards_sha256: str = ""
    schema_version: Literal[1] = 1

    def exercise(self) -> Scenario:
        """Return what was flown; UserError where the text is none."""
        file, what = "the exercise in session.json", "an exercise"
        return decode_json(self.scenario.encode(), Scenario, file, what)

    def seal(self) -> str:
        """Return a hash of what a score depends on: exercise and registration.

        Where the case lies is left out: a folder may be moved.
        """
        told: Any = self.scenario
        with suppress(msgspec.DecodeError):
            told = msgspec.json.decode(told)
        if isinstance(told, dict) and isinstance(told.get("head"), dict):
            told["head"].pop("case", None)
        content = msgspec.json.encode([told, self.world_from_device], order="sorted")
        return hashlib.sha256(content).hexdigest()


def write_json(path: Path, value: object) -> None:
    """Write JSON for people, atomically."""
    text = json.dumps(msgspec.to_builtins(value), indent=2, allow_nan=False) + "\n"
    with whole_file(path) as beside:
        beside.write_text(text, "utf-8")
