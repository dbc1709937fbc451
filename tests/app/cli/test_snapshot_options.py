"""What cannot be asked for together is refused before anything slow begins."""

from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from app.cli.snapshot_options import SnapshotOptions, check, demand_places

DEFAULTS: dict[str, Any] = {
    "time_s": 0.0,
    "fps": 25.0,
    "up": (0.0, 0.0, 1.0),
    "lens": "equidistant",
    "half_side_mm": 40.0,
    "classic": False,
    "out": (),
    "samples": 4,
    "quality": "snapshot",
    "truth": False,
    "paths": 256,
    "noise": 0.0,
    "distortion": (0.0, 0.0),
    "ranks": 1,
    "threads": 1,
}
CASE = {"case": Path("c")}
PLACED: dict[str, Any] = CASE | {"eye": (0, 0, 0), "target": (0, 1, 0)}


FRAMES_AND_FILM = (Path("frames"), Path("a.mp4"))


def options(**given: Any) -> SnapshotOptions:
    return SnapshotOptions(
        **({f.name: None for f in fields(SnapshotOptions)} | DEFAULTS | given)
    )


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        ({}, "either a session folder or"),
        ({"view": Path("v"), "volume": Path("s")}, "one of them alone"),
        ({"view": Path("v"), "session": Path("s")}, "one of them alone"),
        ({"view": Path("v"), "eye": (0, 0, 0), "target": (0, 1, 0)}, "their own view"),
        (PLACED | {"lens": "perspective"}, "needs --classic"),
        (CASE | {"out": (Path("a.jpg"),)}, r"\.png, \.exr, \.nrrd; got a\.jpg"),
        (CASE | {"until_s": 2.0, "out": (Path("a.png"),)}, r"in a row go to \.mp4"),
        (CASE | {"distortion": (-0.1, 0.0)}, "--distortion belongs to --eye"),
        (CASE | {"tolerance": 1.0, "truth": True}, "--tolerance spares samples"),
        (CASE | {"tolerance": 1.0, "samples": 1}, "--tolerance spares samples"),
        (CASE | {"tolerance": -1.0}, "--tolerance"),
        (CASE | {"until_s": 0.0}, "--until must be later than --time"),
        (PLACED | {"until_s": 2.0}, "is moved by --path"),
        (CASE | {"until_s": 2.0, "against": "fsr"}, "--against is for a single"),
        (CASE | {"until_s": 2.0, "path": Path("p")}, "either --path or --until"),
        (CASE | {"until_s": 2.0, "size": 255}, "even --size, got 255"),
        (CASE | {"truth": True, "classic": True}, "not --classic's"),
        (CASE | {"classification": "post"}, "it needs --classic"),
        (CASE | {"state": Path("s.npz")}, "belong to --truth"),
        (CASE | {"against": "fast"}, "belong to --truth"),
        (CASE | {"truth": True, "state": Path("s.bin")}, r"goes to a \.npz file"),
        (CASE | {"confidence": Path("c.jpg")}, r"--confidence goes to a \.png"),
        (CASE | {"stereo_mm": 3.0, "against": "fsr"}, "--stereo goes without"),
        (CASE | {"until_s": 2.0, "size": 31, "out": FRAMES_AND_FILM}, "even --size"),
        (CASE | {"time_s": -1.0}, "--time must be 0 s or later, got -1"),
        (CASE | {"time_s": float("nan")}, "--time must be 0 s or later, got nan"),
        ({"view": Path("v"), "time_s": 2.0}, "--time belongs to a session"),
        (PLACED | {"time_s": 2.0}, "--time belongs to a session"),
        (CASE | {"fps": 30.0}, "--fps belongs to --until and --path"),
        (CASE | {"up": (1.0, 0.0, 0.0)}, "--up belongs to --eye and --target"),
        (CASE | {"half_side_mm": 20.0}, "--half-side belongs to --lens orthographic"),
        (CASE | {"paths": 512}, "--paths belongs to --truth"),
        (CASE | {"noise": 0.1}, "--noise belongs to --truth"),
        (CASE | {"size": 4}, "--size must be 8 to 8192, got 4"),
        (CASE | {"time_limit_s": 0.0}, "--time-limit must be 0.01 to 86400, got 0"),
        (CASE | {"fps": 0.0}, "--fps must be 0.1 to 240, got 0"),
        (CASE | {"truth": True, "paths": 3}, "--paths must be 32 to 1048576, got 3"),
        (CASE | {"truth": True, "noise": 2.0}, "--noise must be 0 to 1, got 2"),
        (CASE | {"ranks": 0}, "--ranks must be 1 to 1024, got 0"),
    ],
)
def test_mixtures_are_refused(given: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        check(options(**given))


@pytest.mark.parametrize(
    "given",
    [
        CASE,
        {"session": Path("s"), "case": Path("c")},
        {"view": Path("v"), "case": Path("c")},
        {"view": Path("v"), "size": 64},
        CASE | {"time_s": 2.0, "path": Path("p"), "fps": 30.0},
        {"session": Path("s"), "until_s": 2.0},
        PLACED | {"classic": True, "lens": "orthographic", "path": Path("p")},
        CASE | {"classic": True, "classification": "post"},
        {"session": Path("s"), "classic": True, "classification": "post"},
        {"view": Path("v"), "classic": True, "against": "fsr"},
        CASE | {"truth": True, "against": "fast", "state": Path("s.npz")},
        {"view": Path("v"), "path": Path("p"), "out": (Path("frames"), Path("f.mp4"))},
    ],
)
def test_what_goes_together_passes(given: dict[str, Any]) -> None:
    check(options(**given))


def test_files_that_cannot_be_written_are_told_before_anything_slow(
    tmp_path: Path,
) -> None:
    good, bad = tmp_path / "new" / "a.png", tmp_path / "file" / "a.png"
    (tmp_path / "file").write_text("x", "utf-8")
    film = {"until_s": 2.0, "out": (tmp_path / "frames",)}
    demand_places(options(**CASE, out=(good,), state=tmp_path / "s.npz"))
    demand_places(options(**CASE, **film))
    for wrong in (
        {"out": (good, bad)},
        {"out": (good,), "save_view": bad},
        {"out": (good,), "confidence": bad},
        {"out": (good,), "state": bad},
        {"until_s": 2.0, "out": (tmp_path / "file",)},
    ):
        with pytest.raises(NotADirectoryError, match="file"):
            demand_places(options(**CASE | wrong))
    assert [p.name for p in tmp_path.iterdir()] == ["file"]
