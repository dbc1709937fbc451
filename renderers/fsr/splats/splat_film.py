"""One view after the other, in two stages at a time.

As in the renderer of 1995, one process culls while another draws: here threads, since
compiled code holds no lock of the interpreter.
"""

from collections.abc import Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial

from renderers.fsr.splats.splat_list import SplatList
from renderers.fsr.splats.splat_mode import SplatMode, Traversal
from renderers.fsr.splats.splat_rasterizer import SplatRasterizer
from renderers.scene import Camera, Image
from renderers.scene.thread_team import ThreadTeam

Lists = Future[tuple[SplatList, ...]]


def draw_film(
    rasterizer: SplatRasterizer,
    team: ThreadTeam,
    views: Iterable[tuple[Camera, SplatMode]],
    traversal: Traversal = Traversal.DISTANCE,
) -> Generator[Image, None, None]:
    """Draw views, culling each while the one before is drawn.

    Pictures are those of `SplatRasterizer.draw` to the bit. A view is taken one picture
    ahead.
    """
    coming = iter(views)
    with ThreadPoolExecutor(1, thread_name_prefix="culling") as culling:

        def cull(view: tuple[Camera, SplatMode]) -> Lists:
            prepare = partial(rasterizer.prepare, threads=team.threads)
            return culling.submit(prepare, *view, traversal)

        view = next(coming, None)
        waiting = cull(view) if view is not None else None
        while waiting is not None:
            lists = waiting.result()
            view = next(coming, None)
            waiting = cull(view) if view is not None else None
            yield rasterizer.draw_list(lists, team)
