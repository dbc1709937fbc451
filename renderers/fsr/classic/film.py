"""One view after the other, in two stages at a time.

As in the renderer of 1995, one process culls while another draws: here threads, since
compiled code holds no lock of the interpreter.
"""

from collections.abc import Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor

from renderers.fsr.classic.mode import SplatMode, Traversal
from renderers.fsr.classic.rasterizer import SplatRasterizer
from renderers.fsr.classic.splat_list import SplatList
from renderers.scene import Camera, Image
from renderers.scene.thread_team import ThreadTeam


def draw_film(
    rasterizer: SplatRasterizer,
    team: ThreadTeam,
    views: Iterable[tuple[Camera, SplatMode]],
    traversal: Traversal = Traversal.DISTANCE,
) -> Generator[Image, None, None]:
    """Draw views, culling each while the one before is drawn.

    Pictures are those of `SplatRasterizer.draw` to the bit. A view is taken one
    picture ahead.
    """
    with ThreadPoolExecutor(1, thread_name_prefix="culling") as culling:
        next_: Future[SplatList] | None = None
        for camera, mode in views:
            culled = next_
            next_ = culling.submit(rasterizer.prepare, camera, mode, traversal)
            if culled is not None:
                yield rasterizer.draw_list(culled.result(), team)
        if next_ is not None:
            yield rasterizer.draw_list(next_.result(), team)
