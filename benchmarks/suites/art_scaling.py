"""Ranks and cells on simulated machines, beside the measurements of the 1995 paper.

Every time here is simulated, except that the row's own says how long the simulation
took. The nodes are those that ship; the machine is simulated.
"""

from collections.abc import Callable
from dataclasses import replace

from benchmarks.plan import Measured, Plan, Task
from benchmarks.schema import Setting
from benchmarks.simulated_ranks.simulated_machine import T3D, Costs
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
        """List the runs: Table 1, Figure 4, other dataflows."""
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
        return found + self._dataflows(small)

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

    def _dataflows(self, orbit: Orbit) -> list[Task]:
        base = self._setup(16, orbit, 2 if self.quick else 6, T3D)
        setups = {
            "replicated": replace(base, dataflow=Dataflow.REPLICATED),
            "static homes": replace(base, dataflow=Dataflow.STATIC),
            "migrating": base,
            "migrating, one request at a time": replace(base, most_pending=1),
        }
        return [
            self._task(
                f"ways/16 ranks, cache {cache:g}/t3d",
                name,
                replace(setup, cache=cache),
                lambda _: {},
            )
            for cache in (3.0, 1.5)
            for name, setup in setups.items()
        ]

    def _setup(
        self, ranks: int, orbit: Orbit, frames: int, costs: Costs, cache: float = 3.0
    ) -> Setup:
        return Setup(ranks, orbit, frames, costs, 0.0, cache, tile_of(ranks))

    def _sample_s(self, setup: Setup) -> float:
        orbit = setup.orbit
        return paper_sample_s(self._of(orbit), setup.frames, orbit.side)

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


def _counters(outcome: Outcome) -> dict[str, float]:
    shares = {f"share_{name}": share for name, share in outcome.shares().items()}
    frames = outcome.setup.frames
    data = sum(outcome.data_by_hops.values())
    hops = sum(hops * n for hops, n in outcome.data_by_hops.items())
    return {
        "simulated_s": outcome.seconds,
        "overhead": outcome.overhead,
        "cells_fetched_a_frame": outcome.cells_fetched / frames,
        "mb_a_frame": outcome.bytes_sent / frames / 1e6,
        "messages_a_frame": sum(outcome.sent.values()) / frames,
        "hops_a_cell": hops / max(data, 1),
        "owners_moved": float(outcome.owners_moved),
        "slots": float(outcome.slots),
        "cold_frame_s": outcome.frame_s[0],
        "unexplained": abs(1 - sum(outcome.shares().values())),
        **shares,
    }
