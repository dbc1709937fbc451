"""The small scene of the renderers' tests, for ranks that are simulated."""

from tests.renderers.conftest import outside, scene

__all__ = ["outside", "scene"]
