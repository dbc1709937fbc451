"""The phantom's suite measures what it says."""

from anatomy import PhantomParameters, build_phantom
from benchmarks.suites.anatomy import AnatomyPlan, output_bytes

BOX = ((-14.0, 0.0), (-4.0, 40.0), (0.0, 30.0))


def test_a_finer_grid_has_more_bytes() -> None:
    coarse, fine = (
        build_phantom(PhantomParameters(), h, field_mm=BOX) for h in (1.2, 0.6)
    )
    assert output_bytes(fine) > 6 * output_bytes(coarse)
    assert output_bytes(coarse) == 11 * coarse.ct.values.size


def test_a_head_is_measured_in_time_error_and_memory() -> None:
    head = AnatomyPlan(quick=True).tasks()[0]
    found = head.measure().counters
    assert found["voxels"] > 1e5 / 2
    assert found["peak memory / output"] > 1.0
    median, far = (found[f"surface error {name} um"] for name in ("median", "p90"))
    assert 0.0 < median < far < 500.0
