"""Suites from end to end on a coarse head, and on what they make themselves."""

import sys
import time

import msgspec
import numpy as np
import pytest

from anatomy import PhantomParameters, build_phantom
from benchmarks import nasal_views
from benchmarks.nasal_views import bundled_flight
from benchmarks.suites.anatomy import AnatomyPlan, output_bytes
from benchmarks.suites.art_growth import GrowthPlan, shell_scene, shells
from benchmarks.suites.art_scaling import ScalingPlan
from benchmarks.suites.flight import STAGES, FlightPlan, PacedPoses
from benchmarks.suites.haptics import HapticsPlan
from benchmarks.suites.jobs import JobsPlan
from benchmarks.suites.light import NOTHING, PATHS, LightPlan
from benchmarks.suites.look import EVERYTHING, LookPlan
from benchmarks.suites.refinement import SHARES, TOLERANCES, RefinementPlan
from benchmarks.suites.takeover import ANEW, GONE_ON, RAYS, UNDISTURBED, TakeoverPlan
from tests.benchmarks.suites.conftest import Make, by_mode, measured, rmse

BOX = ((-14.0, 0.0), (-4.0, 40.0), (0.0, 30.0))


@pytest.mark.slow
def test_more_virtual_lights_come_nearer_to_the_truth(in_nose: Make) -> None:
    made = by_mode(in_nose(LightPlan).tasks())
    assert 0 < made[PATHS].counters["noise, worst view"] < 0.3
    for count in (256, 512):
        assert rmse(made[f"{count} virtual lights"]) < rmse(made[NOTHING]) / 2


@pytest.mark.slow
def test_each_ingredient_is_missed(in_nose: Make) -> None:
    made = measured(in_nose(LookPlan, _size=96, _budget_s=0.0).tasks())
    for (_, mode), found in made.items():
        assert (rmse(found) == 0) == (mode == EVERYTHING), mode
        if mode == EVERYTHING:
            assert found.counters["metal pixels"] > 50


@pytest.mark.slow
def test_the_more_samples_the_less_error_and_none_in_the_end(in_nose: Make) -> None:
    made = by_mode(in_nose(RefinementPlan).tasks())
    for tolerance in TOLERANCES:
        told = made[f"to {tolerance:g} codes"].counters["error told, codes rms"]
        assert 0 < told <= tolerance
    found = [one for mode, one in made.items() if mode.startswith("four samples f")]
    assert len(found) == len(SHARES)
    error = [one.counters["error found, codes rms"] for one in found]
    share = [one.counters["share of samples"] for one in found]
    assert share[0] == 0.25
    assert share == sorted(share)
    assert error == sorted(error, reverse=True)
    assert error[-1] == 0


def test_poses_come_in_order_when_their_time_has_come() -> None:
    _, path = bundled_flight()
    poses = PacedPoses(path, 200.0)
    first = poses.read(1.0)
    begun = time.monotonic()
    with pytest.raises(TimeoutError):
        poses.read(0.0)
    second = poses.read(1.0)
    assert second.time_s > first.time_s
    assert second.host_time_s <= time.monotonic()
    assert first.host_time_s <= begun
    assert first.tip_mm == pytest.approx(path.sample(0.0).tip_mm)


