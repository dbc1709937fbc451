"""Suite `light` on a coarse head."""

from collections.abc import Callable
from contextlib import closing
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.light_witness import Estimate
from benchmarks.plan import Task, UnavailableError
from benchmarks.suites.light import NOTHING, PATHS, WITNESSED, WITNESSES, LightPlan
from benchmarks.timing import Timing
from renderers.scene import Scene

VIEWS = "nose/views/bounce"


@pytest.mark.slow
def test_more_virtual_lights_come_nearer_to_the_truth(
    monkeypatch: pytest.MonkeyPatch, coarse_nasal_scene: Callable[[str], Scene]
) -> None:
    monkeypatch.setattr("benchmarks.suites.light.nasal_scene", coarse_nasal_scene)
    with closing(LightPlan(quick=True)) as plan:
        made = {
            task.mode: task.measure() for task in plan.tasks() if task.case == VIEWS
        }
    assert 0 < made[PATHS].counters["noise, worst view"] < 0.3
    rmse = {mode: found.error.rmse for mode, found in made.items() if found.error}
    assert rmse["256 virtual lights"] < rmse[NOTHING] / 2
    assert rmse["512 virtual lights"] < rmse[NOTHING] / 2


class FakeRoom:
    """A room that is not looked into."""

    surface = SimpleNamespace(distance=None)
    albedo = camera = light = None
    edges = np.zeros((30, 30), bool)


class FakeJobs:
    """Answer with passes of a mean and a noise, in two CPU seconds."""

    mean = 1.0

    def __init__(self, *_: object) -> None:
        pass

    def job(self, *_: object, **__: object) -> dict[str, object]:
        return {}

    def passes(self, _: object) -> tuple[np.ndarray, float]:
        noise = np.random.default_rng(1).normal(0, 0.4, (16, 30, 30, 1))
        return np.repeat((self.mean + noise).astype(np.float32), 3, axis=-1), 2.0


@pytest.fixture
def witness(monkeypatch: pytest.MonkeyPatch) -> dict[str, Task]:
    monkeypatch.setattr("benchmarks.suites.light.LightJobs", FakeJobs)
    plan = LightPlan(quick=True)
    noise = np.random.default_rng(2).normal(0, 0.05, (30, 30, 1))
    mean = np.repeat(1 + noise, 3, axis=-1)
    own = Estimate(mean, np.full_like(mean, 0.05)), Timing(7.0, 7.0, 6.0, 1)
    plan.__dict__.update(_own=own, _room=FakeRoom)
    return {task.mode: task for task in plan.tasks()}


@pytest.mark.parametrize("name", WITNESSES)
def test_the_witness_is_timed_at_our_noise(witness: dict[str, Task], name: str) -> None:
    """Its noise is .1 here, ours .05: it would need four times its two seconds."""
    own, theirs = witness[WITNESSED].measure(), witness[name].measure()
    assert own.timing.cpu_s == 6.0
    assert theirs.timing.cpu_s == pytest.approx(8.0, rel=0.05)
    assert abs(theirs.counters["mean difference"]) < 0.02
    assert witness[name].baseline == WITNESSED


@pytest.mark.parametrize("name", WITNESSES)
def test_other_light_has_no_time(
    witness: dict[str, Task], monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setattr(FakeJobs, "mean", 1.05)
    with pytest.raises(UnavailableError, match="not the same picture"):
        witness[name].measure()
