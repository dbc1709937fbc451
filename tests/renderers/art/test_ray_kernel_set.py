import pytest

from renderers.art import ray_kernel_set as kernel_set
from renderers.art.ray_kernel_set import best_kernels, packet_kernels, scalar_kernels


def test_scalars_stand_in_where_vectors_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernel_set, "vector_problem", lambda: "not the numba we know")
    assert best_kernels() == scalar_kernels()


def test_packets_are_taken_where_vectors_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernel_set, "vector_problem", lambda: "")
    assert best_kernels().march_classic is not scalar_kernels().march_classic


def test_odd_widths_are_refused() -> None:
    with pytest.raises(ValueError, match="4, 8, 16, 32 or 64 rays, got 12"):
        packet_kernels(12)
