from types import MappingProxyType

import numpy as np

from anatomy.tissue import Label
from paravol.guide import names_in_view
from renderers.scene import Camera, Volume
from scenarios.structures import Structures

H = 0.5
SIZE = 41
PLACES = {
    "before": np.array([6.0, 8.0, 10.0]),
    "at the wall": np.array([12.0, 14.0, 10.0]),
    "behind": np.array([10.0, 19.0, 10.0]),
}


def test_what_is_seen_is_named_and_what_is_hidden_is_not() -> None:
    y = H * np.mgrid[:SIZE, :SIZE, :SIZE][1].astype(float)
    spacing, origin = np.full(3, H), np.zeros(3)
    air = Volume(
        (1.5 - np.abs(y - 15.5)).astype(np.float32), spacing, origin, background=9
    )
    labels = np.full((SIZE,) * 3, Label.UNCINATE, np.uint8)
    wall = Volume(labels, spacing, origin, background=0)
    names = {int(Label.UNCINATE): "uncinate"}
    named = Structures.of(air, wall, names, MappingProxyType({}))
    eye, ahead = np.array([10.0, 2.0, 10.0]), np.array([0.0, 1.0, 0.0])
    camera = Camera.looking_at(eye, eye + ahead, size=(64, 64))
    found = names_in_view(camera, air, PLACES, named)
    assert [mark.name for mark in found] == [
        "uncinate process",
        "before",
        "at the wall",
    ]
    assert (found[0].x, found[0].y) == (0.5, 0.5)
    for mark in found[1:]:
        (column, row), _ = camera.project(PLACES[mark.name])
        assert np.allclose((mark.x, mark.y), (column / 64, row / 64))
    turned = Camera.looking_at(eye, eye - ahead, size=(64, 64))
    assert names_in_view(turned, air, PLACES, named) == ()
    assert [m.name for m in names_in_view(camera, air, PLACES, None)] == [
        "before",
        "at the wall",
    ]
