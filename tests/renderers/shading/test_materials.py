import numpy as np

from renderers.scene import Material
from renderers.shading.materials import SURFACES, material_table


def test_every_material_has_a_row_in_order() -> None:
    table = material_table()
    assert set(SURFACES) == set(Material)
    for m in Material:
        assert table[m, 4] == np.float32(SURFACES[m].f0)
    assert [int(m) for m in Material] == list(range(len(table)))


def test_no_material_gives_back_more_than_it_gets() -> None:
    table = material_table()
    share, colour, f0 = table[:, 0], table[:, 1:4], table[:, 4]
    # tissue itself never exceeds .7, the albedo of bloodless mucosa
    assert np.all(0.7 * share[:, None] + colour <= 1)
    assert np.all((f0 > 0) & (f0 < 1))


def test_only_tissue_and_what_lies_on_it_take_the_blood_volumes_colour() -> None:
    share = material_table()[:, 0]
    assert {Material(int(i)) for i in np.nonzero(share)[0]} == {
        Material.TISSUE,
        Material.MUCUS,
    }
