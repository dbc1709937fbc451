"""`paravol phantom`: a virtual patient as a case folder."""

from pathlib import Path

from anatomy import PhantomParameters, sinus_phantom
from anatomy.case import write_case
from app.terminal import Stages, print_json


def run_phantom(*, out: Path, seed: int, spacing_mm: float, as_json: bool) -> int:
    """Build the phantom of `seed` and write it."""
    with Stages() as stages:
        phantom = sinus_phantom(
            PhantomParameters(seed=seed),
            spacing_mm=spacing_mm,
            progress=lambda stage, share: stages(f"Head: {stage}", share),
        )
        stages("Writing the case", 0.0)
        write_case(phantom, out)
        stages("Writing the case", 1.0)
    nz, ny, nx = phantom.ct.shape
    files = sorted(file.name for file in out.iterdir() if file.is_file())
    if as_json:
        print_json({"folder": str(out), "files": files, "shape": [nz, ny, nx]})
    else:
        print(f"{out}: {nx} x {ny} x {nz} voxels of {spacing_mm:g} mm")
        print("  " + ", ".join(files))
    return 0
