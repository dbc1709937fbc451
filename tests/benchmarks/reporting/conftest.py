"""Made-up results of every kind that the report tells of."""

from collections.abc import Mapping

import msgspec
import pytest

from benchmarks.losslessness import COMPARED, DIFFER
from benchmarks.schema import Results, Row, Setting, Skipped

HOSTILE = "<script>alert('x')</script>"


def changed(row: Row, *, told: Mapping[str, Setting], **fields: object) -> Row:
    settings = {"size": 512, "lens": "perspective", "threads": 1, **told}
    plain: dict[str, object] = {"baseline": None, "ratio": None, "counters": {}}
    return msgspec.structs.replace(row, **plain | fields, settings=settings)


def compared_rows(row: Row) -> list[Row]:
    """Two renderers at three steps each: ours is on the front; so are points."""
    found = [
        changed(
            row,
            told={"series": maker, "step_voxels": step, "reference": "R"},
            mode=f"{maker}, step {step:g}",
            cpu_s=0.01 * cost / step,
            rmse=0.01 * step**2,
        )
        for maker, cost in (("ART", 1.0), ("VTK fixed-point", 4.0))
        for step in (0.25, 1.0, 0.5)
    ]
    splats = {"series": "FSR points", "reference": "R"}
    found.append(changed(row, told=splats, mode="FSR points", cpu_s=0.002, rmse=0.2))
    two: dict[str, Setting] = {
        "series": "ART, two threads",
        "reference": "R",
        "threads": 2,
    }
    found.append(
        changed(
            row,
            told=two,
            mode="ART, two threads",
            baseline="ART, step 1",
            clock="wall",
            ratio=1.8,
            rmse=1e-6,
            time_s=msgspec.structs.replace(row.time_s, min=1e-4),
        )
    )
    return found


def quoted_rows(row: Row) -> list[Row]:
    peer = {"series": "VTK fixed-point", "reference": "R"}
    equal = {"series": "ART, equal error", "reference": "R"}
    case = "phantom/nasopharynx/wall"
    return [
        changed(row, told=peer, case=case, mode="VTK fixed-point, step 0.5"),
        changed(
            row,
            told=equal,
            case=case,
            mode="ART, no more error",
            baseline="VTK fixed-point, step 0.5",
            ratio=7.25,
            further_rmse={"of the unlit picture": 3.25e-3},
        ),
    ]


@pytest.fixture
def results(row: Row) -> Results:
    bare: dict[str, object] = {"rmse": None, "p999": None, "error_unit": None}
    rows = compared_rows(row) + quoted_rows(row)
    rows += [
        changed(
            row,
            told={"series": "FSR points", "grows_with": "pixels", "amount": n},
            suite="fsr-growth",
            case="phantom/outside/points, pixels",
            mode=f"{n}",
            cpu_s=1e-6 * n,
            **bare,
        )
        for n in (100, 400, 1600)
    ]
    rows += [
        changed(
            row,
            told={"skips": "clear space"},
            suite="skipping",
            mode=mode,
            ratio=4.0,
            counters={COMPARED: 5000.0, DIFFER: differ},
            **bare,
        )
        for mode, differ in (("leaping", 0.0), ("leaping badly", 7.0))
    ]
    rows += [changed(row, told={}, suite="startup", mode=HOSTILE, **bare)]
    skips = [Skipped(suite="fsr", case="c", mode=m, reason="no OpenGL") for m in "ab"]
    return Results(rows=rows, skipped=skips)
