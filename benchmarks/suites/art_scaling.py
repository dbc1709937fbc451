"""Ranks and cells on simulated machines, beside the measurements of the 1995 paper.

Every time here is simulated, except that the row's own says how long the simulation
took. The nodes are those that ship; the machine is simulated.
"""

import statistics
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from benchmarks.plan import Measured, Plan, Task
from benchmarks.schema import Setting
from benchmarks.simulated_ranks.simulated_machine import T3D, TODAY, Costs
from benchmarks.simulated_ranks.study import (
    PAPER_S,
    Outcome,
    Setup,
    Traces,
    paper_sample_s,
    simulate,
)
from benchmarks.simulated_ranks.trace import Orbit
from benchmarks.timing import once
from renderers.art.ranks.policy import Dataflow

CACHES = (1.25, 1.5, 1.75, 2.0, 2.25, 2.5, 3.0, 4.0)
"""Volumes that all caches together hold, in Figure 4."""

SCAN_S = 64 * 64 * 0.1e-6
"""Passing over a packet that waits, where each of 64 stopped rays looks through a stack
of single rays: .1 us a ray, an assumption of 15 cycles at 150 MHz."""

TODAY_SAMPLE_S = 15e-9
"""A sample with four lights, all in all, on one 2.5 GHz core (14.6 ns measured)."""


PAPER_FRAMES = 30

LARGE_FRAMES = 3
ORBIT_STARTS_DEG: tuple[float, ...] = (0.0, 37.0, 71.0)
"""Where the repeated orbits of the large runs begin; all else is determined."""

HUGE_RANKS = 4096
HUGE_FRAMES = 2
"""Of one orbit: so many ranks take six minutes a frame."""


def tile_of(ranks: int) -> int:
    """Return the region's edge: 8 ranks balance with 32 pixels, 16 only with 16."""
    return 32 if ranks <= 8 else 16


