"""A team that does as any other, and lets a test have a hand in it."""

from collections.abc import Callable

from renderers.art.regions import Gather
from renderers.scene import Scene
from renderers.snapshots.request import SnapshotRequest
from renderers.snapshots.team import Progress, SerialTeam, Tools, Traced


def _nothing(*_: object) -> None:
    pass


class WatchedTeam(SerialTeam):
    """Trace with threads; tell of each picture begun, and of each look at one.

    begins: before a picture is traced; what it raises comes of tracing. looks: whenever
    the share done is told and is not nothing.
    """

    def __init__(
        self,
        begins: Callable[[SnapshotRequest], None] = _nothing,
        looks: Callable[[SnapshotRequest, float], None] = _nothing,
    ) -> None:
        super().__init__()
        self._begins, self._looks = begins, looks

    def trace(
        self,
        request: SnapshotRequest,
        scene: Scene,
        progress: Progress,
        gather: Gather | None = None,
        tools: Tools = (),
    ) -> Traced:
        """Trace as a `SerialTeam`."""
        self._begins(request)

        def go_on(share: float) -> bool:
            if share > 0:
                self._looks(request, share)
            return progress(share)

        return super().trace(request, scene, go_on, gather, tools)
