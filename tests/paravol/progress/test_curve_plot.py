"""Names in a picture are names, whatever a drawing program would make of them."""

from pathlib import Path
from xml.etree import ElementTree

import pytest

from paravol.progress.curve_plot import draw_curve


@pytest.mark.parametrize("name", ["$\\frac{$", "a $5 b $6", "<b>&amp;]]>", "a\x1b[2Jb"])
@pytest.mark.parametrize("ending", ["svg", "png"])
def test_markup_in_a_name_is_drawn_as_it_is(
    tmp_path: Path, name: str, ending: str
) -> None:
    file = tmp_path / f"curve.{ending}"
    draw_curve(file, name, name, [1.0, 2.0, 3.0], None)
    content = file.read_bytes()
    if ending == "svg":
        ElementTree.fromstring(content)
    # another name gives another picture: it is there
    draw_curve(file, f"{name}?", name, [1.0, 2.0, 3.0], None)
    assert file.read_bytes() != content
