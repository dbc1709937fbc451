"""A probe path on disk.

The file is JSON with one row per line, so that a version control system shows which
samples changed. Floats are written with the shortest digits that read back to the
same bits.
"""

from pathlib import Path
from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from devices.recording.probe_path import ProbePath
from system import UserError, foreign_file, whole_file
from system.typed_record import decode_json

COLUMNS = (
    "t_s",
    "tip_x_mm",
    "tip_y_mm",
    "tip_z_mm",
    "axis_x",
    "axis_y",
    "axis_z",
    "roll_deg",
    "instrument_tip_x_mm",
    "instrument_tip_y_mm",
    "instrument_tip_z_mm",
    "instrument_axis_x",
    "instrument_axis_y",
    "instrument_axis_z",
    "buttons",
)

SECOND_HAND = ("instrument_roll_deg", "jaw")
"""Columns that follow in a path whose second hand turns its tool and moves its jaws."""

# A path file of an hour at 100 Hz is about 60 MB; more is a mistaken file name.
LARGEST_FILE_BYTES = 200_000_000


class _PathFile(msgspec.Struct, forbid_unknown_fields=True):
    format: Literal["paravol.path"]
    version: Literal[1]
    name: str
    source: str
    frame: Literal["LPS"]
    unit: Literal["mm"]
    columns: tuple[str, ...]
    rows: list[tuple[float, ...]]
    tools: tuple[tuple[float, str], ...] = ()
    scopes: tuple[tuple[float, float | None], ...] = ()


def load_probe_path(file: Path | str) -> ProbePath:
    """Read a path file; raise ValueError that names the file when it is not one."""
    file = Path(file)
    try:
        if file.stat().st_size > LARGEST_FILE_BYTES:
            raise UserError("it is too large for a path")
        raw = file.read_bytes()
    except OSError as error:
        raise UserError(
            f"Probe path {file} cannot be read: {error.strerror}."
        ) from error
    read = decode_json(raw, _PathFile, file, "a probe path")
    with foreign_file(file, "a probe path"):
        if read.columns not in (COLUMNS, COLUMNS + SECOND_HAND):
            raise UserError(
                f"its columns must be {', '.join(COLUMNS)}, and may be "
                f"{' and '.join(SECOND_HAND)} besides"
            )
        count = len(read.columns)
        if any(len(row) != count for row in read.rows):
            raise UserError(f"each row must have {count} values")
        table = np.array(read.rows, dtype=np.float64).reshape(-1, count)
        return _path_from_table(read, table)


def save_probe_path(path: ProbePath, file: Path | str) -> None:
    """Write ``path`` so that loading it gives the same bits; whole or not at all."""
    file = Path(file)
    said: dict[str, object] = {
        "format": "paravol.path",
        "version": 1,
        "name": path.name,
        "source": path.source,
        "frame": "LPS",
        "unit": "mm",
        "columns": COLUMNS,
    }
    if path.tools:
        said["tools"] = path.tools
    if path.scopes:
        said["scopes"] = path.scopes
    second = np.column_stack((path.instrument_roll_deg, path.jaw))
    if second.any():
        said["columns"] = COLUMNS + SECOND_HAND
    else:
        second = second[:, :0]
    header = msgspec.json.encode(said)
    table = np.column_stack(
        (
            path.t_s,
            path.tip_mm,
            path.axis,
            path.roll_deg,
            path.instrument_tip_mm,
            path.instrument_axis,
        )
    ).tolist()
    rows = b",\n".join(
        msgspec.json.encode([*row, button, *hand])
        for row, button, hand in zip(
            table, path.buttons.tolist(), second.tolist(), strict=True
        )
    )
    with whole_file(file, makes_folder=False) as beside:
        beside.write_bytes(header[:-1] + b',"rows":[\n' + rows + b"\n]}\n")


def _path_from_table(read: _PathFile, table: NDArray[np.float64]) -> ProbePath:
    buttons = table[:, 14].astype(np.int64)
    if not np.array_equal(buttons, table[:, 14]):
        raise UserError("its buttons must be whole numbers")
    return ProbePath(
        name=read.name,
        source=read.source,
        tools=read.tools,
        t_s=table[:, 0],
        tip_mm=table[:, 1:4],
        axis=table[:, 4:7],
        roll_deg=table[:, 7],
        instrument_tip_mm=table[:, 8:11],
        instrument_axis=table[:, 11:14],
        buttons=buttons,
        scopes=read.scopes,
        instrument_roll_deg=table[:, 15:16].ravel(),
        jaw=table[:, 16:17].ravel(),
    )
