"""The copies of the tissue that the force loop reads."""

import numpy as np

from paravol.haptics.kernels.publishing import counted
from paravol.haptics.tissue_copies import TissueCopies
from renderers.scene import Change, ChangeKind
from surgery import solids
from surgery.edit import CuttingLimits
from surgery.patient import OperatedPatient
from tests.paravol.haptics.simulated_loop import floor


def newest(copies: TissueCopies) -> np.ndarray:
    number = counted(copies.tissue.published)
    patch = copies.tissue.even if number % 2 == 0 else copies.tissue.odd
    return patch.distance


def bite(patient: OperatedPatient, x_mm: float) -> Change:
    solid = solids.capsule((x_mm, 11.0, 7.0), (x_mm, 13.0, 8.0), 1.5)
    cut = patient.carve(solid, time_s=x_mm, taker=CuttingLimits(20.0, 1.0))
    assert cut is not None
    return cut.change


def test_every_published_copy_is_the_tissue_of_that_moment_bit_by_bit() -> None:
    patient = floor()
    copies = TissueCopies(patient)
    assert np.array_equal(newest(copies), patient.surface.distance.values)
    for number, x_mm in enumerate((6.0, 9.0, 12.0, 15.0, 18.0)):
        before = newest(copies)
        kept = before.copy()
        copies.follow([bite(patient, x_mm)])
        assert counted(copies.tissue.published) == number + 1
        # the loop may still read the one before: it stays
        assert np.array_equal(before, kept)
        assert np.array_equal(newest(copies), patient.surface.distance.values)
    undone = patient.undo()
    assert undone is not None
    copies.follow([undone])
    assert np.array_equal(newest(copies), patient.surface.distance.values)


def test_what_leaves_the_tissue_as_it_is_publishes_nothing() -> None:
    patient = floor()
    copies = TissueCopies(patient)
    low = np.zeros(3, np.int64)
    copies.follow([])
    copies.follow([Change(1, low, low + 3, ChangeKind.FILM)])
    assert counted(copies.tissue.published) == 0
    assert counted(copies.tissue.begun) == 0
