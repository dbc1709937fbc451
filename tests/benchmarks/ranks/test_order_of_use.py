from benchmarks.ranks.orbits import folded_scene, orbit
from benchmarks.ranks.order_of_use import PAPER_SHARE, order_of_use
from renderers.art.quality import Quality


def test_shares_of_knowing_what_was_used_last_are_measured() -> None:
    found = order_of_use(folded_scene(24), Quality(1.0, 1 / 256), orbit(24, 32, 1)[0])
    assert 0 <= found["share_stamps"] < 1
    assert 0 < found["share_victims"] < 1
    assert found["evictions"] > 0
    assert found["paper_share"] == PAPER_SHARE
