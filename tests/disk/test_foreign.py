from pathlib import Path

import pytest

from disk import reading


@pytest.mark.parametrize(
    "raised",
    [
        NotImplementedError("Unknown VR '??'"),
        RuntimeError("a\nb"),
        KeyError(),
        OSError(),
    ],
)
def test_whatever_a_library_raises_names_the_file(
    tmp_path: Path, raised: Exception
) -> None:
    file = tmp_path / "scan"
    with pytest.raises(ValueError, match="scan is damaged") as told, reading(file):
        raise raised
    assert "\n" not in str(told.value)
    assert not str(told.value).endswith(" ")


def test_a_sentence_of_ones_own_stays(tmp_path: Path) -> None:
    file = tmp_path / "scan"
    with pytest.raises(ValueError, match=r"^.*scan has no place$"), reading(file):
        raise ValueError(f"{file} has no place")
    with pytest.raises(KeyboardInterrupt), reading(file):
        raise KeyboardInterrupt
