"""Which errors are the user's or the world's, and how they are told to a person."""

import errno

import msgspec

from devices import DeviceError
from system import UserError
from system.validation_message import validation_message

FAMILIES = ("renderers.art.", "renderers.snapshots.", "renderers.simd.")
"""Modules whose errors are sentences."""

LONGEST = 2000
"""Letters of a sentence."""


def sentence(error: Exception) -> str | None:
    """Put an expected error into one clear sentence; None for a defect of ours."""
    if isinstance(error, msgspec.ValidationError):
        return f"The input is not valid: {validation_message(error, None)}."
    if isinstance(error, MemoryError):
        return (
            f"The memory does not suffice ({error}); ask for a smaller "
            "picture (--size) or larger voxels (--spacing)."
        )
    if isinstance(error, OSError) and error.strerror:
        where = f": {error.filename}" if error.filename else ""
        names = (
            FileNotFoundError | PermissionError | NotADirectoryError | IsADirectoryError
        )
        remedy = "; check the name and your permissions" * isinstance(error, names)
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            remedy = "; make room there, or write to another disk"
        return f"{error.strerror}{where}{remedy}."
    # The renderers' errors are known by their family, so that commands which draw
    # nothing need not load them.
    if type(error).__module__.startswith(FAMILIES):
        return str(error)
    if isinstance(error, UserError | TimeoutError | DeviceError):
        # some quote what a file says, of any length and with breaks of lines
        told = " ".join(str(error).splitlines())
        return told if len(told) <= LONGEST else f"{told[:LONGEST]} ..."
    return None
