"""CSV: every number of every sample can be read back to the bit."""

import csv
from pathlib import Path

import numpy as np
import pytest

from paravol.exchange.sample_table import COLUMNS, write_samples
from scenarios import InstrumentState, Sample, tip_frame
from scenarios.bundle import Recording, SampleRecord
from system import UserError
from tests.scenarios.session_info import INFO


def test_samples_come_back_from_the_table(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    samples = [
        Sample(
            float(rng.normal()),
            tip_frame(rng.normal(size=3), rng.normal(size=3)),
            float(rng.normal()),
            rng.normal(size=3),
            rng.normal(size=3),
            i,
            InstrumentState('a "tool", sharp', roll_deg=0.1, undone=i),
            is_frozen=i == 2,
        )
        for i in range(5)
    ]
    records = [SampleRecord.of(sample) for sample in samples]
    found = Recording(INFO, list(records), True, (), {})
    assert write_samples(tmp_path / "a.csv", found) == 5
    with open(tmp_path / "a.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert tuple(rows[0]) == COLUMNS
    for row, sample in zip(rows, samples, strict=True):
        assert float(row["time_s"]) == sample.time_s
        read = [
            float(row[f"device_from_tip_{r}{c}"]) for r in range(4) for c in range(4)
        ]
        assert read == sample.device_from_tip.ravel().tolist()
        tip = [float(row[f"instrument_tip_{c}_mm"]) for c in "xyz"]
        assert tip == sample.instrument_tip_mm.tolist()
        assert row["instrument"] == sample.instrument.name
        assert row["is_frozen"] == str(int(sample.is_frozen))
        pointing = [float(row[f"scope_pointing_{c}"]) for c in "xyz"]
        assert pointing == (-sample.device_from_tip[:3, 2]).tolist()
    with pytest.raises(UserError, match="no sample"):
        write_samples(tmp_path / "b.csv", Recording(INFO, [], True, (), {}))
    assert not (tmp_path / "b.csv").exists()
