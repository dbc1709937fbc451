"""`paravol phantom`: a virtual patient as a case folder."""

from dataclasses import fields

import msgspec

from anatomy import (
    Opacity,
    PhantomParameters,
    draw_parameters,
    sinus_phantom,
    with_variants,
)
from anatomy.abstract import build_scene
from anatomy.case import write_case, write_space
from anatomy.phantom.variants import variant_names, without_variants
from app.cli.terminal import Stages, print_json
from disk import UserError
from paravol.case_options import PhantomOptions
from paravol.output_folder import claimed_case, remove_exercise


def run_phantom(seed: int, options: PhantomOptions, *, as_json: bool) -> int:
    """Build the phantom, or the scene, of a seed and write it.

    Raise UserError for a name, side or score that there is not.
    """
    if options.scene:
        return _run_scene(seed, options, as_json=as_json)
    out = options.out
    patient = PhantomParameters(seed=seed) if options.average else draw_parameters(seed)
    patient = without_variants(with_variants(patient, options.variant), options.without)
    patient = msgspec.structs.replace(
        patient, opacity=parse_scores(options.lund_mackay), ct_noise_hu=options.noise
    )
    with Stages() as stages, claimed_case(out, force=options.force):
        phantom = sinus_phantom(
            patient,
            spacing_mm=options.spacing,
            progress=lambda stage, share: stages(f"Head: {stage}", share),
        )
        stages("Writing the case", 0.0)
        remove_exercise(out)
        write_case(phantom, out, resonance=options.mr)
        stages("Writing the case", 1.0)
    _tell(options, phantom.ct.shape, list(variant_names(patient)), as_json=as_json)
    return 0


def _run_scene(seed: int, options: PhantomOptions, *, as_json: bool) -> int:
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
        remove_exercise(options.out)
        write_space(space, options.out)
    _tell(options, space.ct.shape, sorted(space.landmarks), as_json=as_json)
    return 0


def _tell(
    options: PhantomOptions,
    shape: tuple[int, ...],
    has: list[str],
    *,
    as_json: bool,
) -> None:
    """Print what was written; has: variants of a patient, landmarks of a scene."""
    out = options.out
    nz, ny, nx = shape
    files = sorted(file.name for file in out.iterdir() if file.is_file())
    if as_json:
        what = "landmarks" if options.scene else "variants"
        print_json(
            {"folder": str(out), "files": files, "shape": [nz, ny, nx], what: has}
        )
    else:
        print(f"{out}: {nx} x {ny} x {nz} voxels of {options.spacing:g} mm")
        print("  " + ", ".join(files))
        print("  " + ", ".join(has))


def parse_scores(texts: tuple[str, ...]) -> tuple[Opacity, Opacity]:
    """Read scores of the right and the left side.

    Each text is ``NAME=SCORE`` or ``NAME:SIDE=SCORE``, or several with commas between;
    names are those of `anatomy.Opacity`, and without a side both sides are meant.
    """
    right: dict[str, int] = {}
    left: dict[str, int] = {}
    for word in (part for text in texts for part in text.split(",") if part):
        target, equals, score = word.strip().partition("=")
        name, colon, side = target.replace("-", "_").partition(":")
        if name not in Opacity.__struct_fields__ or not equals:
            raise UserError(
                f"a Lund-Mackay score reads NAME:SIDE=SCORE, such as maxillary:left=2,"
                f" with a name out of {', '.join(Opacity.__struct_fields__)}; got "
                f"{word!r}"
            )
        if not score.isdecimal():
            raise UserError(f"the score in {word!r} must be a whole number")
        if colon and side not in ("left", "right"):
            raise UserError(f"the side in {word!r} must be left or right")
        for held, held_name in ((right, "right"), (left, "left")):
            if not colon or side == held_name:
                held[name] = int(score)
    return Opacity(**right), Opacity(**left)
