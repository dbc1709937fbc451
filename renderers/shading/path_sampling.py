"""Paths where they help the picture most: a view's light, better with every moment.

The picture is cut into blocks. Each has a place in a heap by how much one batch of
paths more would lower the picture's squared error: the estimated variance of the light
that arrives, times the squared weight with which the picture shows it. The most urgent
block is walked, its error estimated anew, and it goes back into the heap (priority
driven ray tracing). It may stop between any two batches: what has come together is the
best picture so far, its error is told, and it can be stored and gone on with to the
same bits. A block's light depends on the number of its batches alone, not on the order.
"""

import heapq
import math

import numpy as np
from numpy.typing import NDArray

from renderers.shading.path_tracer import PathLight, PathTracer, SeenWalls, estimate

BLOCK_PX = 16
"""Edge of a block: some 10 ms of paths, and enough pixels to know its error by."""
LEAST_BATCHES = 2
"""From these on a spread is known; until then every block is as urgent as any."""


class PathSampling:
    """Gather one view's light by paths, block by block.

    state: of an earlier sampling of the same view by the same tracer (see `state`).
    ValueError when it cannot be.
    """

    def __init__(
        self,
        tracer: PathTracer,
        walls: SeenWalls,
        state: NDArray[np.float64] | None = None,
    ) -> None:
        self._tracer = tracer
        self._walls = walls
        height, width = walls.shown.shape
        self._blocks = [
            (y, min(y + BLOCK_PX, height), x, min(x + BLOCK_PX, width))
            for y in range(0, height, BLOCK_PX)
            for x in range(0, width, BLOCK_PX)
            if walls.shown[y : y + BLOCK_PX, x : x + BLOCK_PX].any()
        ]
        self._weight = np.ones(3, np.float32) if walls.weight is None else walls.weight
        self._total = np.zeros((height, width, 3))
        self._squares = np.zeros((height, width, 3))
        self._batches = np.zeros((height, width), np.int32)
        if state is not None:
            self._take(state)
        # squared errors and sums of light, block by block
        self._errors = np.zeros(len(self._blocks))
        self._light = np.zeros(len(self._blocks))
        self._heap = [self._urgency(number) for number in range(len(self._blocks))]
        heapq.heapify(self._heap)

    @property
    def batches(self) -> int:
        """Count the batches of blocks walked so far."""
        return sum(int(self._batches[b[0], b[2]]) for b in self._blocks)

    @property
    def blocks(self) -> int:
        """Count the blocks in which anything is seen."""
        return len(self._blocks)

    @property
    def is_complete(self) -> bool:
        """Return whether every block has light and an error."""
        return not self._heap or self._heap[0][0] == LEAST_BATCHES

    def noise(self) -> float:
        """Return `PathLight.noise` of what there is; inf before it is known.

        Of the light as the picture shows it, where the walls have weights.
        """
        if not self.is_complete:
            return math.inf
        light = float(self._light.sum())
        if light == 0:
            return 0.0
        size = 3 * self._batches.size
        return math.sqrt(float(self._errors.sum()) / size) / (light / size)

    def step(self) -> None:
        """Walk one batch in the block where it helps most."""
        if not self._heap:
            return
        number = heapq.heappop(self._heap)[2]
        top, bottom, left, right = block = self._blocks[number]
        batch = int(self._batches[top, left])
        self._tracer.walk(self._walls, batch, block, self._total, self._squares)
        self._batches[top:bottom, left:right] += 1
        heapq.heappush(self._heap, self._urgency(number))

    def light(self) -> PathLight:
        """Return the best estimate so far."""
        return estimate(self._walls, self._total, self._squares, self._batches)

    def state(self) -> NDArray[np.float64]:
        """Return all that going on takes, ``(h, w, 7)``: sums, squares, batches."""
        counts = self._batches[..., None].astype(np.float64)
        return np.concatenate([self._total, self._squares, counts], axis=-1)

    def _urgency(self, number: int) -> tuple[int, float, int]:
        """Estimate a block's error; give its place by what one batch would bring."""
        top, bottom, left, right = self._blocks[number]
        here = slice(top, bottom), slice(left, right)
        n = int(self._batches[top, left])
        gain = math.inf
        if n >= LEAST_BATCHES:
            mean = self._total[here] / n
            spread = np.maximum(self._squares[here] / n - mean * mean, 0) / (n - 1)
            weight = self._weight if self._weight.ndim == 1 else self._weight[here]
            self._errors[number] = (weight * weight * spread).sum()
            self._light[number] = (weight * mean).sum()
            # the variance of a mean falls from s^2 / n to s^2 / (n + 1)
            gain = self._errors[number] / (n + 1)
        return min(n, LEAST_BATCHES), -gain, number

    def _take(self, state: NDArray[np.float64]) -> None:
        shape = (*self._batches.shape, 7)
        if state.shape != shape or state.dtype != np.float64:
            raise ValueError(
                f"this view goes on from float64 {shape}, got {state.dtype} "
                f"{state.shape}"
            )
        counts = state[..., 6]
        even = all(np.ptp(counts[b[0] : b[1], b[2] : b[3]]) == 0 for b in self._blocks)
        whole = np.all((counts >= 0) & (counts < 2**31) & (counts == np.rint(counts)))
        if not (np.all(np.isfinite(state)) and state.min() >= 0 and even and whole):
            raise ValueError("what was stored of these paths is damaged; begin anew")
        self._total[:] = state[..., :3]
        self._squares[:] = state[..., 3:6]
        self._batches[:] = counts
