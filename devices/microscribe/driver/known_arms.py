"""Constants of the arms that were seen on this machine, kept by serial number.

An arm's constants change only when its maker calibrates it anew. Any other change is
damage that nothing else on the wire would show.
"""

import datetime
from dataclasses import dataclass
from pathlib import Path
from typing import Literal
from urllib.parse import quote

import msgspec
import platformdirs

from devices.microscribe.kinematics.arm import ArmGeometry
from devices.microscribe.kinematics.constants_check import constants_by_name, unit_of
from devices.microscribe.wire.link import ArmDescription
from system import whole_file

LARGEST_FILE_BYTES = 100_000

# Half of the step in which an arm states an angle; lengths have larger steps.
SAME = 0.002


class KnownArm(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One arm as it was last believed.

    words: 19 constants as the arm stores them, BETA last. encoders: largest count of
    each joint.
    """

    serial: str
    model: str
    words: tuple[int, ...]
    encoders: tuple[int, ...]
    seen: str
    """Day of the first time, ISO 8601."""
    format: Literal["paravol arm"] = "paravol arm"
    version: Literal[1] = 1


def arms_folder() -> Path:
    """Return where arms are remembered unless told otherwise."""
    return Path(platformdirs.user_data_dir("paravol")) / "arms"


@dataclass(frozen=True, slots=True)
class KnownArms:
    """The remembered arms; one JSON file each in ``folder``."""

    folder: Path

    def file(self, serial: str) -> Path:
        """Return where the arm of this serial number is kept."""
        # a serial number is any text
        return self.folder / f"arm-{quote(serial, safe='')}.json"

    def find(self, serial: str) -> KnownArm | None:
        """Return what is kept of an arm, None for nothing.

        A damaged file says nothing of the arm. Raise OSError when the disk refuses.
        """
        path = self.file(serial)
        try:
            if path.stat().st_size > LARGEST_FILE_BYTES:
                return None
            known = msgspec.json.decode(path.read_bytes(), type=KnownArm)
        except FileNotFoundError:
            return None
        except (msgspec.DecodeError, UnicodeDecodeError):
            return None
        return known if len(known.words) == 19 else None

    def keep(self, arm: ArmDescription) -> None:
        """Remember an arm as it is now; raise OSError when the disk refuses."""
        known = KnownArm(
            serial=arm.identity.serial,
            model=arm.identity.model,
            words=arm.geometry.to_words(),
            encoders=arm.maxima.encoders,
            seen=datetime.datetime.now(datetime.UTC).date().isoformat(),
        )
        text = msgspec.json.format(msgspec.json.encode(known), indent=2)
        with whole_file(self.file(known.serial)) as beside:
            beside.write_bytes(text + b"\n")


def changes(known: KnownArm, arm: ArmDescription) -> list[str]:
    """Return what differs between an arm and what is kept of it, in sentences."""
    before = constants_by_name(
        ArmGeometry.from_words(known.words[:18], known.words[18])
    )
    after = constants_by_name(arm.geometry)
    messages = [
        f"{name} was {before[name]:.3f} and is {after[name]:.3f} {unit_of(name)}"
        for name in before
        if abs(before[name] - after[name]) > SAME
    ]
    if known.encoders != arm.maxima.encoders:
        messages.append(f"encoders were {known.encoders} and are {arm.maxima.encoders}")
    return messages
