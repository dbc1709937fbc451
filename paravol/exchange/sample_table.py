"""A session's samples in full, as CSV: one row each, every digit."""

from pathlib import Path

import numpy as np

from scenarios.bundle import Recording
from system import UserError, whole_file
from system.csv_table import CsvTable

COLUMNS = (
    "time_s",
    "is_frozen",
    *(f"scope_tip_{c}_mm" for c in "xyz"),
    *(f"scope_pointing_{c}" for c in "xyz"),
    "scope_roll_deg",
    *(f"instrument_tip_{c}_mm" for c in "xyz"),
    *(f"instrument_pointing_{c}" for c in "xyz"),
    "instrument_roll_deg",
    "instrument",
    "jaw",
    "is_working",
    "is_sucking",
    "is_carried",
    "undone",
    "washed",
    "buttons",
    *(f"device_from_tip_{row}{column}" for row in range(4) for column in range(4)),
    "scope_deg",
    "camera_roll_deg",
)
"""Places are patient LPS mm; device_from_tip is in the arm's own frame.
scope_deg is empty while the exercise's own scope is in hand."""


def write_samples(file: Path, recording: Recording) -> int:
    """Write every sample, in order; return how many. UserError where there is none."""
    records = recording.samples
    if not records:
        raise UserError("The session holds no sample; there is nothing to export.")
    matrix = np.array(recording.info.world_from_device).reshape(4, 4)
    with (
        whole_file(file) as beside,
        open(beside, "w", encoding="utf-8", newline="") as stream,
    ):
        table = CsvTable(stream, "\r\n")
        table.add(COLUMNS)
        for record in records:
            tip = matrix @ record.sample().device_from_tip
            held = record.instrument
            table.add(
                (
                    record.time_s,
                    int(record.is_frozen),
                    *tip[:3, 3].tolist(),
                    *(-tip[:3, 2]).tolist(),
                    record.roll_deg,
                    *record.instrument_tip_mm,
                    *record.instrument_pointing,
                    held.roll_deg,
                    held.name,
                    held.jaw,
                    int(held.is_working),
                    int(held.is_sucking),
                    int(held.is_carried),
                    held.undone,
                    held.washed,
                    record.buttons,
                    *record.device_from_tip,
                    record.scope_deg,
                    record.camera_roll_deg,
                )
            )
    return len(records)
