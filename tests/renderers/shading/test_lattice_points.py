"""Points that a part of a picture asks for, against their definition."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from renderers.scene import AirSurface, Camera, GBuffer
from renderers.shading import ScopeLight, ScopeShader, Tier
from tests.renderers.shading.steel import tool

LIGHT = ScopeLight()


@pytest.mark.parametrize("tier", [Tier.LIVE, Tier.SNAPSHOT])
@pytest.mark.parametrize("with_tool", [False, True])
def test_a_part_is_lit_by_the_points_it_asks_for_alone(
    surface: AirSurface,
    camera: Camera,
    tissue_gbuffer: GBuffer,
    tier: Tier,
    with_tool: bool,
) -> None:
    """To the bits of the whole picture, part by part, and nothing else is looked at."""
    seen, caster = tool(camera, tissue_gbuffer)
    if not with_tool:
        seen = tissue_gbuffer
    shader = ScopeShader(surface, tier, threads=1)
    casters = (caster,) if with_tool else ()
    whole = shader.shade(seen, camera, LIGHT, casters=casters)
    lattice = shader.lattice(seen.size, camera, LIGHT, casters)
    known = []
    row, column = (n // 3 for n in seen.size)
    for rows, columns in (
        (slice(row, row + 7), slice(column, column + 9)),
        (slice(0, 5), slice(None)),
        (slice(row - 3, row + 9), slice(column + 5, None)),
    ):
        only = np.zeros(seen.size, np.bool_)
        only[rows, columns] = True
        needed = only | shader.lattice_pixels(seen, only)
        # elsewhere: nothing is known of the tissue, nor what hides the tool
        depth = np.where(needed, seen.depth_mm, np.float32(np.inf))
        cover = np.where(needed, seen.coverage, np.float32(0))
        normal = np.where(needed[..., None], seen.normal, np.float32(0))
        part = GBuffer(depth, normal, cover, seen.material)
        found = shader.shade(part, camera, LIGHT, only=only, lattice=lattice)
        assert_array_equal(found[only], whole[only])
        known.append(int(lattice.gathered.sum() + lattice.followed.known.sum()))
    assert 0 < known[0] < known[1] < known[2]
    assert known[2] < lattice.gathered.size + lattice.followed.known.size
    with pytest.raises(ValueError, match="1 tools beside a lattice"):
        shader.shade(seen, camera, LIGHT, casters=[caster], lattice=lattice)
    shader.close()
