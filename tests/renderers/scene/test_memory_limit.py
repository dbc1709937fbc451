"""What one volume may take is a share of what there is."""

from renderers.scene.memory_limit import MEMORY_SHARE, memory_limit
from system import memory_bytes


def test_the_limit_is_a_share_of_the_machine() -> None:
    assert 0 < memory_limit() <= MEMORY_SHARE * memory_bytes()
