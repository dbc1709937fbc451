"""Look for bytes that a reader of foreign files cannot take, guided by coverage.

``python -m tests.stress.fuzz --seconds 600`` tries every reader of `foreign_readers`
for ten minutes each; names choose some. Each runs in a process of its own, which ends
at an error that nobody is told in a sentence, at an input that takes longer than ten
seconds, and where 2 GiB of memory do not suffice. The input is then kept in ``--out``.

It needs atheris, which is no dependency: ``.venv/bin/uv pip install atheris``.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable
from contextlib import redirect_stdout
from importlib import import_module
from pathlib import Path

READERS_MODULE = "tests.stress.foreign_readers"
SLOWEST_S = 10
MOST_MEMORY_MIB = 2048
LONGEST = 1 << 18
"""Bytes of an input. What a file's header promises is asked of a few as well."""

_WATCHED = [
    "anatomy",
    "devices",
    "paravol",
    "renderers.snapshots",
    "scenarios",
    "system",
]
"""Packages whose branches guide the search."""

_COMPILED = [
    f"{name}.kernels" for name in ("anatomy", "devices", "paravol", "scenarios")
]


def main() -> int:
    """Fuzz the readers that are named, or all; return how many failed."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("names", nargs="*", help="readers; all without a name")
    parser.add_argument("--seconds", type=int, default=600, help="for each reader")
    parser.add_argument("--out", type=Path, default=Path("out/fuzz"))
    parser.add_argument("--readers", default=READERS_MODULE, help="module of readers")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    module, seconds, out = options.readers, options.seconds, options.out
    if options.child:
        return _search(module, options.names[0], seconds, out)
    found = import_module(module)
    known = sorted({*found.READERS, *found.STREAMS})
    names = options.names or known
    if strange := sorted(set(names) - set(known)):
        parser.error(f"no reader is called {strange[0]}; there are {', '.join(known)}")
    return sum(not try_reader(module, name, seconds, out) for name in names)


def try_reader(module: str, name: str, seconds: int, out: Path) -> bool:
    """Fuzz one reader in a process of its own, say what came of it."""
    folder = out / name
    folder.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "tests.stress.fuzz", "--child", name]
    command += ["--seconds", str(seconds), "--out", str(folder), "--readers", module]
    log = folder / "log.txt"
    with log.open("wb") as file:
        done = subprocess.run(command, stdout=file, stderr=subprocess.STDOUT)
    text = log.read_text(errors="replace").splitlines()
    runs = next((line for line in reversed(text) if "runs in" in line), "no runs told")
    is_sound = done.returncode == 0
    verdict = "sound" if is_sound else f"FAILED, see {log}"
    print(f"{name}: {verdict}; {runs}", flush=True)
    return is_sound


def _search(module: str, name: str, seconds: int, out: Path) -> int:
    """Let atheris search; it ends the process."""
    import atheris

    # each text of a warning is kept for good where warnings are shown
    warnings.simplefilter("ignore")
    from paravol.environment import prepare_environment

    prepare_environment()
    with atheris.instrument_imports(include=_WATCHED, exclude=_COMPILED):
        found = import_module(module)
        from tests.stress.foreign_readers import is_told

    scratch = Path(tempfile.mkdtemp(prefix="fuzz-", dir=_memory_disk()))
    file = scratch / name
    if name in found.STREAMS:
        whole, hear = found.STREAMS[name]
    else:
        read = found.READERS[name](file)
        whole = file.read_bytes()

        def hear(data: bytes) -> object:
            file.write_bytes(data)
            return read(file)

    def take(data: bytes) -> None:
        try:
            # what a library prints of each bad file would fill the log
            with open(os.devnull, "w") as nowhere, redirect_stdout(nowhere):
                hear(data)
        except Exception as error:
            if not is_told(error):
                raise

    corpus = out / "corpus"
    corpus.mkdir(exist_ok=True)
    (corpus / "sound").write_bytes(whole)
    words = [f"-max_total_time={seconds}", f"-timeout={SLOWEST_S}"]
    words += [f"-rss_limit_mb={MOST_MEMORY_MIB}", f"-max_len={LONGEST}"]
    words += [f"-artifact_prefix={out}/", "-print_final_stats=1", str(corpus)]
    taken: Callable[[bytes], None] = take
    atheris.Setup([sys.argv[0], *words], taken)
    atheris.Fuzz()
    return 0


def _memory_disk() -> str | None:
    """Return a folder that lies in memory, where there is one."""
    place = "/dev/shm"
    return place if os.access(place, os.W_OK) else None


if __name__ == "__main__":
    raise SystemExit(main())
