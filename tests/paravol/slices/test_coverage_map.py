"""What was seen, painted: colours follow seconds, and nothing is invented."""

import numpy as np

from paravol.slices.coverage_map import UNSEEN, coverage_picture, seconds_at
from scenarios import Endoscope, tip_frame
from scenarios.coverage import CoverageWatch, mucosa_of
from tests.scenarios.coverage.rooms import sphere_room

ROOM = sphere_room()


def watched(looks: int) -> CoverageWatch:
    watch = CoverageWatch(mucosa_of(ROOM))
    pose = tip_frame(np.zeros(3), np.array([-1.0, 0.0, 0.0]))
    for n in range(looks):
        watch.step(0.2 * n + 1e-9, Endoscope().camera(pose, 0.0, (8, 8)), ROOM)
    return watch


def test_each_place_has_the_seconds_of_what_looked_at_it() -> None:
    watch = watched(10)
    ways = np.array([[-1.0, 0.1, 0.2], [1.0, 0.1, 0.2], [0.1, 0.2, -1.0]])
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    assert seconds_at(watch, 10.0 * ways, -ways).tolist() == [2.0, 0.0, 0.0]
    assert np.isnan(seconds_at(watch, 2.0 * ways, -ways)).all()
    assert watch.seconds.max() == 2.0
    assert watch.seen.sum() == (watch.seconds >= 0.4).sum()


def test_what_is_seen_takes_colour_from_what_is_not() -> None:
    def grey(looks: int) -> int:
        picture = coverage_picture(
            watched(looks), ROOM, {"choana, left": np.array([3.0, 0.5, 0.0])}
        )
        return int((np.ptp(picture.astype(int), axis=2) > 40).sum())

    # but for the legend's ramp
    assert grey(0) < grey(10) - 200
    assert max(UNSEEN) - min(UNSEEN) < 40
