"""The environment variables that must be set before numpy and numba are imported.

numba decides by the time stamp of a single source file whether its compiled copy on
disk is current. It does not see a change in a function or constant that the file
imports, and it would write its copies beside the sources. Here all compiled code goes
to a folder of the user's cache named after the contents of every kernel file and of
what these import, so that any change compiles afresh and none is missed.
"""

import hashlib
import os
import re
from pathlib import Path

_PACKAGES = ("anatomy", "benchmarks", "devices", "renderers", "scenarios", "surgery")
_IMPORT = re.compile(
    rf"^(?:from|import) +((?:{'|'.join(_PACKAGES)})(?:\.\w+)+)", re.MULTILINE
)


def prepare_environment() -> Path:
    """Point numba at a cache for exactly these kernels; give that folder.

    Call it before anything imports numpy or numba. A NUMBA_CACHE_DIR that the user has
    set is respected. Where the user's cache cannot be written, a temporary folder
    serves this process and its children, and is removed at exit.
    """
    # Threads come from our own pool, over kernels that release the interpreter's
    # lock; those of numba and of numpy's matrices would only compete with it.
    for name in ("NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if not chosen:
        # Imported here: `paravol --help` needs neither.
        from importlib.metadata import version

        from platformdirs import user_cache_path

        key = kernel_hash(Path(__file__).parents[1], version("numba"))
        wanted = user_cache_path("paravol", appauthor=False) / "kernels" / key
        chosen = str(_writable_folder(wanted))
        os.environ["NUMBA_CACHE_DIR"] = chosen
    return Path(chosen)


def kernel_hash(root: Path, numba_version: str) -> str:
    """Hash the paths and contents of all kernel files below the packages of `root`.

    Kernel files are all modules of packages called `kernels`, and the modules and
    packages these import from us, since compiled code has their constants and
    instructions built in. Sixteen hexadecimal digits.
    """
    # Plain strings: this runs at every start, and Path objects cost it 10 ms.
    waiting = [
        os.path.join(folder, file)
        for package in _PACKAGES
        for folder, _, files in os.walk(root / package)
        if os.path.basename(folder) == "kernels"
        for file in files
        if file.endswith(".py")
    ]
    sources: dict[str, str] = {}
    while waiting:
        path = waiting.pop()
        name = os.path.relpath(path, root)
        if name not in sources and os.path.isfile(path):
            with open(path, encoding="utf-8") as file:
                text = sources[name] = file.read()
            for module in _IMPORT.findall(text):
                place = os.path.join(root, *module.split("."))
                waiting += [f"{place}.py", os.path.join(place, "__init__.py")]
    digest = hashlib.sha256(numba_version.encode())
    for name in sorted(sources):
        digest.update(f"\0{name}\0{sources[name]}".encode())
    return digest.hexdigest()[:16]


def _writable_folder(wanted: Path) -> Path:
    try:
        # Closed to others: numba executes what it finds in its cache.
        wanted.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError:
        pass
    else:
        if os.access(wanted, os.W_OK | os.X_OK):
            return wanted
    import atexit
    import shutil
    import tempfile

    folder = Path(tempfile.mkdtemp(prefix="paravol-kernels-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder
