"""The example draws a head of splats and a tube that goes into it."""

import runpy
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.offscreen import opengl_works

EXAMPLE = Path(__file__).parents[2] / "examples" / "show_head_in_pyvista.py"


@pytest.mark.display
@pytest.mark.skipif(not opengl_works(), reason="no OpenGL library here")
def test_the_head_and_the_tube_are_seen(tmp_path: Path) -> None:
    target = tmp_path / "new" / "head.png"
    runpy.run_path(str(EXAMPLE))["main"](target, spacing_mm=2.0, side=256)
    picture = np.asarray(Image.open(target)).astype(int)[..., :3]
    red, green, blue = picture[..., 0], picture[..., 1], picture[..., 2]
    head = red > 1.4 * np.maximum(green, blue)
    lit = red > 60
    tube = lit & (np.abs(red - green) < 25) & (np.abs(green - blue) < 25)
    assert 0.1 < (head & lit).mean() < 0.6
    rows = np.nonzero(tube[:, 64:192].sum(axis=1) >= 2)[0]
    # from below up to the nose, in which its tip is hidden
    assert rows.max() > 225
    assert picture[0].max() == 0
    assert red[head & lit].std() > 10
