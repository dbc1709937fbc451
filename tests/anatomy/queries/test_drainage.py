from anatomy.phantom.findings import with_findings
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.phantom import build_phantom
from anatomy.queries.drainage import trapped_sinuses

FRONT_MM = ((-30.0, 30.0), (-20.0, 36.0), (14.0, 82.0))
"""Frontal sinuses, recesses and the front of the nose, LPS."""


def test_a_sinus_behind_a_full_neighbour_is_named() -> None:
    """The frontal sinus drains through the anterior ethmoid."""
    head = with_findings(PhantomParameters(), ["anterior-ethmoid:left=2"])
    found = build_phantom(head, 1.0, field_mm=FRONT_MM)
    assert trapped_sinuses(found) == ("frontal, left",)


def test_in_a_healthy_head_every_sinus_drains() -> None:
    found = build_phantom(PhantomParameters(), 1.0, field_mm=FRONT_MM)
    assert trapped_sinuses(found) == ()
