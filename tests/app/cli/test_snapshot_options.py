"""What cannot be asked for together is refused before anything slow begins."""

from pathlib import Path
from typing import Any

import pytest

from app.__main__ import main
from app.cli.snapshot_options import SnapshotOptions, check, require_places

CASE = {"case": Path("c")}
PLACED: dict[str, Any] = CASE | {"eye": (0, 0, 0), "target": (0, 1, 0)}


FRAMES_AND_FILM = (Path("frames"), Path("a.mp4"))


def options(**given: Any) -> SnapshotOptions:
    return SnapshotOptions(**given)


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        ({}, "either a session folder or"),
        ({"view": Path("v"), "volume": Path("s")}, "one of them alone"),
        ({"view": Path("v"), "session": Path("s")}, "one of them alone"),
        ({"view": Path("v"), "eye": (0, 0, 0), "target": (0, 1, 0)}, "their own view"),
        (PLACED | {"lens": "perspective"}, "--lens perspective belongs to --classic"),
        (CASE | {"out": (Path("a.jpg"),)}, r"\.png, \.exr, \.nrrd; got a\.jpg"),
        (CASE | {"until": 2.0, "out": (Path("a.png"),)}, r"in a row go to \.mp4"),
        (
            CASE | {"distortion": (-0.1, 0.0)},
            r"--distortion \(-0.1, 0.0\) belongs to --eye",
        ),
        (CASE | {"tolerance": 1.0, "path_traced": True}, "--tolerance spares samples"),
        (CASE | {"tolerance": 1.0, "samples": 1}, "--tolerance spares samples"),
        (CASE | {"until": 0.0}, "--until must be later than --time"),
        (PLACED | {"until": 2.0}, "is moved by --camera-path"),
        (CASE | {"until": 2.0, "against": "fsr"}, "--against is for a single"),
        (
            CASE | {"until": 2.0, "camera_path": Path("p")},
            "either --camera-path or --until",
        ),
        (CASE | {"until": 2.0, "size": 255}, "even --size, got 255"),
        (CASE | {"path_traced": True, "classic": True}, "not --classic's"),
        (
            CASE | {"classification": "post"},
            "--classification post belongs to transfer.*--classic",
        ),
        (CASE | {"state": Path("s.npz")}, "--state s.npz belongs to --path-traced"),
        (CASE | {"against": "fast"}, "--against fast belongs to --path-traced"),
        (CASE | {"path_traced": True, "state": Path("s.bin")}, r"goes to a \.npz file"),
        (CASE | {"confidence": Path("c.jpg")}, r"--confidence goes to a \.png"),
        (CASE | {"stereo": 3.0, "against": "fsr"}, "--stereo goes without"),
        (CASE | {"until": 2.0, "size": 31, "out": FRAMES_AND_FILM}, "even --size"),
        ({"view": Path("v"), "time": 2.0}, "--time 2.0 belongs to a session"),
        (PLACED | {"time": 2.0}, "--time 2.0 belongs to a session"),
        (CASE | {"fps": 30.0}, "--fps 30.0 belongs to --until and --camera-path"),
        (
            CASE | {"up": (1.0, 0.0, 0.0)},
            r"--up \(1.0, 0.0, 0.0\) belongs to --eye and --target",
        ),
        (CASE | {"half_side": 20.0}, "--half-side 20.0 belongs to --lens orthographic"),
        (CASE | {"path_samples": 512}, "--path-samples 512 belongs to --path-traced"),
        (CASE | {"noise": 0.1}, "--noise 0.1 belongs to --path-traced"),
    ],
)
def test_mixtures_are_refused(given: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        check(options(**given))


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("--size", "4", ">= 16"),
        ("--size", "9000", "<= 8192"),
        ("--time-limit", "0", ">= 0.01"),
        ("--fps", "0", ">= 0.1"),
        ("--path-samples", "3", ">= 32"),
        ("--noise", "2", "<= 1"),
        ("--ranks", "0", ">= 1"),
        ("--tolerance", "-1", ">= 0"),
        ("--half-side", "0", ">= 0.01"),
        ("--stereo", "2000", "<= 1000"),
        ("--time", "-1", ">= 0"),
        ("--time", "inf", "< inf"),
    ],
)
def test_numbers_out_of_range_are_refused_with_the_range(
    name: str, value: str, allowed: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["snapshot", "--case", "c", f"{name}={value}"]) == 2
    said = capsys.readouterr().err
    assert f"for {name}. Must be {allowed}." in said


@pytest.mark.parametrize("name", ["--time", "--tolerance", "--fps", "--until"])
def test_what_is_no_number_is_refused(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["snapshot", "--case", "c", f"{name}=nan"]) in (1, 2)
    assert name in capsys.readouterr().err


@pytest.mark.parametrize(
    "given",
    [
        CASE,
        {"session": Path("s"), "case": Path("c")},
        {"view": Path("v"), "case": Path("c")},
        {"view": Path("v"), "size": 64},
        CASE | {"time": 2.0, "camera_path": Path("p"), "fps": 30.0},
        {"session": Path("s"), "until": 2.0},
        PLACED | {"classic": True, "lens": "orthographic", "camera_path": Path("p")},
        CASE | {"classic": True, "classification": "post"},
        {"session": Path("s"), "classic": True, "classification": "post"},
        {"view": Path("v"), "classic": True, "against": "fsr"},
        CASE | {"path_traced": True, "against": "fast", "state": Path("s.npz")},
        {
            "view": Path("v"),
            "camera_path": Path("p"),
            "out": (Path("frames"), Path("f.mp4")),
        },
    ],
)
def test_what_goes_together_passes(given: dict[str, Any]) -> None:
    check(options(**given))


def test_files_that_cannot_be_written_are_told_before_anything_slow(
    tmp_path: Path,
) -> None:
    good, bad = tmp_path / "new" / "a.png", tmp_path / "file" / "a.png"
    (tmp_path / "file").write_text("x", "utf-8")
    film = {"until": 2.0, "out": (tmp_path / "frames",)}
    require_places(options(**CASE, out=(good,), state=tmp_path / "s.npz"))
    require_places(options(**CASE, **film))
    for wrong in (
        {"out": (good, bad)},
        {"out": (good,), "save_view": bad},
        {"out": (good,), "confidence": bad},
        {"out": (good,), "state": bad},
        {"until": 2.0, "out": (tmp_path / "file",)},
    ):
        with pytest.raises(NotADirectoryError, match="file"):
            require_places(options(**CASE | wrong))
    assert [p.name for p in tmp_path.iterdir()] == ["file"]