class ScalingPlan(Plan, suite="art-scaling"):
    """List and make the simulated runs."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._traces: dict[Orbit, Traces] = {}
        self._frames = 3 if quick else 30

    def tasks(self) -> list[Task]:
        """List the runs: Table 1, Figure 4, ways of the literature, many ranks."""
        small, large = Orbit(), Orbit(side=256, image=512)
        found = [self._table(small, ranks, self._frames) for ranks in PAPER_S[128]]
        if not self.quick:
            found += [self._table(large, ranks, 8) for ranks in PAPER_S[256]]
            for spread in (1.25, 1.6):
                framed = replace(small, spread=spread)
                found += [self._table(framed, ranks, 10) for ranks in (4, 8, 16)]
        for scan_s, name in ((SCAN_S, "stack scanned"), (0.0, "packets by cell")):
            for cache in CACHES[:: 3 if self.quick else 1]:
                found.append(self._cache(small, cache, scan_s, name))
        for machine, costs in (("t3d", T3D), ("today", TODAY)):
            found += self._ways(small, machine, costs)
        if not self.quick:
            found += self._many()
        return found

    def _of(self, orbit: Orbit) -> Traces:
        return self._traces.setdefault(orbit, Traces(orbit))

    def _table(self, orbit: Orbit, ranks: int, frames: int) -> Task:
        setup = self._setup(ranks, orbit, frames, T3D)
        paper = PAPER_S[orbit.side]
        first, first_s = min(paper.items())

        def judge(outcome: Outcome) -> dict[str, float]:
            seconds = outcome.seconds * 30 / frames
            return {
                "simulated_s": seconds,
                "paper_s": float(paper[ranks]),
                "efficiency": first_s * first / (seconds * ranks),
                "paper_efficiency": first_s * first / (paper[ranks] * ranks),
            }

        case = f"table1/{orbit.side}, {orbit.spread:.2f} edges across/t3d"
        return self._task(case, f"{ranks} ranks", setup, judge)

    def _cache(self, orbit: Orbit, cache: float, scan_s: float, name: str) -> Task:
        frames = 3 if self.quick else 12
        setup = self._setup(8, orbit, frames, replace(T3D, scan_s=scan_s), cache=cache)

        def judge(outcome: Outcome) -> dict[str, float]:
            return {"simulated_s": outcome.seconds * 60 / frames, "cache": cache}

        return self._task(f"figure4/{name}/t3d", f"cache {cache:g}", setup, judge)

    def _ways(self, orbit: Orbit, machine: str, costs: Costs) -> list[Task]:
        ranks, frames = 16, 2 if self.quick else 6
        base = self._setup(ranks, orbit, frames, costs)
        ways = {
            "replicated": replace(base, dataflow=Dataflow.REPLICATED),
            "static homes": replace(base, dataflow=Dataflow.STATIC),
            "migrating": base,
            "migrating, one request at a time": replace(base, most_pending=1),
            "rays": replace(base, dataflow=Dataflow.RAYS),
        }
        case = f"ways/16 ranks, cache 3/{machine}"
        tight = f"ways/16 ranks, cache 1.5/{machine}"
        return [
            self._task(place, name, replace(setup, cache=cache), _nothing)
            for place, cache in ((case, 3.0), (tight, 1.5))
            for name, setup in ways.items()
        ]

    def _many(self) -> list[Task]:
        strong = Orbit(side=512, cell=16, image=1024, packet=4, thin=4)
        case = "strong/512, 1024 x 1024 pixels/t3d"
        found = [
            self._large(case, f"{ranks} ranks", ranks, strong)
            for ranks in (64, 256, 1024, 4096)
        ]
        case = "weak/volume and picture grow/t3d"
        for ranks, side in ((16, 256), (128, 512), (1024, 1024), (4096, 1632)):
            orbit = Orbit(side=side, cell=32, image=2 * side, thin=4)
            found.append(self._large(case, f"{ranks} ranks", ranks, orbit))
        orbit = Orbit(side=1024, cell=32, image=2048, thin=4)
        changes: dict[str, dict[str, Any]] = {
            "caches of 8 volumes": {"cache": 8.0},
            "tiles of 16 pixels, skewed": {"by_curve": False, "tile": 16},
        }
        for name, change in changes.items():
            mode = f"1024 ranks, {name}"
            found.append(self._large(case, mode, 1024, orbit, **change))
        return found

    def _large(
        self,
        case: str,
        mode: str,
        ranks: int,
        orbit: Orbit,
        **change: Any,
    ) -> Task:
        """Draw a few frames of several orbits; compare with one rank of no overhead."""
        frames, starts = LARGE_FRAMES, ORBIT_STARTS_DEG
        if ranks >= HUGE_RANKS:
            frames, starts = HUGE_FRAMES, starts[:1]
        base = self._setup(ranks, orbit, frames, T3D)
        setup = replace(base, **({"by_curve": True} | change))

        def draw() -> list[dict[str, float]]:
            found = []
            for start in starts:
                traces = Traces(replace(orbit, start_deg=start))
                ready = replace(
                    setup, orbit=traces.orbit, sample_s=self._sample_s(setup)
                )
                outcome = simulate(ready, traces)
                found.append(_counters(outcome) | _alone(outcome, traces))
            return found

        def run() -> Measured:
            timing, found = once(draw)
            return Measured(timing, counters=_spread(found))

        settings = self._settings(setup) | {"deal": "curve" if setup.by_curve else ""}
        return self.task(case, mode, run, settings, cost_s=ranks / 2)

    def _setup(
        self, ranks: int, orbit: Orbit, frames: int, costs: Costs, cache: float = 3.0
    ) -> Setup:
        return Setup(ranks, orbit, frames, costs, 0.0, cache, tile_of(ranks))

    def _sample_s(self, setup: Setup) -> float:
        if setup.costs is TODAY:
            return TODAY_SAMPLE_S
        orbit = setup.orbit
        if orbit.side in PAPER_S:
            return paper_sample_s(self._of(orbit), setup.frames, orbit.side)
        return paper_sample_s(self._of(Orbit()), setup.frames, 128)

    def _task(
        self,
        case: str,
        mode: str,
        setup: Setup,
        judge: Callable[[Outcome], dict[str, float]],
    ) -> Task:
        def run() -> Measured:
            ready = replace(setup, sample_s=self._sample_s(setup))
            traces = self._of(setup.orbit)
            for number in range(setup.frames):
                traces.frame(number)
            timing, outcome = once(lambda: simulate(ready, traces))
            return Measured(timing, counters=_counters(outcome) | judge(outcome))

        settings = self._settings(setup)
        return self.task(case, mode, run, settings, cost_s=3.0)

    @staticmethod
    def _settings(setup: Setup) -> dict[str, Setting]:
        return {
            "ranks": setup.ranks,
            "side": setup.orbit.side,
            "cell": setup.orbit.cell,
            "size": setup.orbit.image,
            "frames": setup.frames,
            "tile": setup.tile,
            "cache": setup.cache,
            "dataflow": setup.dataflow.value,
        }


def _alone(outcome: Outcome, traces: Traces) -> dict[str, float]:
    """Compare with one rank of no overhead at all, cold and warm frames apart.

    efficiency: of an animation as long as the paper's, whose later frames cost what
    the warm ones did. frames_efficiency: of the frames drawn; ranks begin a frame while
    others finish the one before, so of two frames only this is sure.
    """
    setup = outcome.setup
    one = [traces.frame(k).samples * setup.sample_s for k in range(setup.frames)]
    cold, warm = outcome.frame_s[0], sum(outcome.frame_s[1:])
    later = (PAPER_FRAMES - 1) / (setup.frames - 1)
    whole = (one[0] + later * sum(one[1:])) / setup.ranks
    return {
        "efficiency": whole / (cold + later * warm),
        "frames_efficiency": sum(one) / (outcome.seconds * setup.ranks),
        "cold_efficiency": one[0] / (cold * setup.ranks),
        "warm_efficiency": sum(one[1:]) / (warm * setup.ranks),
        "balance_limit": traces.balance(setup),
    }


def _spread(runs: list[dict[str, float]]) -> dict[str, float]:
    """Return the median of each figure, and the range of those that runs differ in."""
    found: dict[str, float] = {}
    for name in runs[0]:
        values = [run[name] for run in runs]
        found[name] = statistics.median(values)
        if name.endswith("efficiency"):
            found |= {f"{name}_least": min(values), f"{name}_most": max(values)}
    return found


def _counters(outcome: Outcome) -> dict[str, float]:
    shares = {f"share_{name}": share for name, share in outcome.shares().items()}
    frames = outcome.setup.frames
    data = sum(outcome.data_by_hops.values())
    hops = sum(hops * n for hops, n in outcome.data_by_hops.items())
    return {
        "simulated_s": outcome.seconds,
        "overhead": outcome.overhead,
        "cells_fetched_a_frame": outcome.cells_fetched / frames,
        "rays_sent_a_frame": outcome.rays_sent / frames,
        "mb_a_frame": outcome.bytes_sent / frames / 1e6,
        "messages_a_frame": sum(outcome.sent.values()) / frames,
        "hops_a_cell": hops / max(data, 1),
        "owners_moved": float(outcome.owners_moved),
        "slots": float(outcome.slots),
        "cold_frame_s": outcome.frame_s[0],
        "unexplained": abs(1 - sum(outcome.shares().values())),
        **shares,
    }


def _nothing(outcome: Outcome) -> dict[str, float]:
    return {}