@pytest.mark.slow
def test_every_figure_of_a_flight_is_measured(
    quick: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario, path = bundled_flight()
    head = msgspec.structs.replace(scenario.head, spacing_mm=1.0)
    coarse = msgspec.structs.replace(scenario, head=head), path
    for module in ("suites.flight", "nasal_views"):
        monkeypatch.setattr(f"benchmarks.{module}.bundled_flight", lambda: coarse)
    monkeypatch.setattr(
        "benchmarks.nasal_views.nasal_scene", nasal_views.nasal_scene.__wrapped__
    )
    plan = quick(FlightPlan, _size=64, _flown_s=0.5, _places=2, _compared=1)
    made = measured(plan.tasks())
    for one in ("1 thread", "2 threads"):
        found = made["first_flight/path/frame", one].counters
        whole = sum(found[f"{stage}_ms_p50"] for stage in STAGES)
        assert 0 < found["frame_ms_p50"] <= found["frame_ms_p99"]
        assert whole > 0.5 * found["frame_ms_p50"]
    loop = made["first_flight/loop/frame", "2 threads"].counters
    assert loop["frames"] >= 1
    assert loop["frame_ms_p99"] >= loop["frame_ms_p50"] > 0
    likeness = made["first_flight/likeness", "FSR live"]
    assert likeness.error is not None
    assert 0.5 < likeness.counters["ssim_min"] <= likeness.counters["ssim_mean"] <= 1


def test_a_finer_grid_has_more_bytes() -> None:
    coarse, fine = (
        build_phantom(PhantomParameters(), h, field_mm=BOX) for h in (1.2, 0.6)
    )
    assert output_bytes(fine) > 6 * output_bytes(coarse)
    assert output_bytes(coarse) == 11 * coarse.ct.values.size


def test_a_head_is_measured_in_time_error_and_memory(quick: Make) -> None:
    found = quick(AnatomyPlan).tasks()[0].measure().counters
    assert found["voxels"] > 1e5 / 2
    assert found["peak memory / output"] > 1.0
    median, far = (found[f"surface error {name} um"] for name in ("median", "p90"))
    assert 0.0 < median < far < 500.0


def test_shells_are_the_same_at_any_size() -> None:
    """Air between tissue, as much of each; the same places have the same values."""
    coarse, fine = shells(33), shells(65)
    assert np.array_equal(coarse.values, fine.values[::2, ::2, ::2])
    assert 0.3 < float(np.mean(fine.values > 300)) < 0.5
    assert shell_scene(coarse, lit=False).transfer_function.is_clear(-1000, 300)


def test_a_sweep_names_what_it_grows_with(quick: Make) -> None:
    plan = quick(GrowthPlan, _budget_s=0.0)
    tasks = [t for t in plan.tasks() if t.case == "shells/no lights/pixels"]
    first, second = (task.measure().counters for task in tasks)
    assert [task.settings["amount"] for task in tasks] == [128**2, 256**2]
    assert {task.settings["grows_with"] for task in tasks} == {"pixels"}
    assert second["samples"] > 3.5 * first["samples"]
    # Int16 values and a byte of distance; no gradients without lights.
    assert second["bytes_per_voxel"] == pytest.approx(3, abs=0.05)


def test_a_simulated_run_is_compared_with_the_paper(quick: Make) -> None:
    tasks = quick(ScalingPlan).tasks()
    counters = next(t for t in tasks if t.mode == "8 ranks").measure().counters
    assert counters["paper_s"] == 281
    assert abs(counters["efficiency"] - counters["paper_efficiency"]) < 0.03
    assert counters["unexplained"] < 0.005


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="its clock is Linux's")
@pytest.mark.parametrize("number", [0, 1])
def test_the_force_loop_ticks_beside_whatever_is_drawn(
    quick: Make, number: int
) -> None:
    made = quick(HapticsPlan).tasks()[number].measure()
    assert made.timing.repeats > 100
    assert 0.0 < made.counters["tick_us"] <= made.counters["dearest_tick_us"]
    assert (made.counters["frames_per_s"] > 0.0) == bool(number)


@pytest.mark.slow
def test_a_job_has_the_pixels_of_its_team_and_a_coarse_one_nearly(quick: Make) -> None:
    """Jobs are drawn, seen early and cancelled, each in the middle of the thing."""
    tasks = {(task.case, task.mode): task for task in quick(JobsPlan).tasks()}
    names = ("job", "job shown as it grows", "first sight of it")
    *whole, coarse = (tasks["classic picture", mode].measure() for mode in names)
    assert [one.error and one.error.max for one in whole] == [0, 0]
    assert 0 < rmse(coarse) < 60
    told = tasks["cancel, snapshot", "client is told"].measure()
    assert told.timing.min_s > 0


@pytest.mark.slow
def test_a_job_gone_on_with_has_the_same_picture(quick: Make) -> None:
    tasks = {(task.case, task.mode): task for task in quick(TakeoverPlan).tasks()}
    found = {m: tasks[RAYS, m].measure() for m in (UNDISTURBED, ANEW, GONE_ON)}
    assert [one.error and one.error.max for one in found.values()] == [0] * 3
    assert found[ANEW].counters["rays_kept"] == 0
    assert found[GONE_ON].counters["rays_kept"] > 0
