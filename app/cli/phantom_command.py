"""`paravol phantom`: a virtual patient as a case folder."""

from dataclasses import fields
from typing import TYPE_CHECKING, Annotated

import msgspec

from app.cli.root import FLATTENED, Json, Seed
from app.cli.terminal import ProgressReporter, print_json
from paravol.cases.case_options import PhantomOptions
from system import UserError

if TYPE_CHECKING:
    from anatomy.case import DiseaseRecord


def phantom(
    *,
    options: Annotated[PhantomOptions, FLATTENED],
    seed: Seed = 1,
    json: Json = False,
) -> int:
    """Write a virtual patient as a case folder that 3D Slicer opens.

    Parameters
    ----------
    seed
        Draws a patient: sizes, septum, skull base, cells and variants.
    """
    from anatomy import PhantomParameters, draw_parameters, sinus_phantom, with_variants
    from anatomy.case import DiseaseRecord, write_case
    from anatomy.phantom.variants import (
        told_findings,
        variant_names,
        with_findings,
        without_variants,
    )
    from paravol.output_folder import claimed_case, remove_exercise

    if options.scene:
        return _run_scene(seed, options, as_json=json)
    out = options.out
    patient = PhantomParameters(seed=seed) if options.average else draw_parameters(seed)
    patient = without_variants(with_variants(patient, options.variant), options.without)
    words = [*options.lund_mackay, *options.disease]
    if options.congestion is not None:
        words.append(f"congestion={options.congestion:g}")
    if options.posture is not None:
        words.append(f"posture={options.posture}")
    patient = with_findings(patient, words)
    patient = msgspec.structs.replace(patient, ct_noise_hu=options.noise)
    with ProgressReporter() as stages, claimed_case(out, force=options.force):
        phantom = sinus_phantom(
            patient,
            spacing_mm=options.spacing,
            progress=lambda stage, share: stages(f"Head: {stage}", share),
        )
        stages("Judging the sinuses", 0.0)
        disease = DiseaseRecord.of(phantom)
        stages("Writing the case", 0.0)
        write_case(phantom, out, resonance=options.mr, disease=disease)
        remove_exercise(out)
        stages("Writing the case", 1.0)
    has = [*variant_names(patient), *told_findings(patient)]
    _tell(options, phantom.ct.shape, has, disease, as_json=json)
    return 0


def _run_scene(seed: int, options: PhantomOptions, *, as_json: bool) -> int:
    from anatomy.abstract import build_scene
    from anatomy.case import write_space
    from paravol.output_folder import claimed_case, remove_exercise

    default = PhantomOptions(out=options.out)
    for field in fields(options):
        name = field.name
        is_changed = getattr(options, name) != getattr(default, name)
        if is_changed and name not in ("scene", "spacing", "force"):
            raise UserError(
                f"A scene has no --{name.replace('_', '-')}; leave it out, or "
                "leave out --scene for a virtual patient."
            )
    space = build_scene(options.scene, seed, options.spacing)
    with claimed_case(options.out, force=options.force):
        write_space(space, options.out)
        remove_exercise(options.out)
    _tell(options, space.ct.shape, sorted(space.landmarks), None, as_json=as_json)
    return 0


def _tell(
    options: PhantomOptions,
    shape: tuple[int, ...],
    has: list[str],
    disease: "DiseaseRecord | None",
    *,
    as_json: bool,
) -> None:
    """Print what was written; has: variants of a patient, landmarks of a scene.

    disease: of a patient; None for a scene.
    """
    out = options.out
    nz, ny, nx = shape
    files = sorted(file.name for file in out.iterdir() if file.is_file())
    if as_json:
        what = "landmarks" if options.scene else "variants"
        told = {"folder": str(out), "files": files, "shape": [nz, ny, nx], what: has}
        if disease is not None:
            told["disease"] = msgspec.to_builtins(disease)
        print_json(told)
    else:
        print(f"{out}: {nx} x {ny} x {nz} voxels of {options.spacing:g} mm")
        print("  " + ", ".join(files))
        print("  " + ", ".join(has))
        for line in disease.sentences() if disease is not None else ():
            print("  " + line)
