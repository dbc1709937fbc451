"""What the files of a pair of eyes say."""

from pathlib import Path

import msgspec
import numpy as np
from PIL import Image

from paravol.snapshots.head_scene import RenderSettings
from paravol.snapshots.outputs import RenderedPicture, save_picture
from tests.paravol.snapshots.darkroom import SIZE, Darkroom, view


def drawn(**said: object) -> RenderedPicture:
    one, _ = Darkroom([1e-3]).draw(view(), RenderSettings(), "")
    result = msgspec.structs.replace(one.result, **said)
    return RenderedPicture(
        one.view, result, one.pixels, one.rgba, one.depth_mm, one.samples
    )


def test_a_pair_is_as_complete_as_both_and_says_that_it_is_one(tmp_path: Path) -> None:
    left = drawn(seconds={"total": 1.5})
    right = drawn(seconds={"total": 2.0}, complete=False, traced=0.3, error=4.0)
    for pair in (left.beside(right, 1.5), right.beside(left, 1.5)):
        assert pair.pixels.shape == (SIZE, 2 * SIZE, 3)
        assert np.array_equal(pair.samples, np.ones((SIZE, 2 * SIZE)))
        assert not pair.result.complete
        assert (pair.result.traced, pair.result.error) == (0.3, 4.0)
        assert pair.result.seconds == {"total": 3.5}
        save_picture(tmp_path / "a.png", pair)
        with Image.open(tmp_path / "a.png") as image:
            assert str(image.info["Stereo"]).startswith("left and right eye, 1.5 mm")
            assert image.info["Complete"] == "no: stopped early"
    assert left.beside(left, 1.5).result.complete
    assert "Stereo" not in left.text()
