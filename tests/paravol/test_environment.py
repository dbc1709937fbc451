"""The kernel cache: fresh after any change, private, and never in the way."""

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from paravol.environment import kernel_hash, prepare_environment


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    for name in ("renderers/art", "renderers/fsr", "anatomy"):
        folder = tmp_path / name / "kernels"
        folder.mkdir(parents=True)
        (folder / "sweep.py").write_text(f"# {name}\n")
    return tmp_path


@pytest.fixture
def unset(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """Stand in an environment where nobody has chosen a cache; give the user's."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", "")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path


def test_any_change_of_any_kernel_changes_the_hash(tree: Path) -> None:
    seen = {kernel_hash(tree, "1.0"), kernel_hash(tree, "1.1")}
    for name in ("renderers/art", "renderers/fsr", "anatomy"):
        (tree / name / "kernels" / "sweep.py").write_text(f"# {name} changed\n")
        seen.add(kernel_hash(tree, "1.0"))
    kernels = tree / "anatomy" / "kernels"
    (kernels / "sweep.py").rename(kernels / "march.py")
    seen.add(kernel_hash(tree, "1.0"))
    assert len(seen) == 6


def test_what_kernels_import_counts_as_well(tree: Path) -> None:
    kernels = tree / "anatomy" / "kernels" / "sweep.py"
    kernels.write_text("from renderers.shape import SIZE\nimport numpy as np\n")
    (tree / "renderers" / "shape.py").write_text("from anatomy.deep import SIZE\n")
    (tree / "anatomy" / "deep.py").write_text("SIZE = 64\n")
    before = kernel_hash(tree, "1.0")
    (tree / "anatomy" / "deep.py").write_text("SIZE = 65\n")
    assert kernel_hash(tree, "1.0") != before


def test_packages_that_kernels_import_count_with_all_they_import(tree: Path) -> None:
    package = tree / "renderers" / "simd"
    package.mkdir()
    kernels = tree / "anatomy" / "kernels" / "sweep.py"
    kernels.write_text("from renderers.simd import (\n    load,\n)\n")
    (package / "__init__.py").write_text("from renderers.simd.load_store import load\n")
    (package / "load_store.py").write_text("import renderers.simd.vector\n")
    seen = {kernel_hash(tree, "1.0")}
    for text in ("", "import llvmlite\n"):
        (package / "vector.py").write_text(text)
        seen.add(kernel_hash(tree, "1.0"))
    assert len(seen) == 3


def test_nothing_else_changes_the_hash(tree: Path) -> None:
    before = kernel_hash(tree, "1.0")
    (tree / "anatomy" / "phantom.py").write_text("# not compiled\n")
    (tree / "tests" / "kernels").mkdir(parents=True)
    (tree / "tests" / "kernels" / "sweep.py").write_text("# not ours\n")
    os.utime(tree / "anatomy" / "kernels" / "sweep.py", (0, 0))
    assert kernel_hash(tree, "1.0") == before


def test_the_cache_is_the_users_own_and_named_by_the_hash(unset: Path) -> None:
    first = prepare_environment()
    assert first.is_relative_to(unset)
    assert first.is_dir()
    assert os.environ["NUMBA_CACHE_DIR"] == str(first)
    assert stat.S_IMODE(first.stat().st_mode) & 0o077 == 0
    os.environ["NUMBA_CACHE_DIR"] = ""
    assert prepare_environment() == first


def test_a_cache_the_user_has_chosen_is_kept(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    chosen = tmp_path / "chosen"
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(chosen))
    assert prepare_environment() == chosen
    assert not chosen.exists()


def test_an_unusable_cache_is_replaced_for_the_life_of_the_process(
    tmp_path: Path,
) -> None:
    """A file where the folder should be stops root as well, unlike permissions."""
    blocked = tmp_path / "cache"
    blocked.write_text("")
    code = (
        "import os; from paravol.environment import prepare_environment as p;"
        "f = p(); assert f.is_dir() and os.environ['NUMBA_CACHE_DIR'] == str(f);"
        "(f / 'x').write_text('x'); print(f)"
    )
    environment = os.environ | {"XDG_CACHE_HOME": str(blocked), "NUMBA_CACHE_DIR": ""}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=environment,
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=True,
    )
    folder = Path(done.stdout.strip())
    assert folder.name.startswith("paravol-kernels-")
    assert not folder.exists()


def test_preparing_loads_nothing_heavy() -> None:
    code = (
        "import sys; from paravol.environment import prepare_environment as p; p();"
        "heavy = {'numba', 'numpy', 'scipy', 'vtkmodules'} & set(sys.modules);"
        "assert not heavy, heavy"
    )
    subprocess.run(
        [sys.executable, "-c", code], cwd=Path(__file__).parents[2], check=True
    )
