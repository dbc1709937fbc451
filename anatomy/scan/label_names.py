"""What segmentation programs call the structures of a head, and which are hazards.

Sources: TotalSegmentator's tasks `head_glands_cavities`, `craniofacial_structures`,
`headneck_bones_vessels`, `oculomotor_muscles` and `total` (its class maps);
AutoSeg4SinonasalCT, whose labels carry a side, as in ``L-MS``; NasalSeg (five air
spaces, Zhang and others 2024); and the names that people give to segments in 3D Slicer.
"""

import re

HAZARDS = {
    "orbit": ("orbit", "orbital content", "orbital contents", "periorbita", "orbits"),
    "eye": ("eye", "eyeball", "globe", "bulbus oculi"),
    "optic nerve": (
        "optic nerve",
        "on",
        "nervus opticus",
        "optic canal",
        "cn ii",
        "cranial nerve ii",
    ),
    "internal carotid": (
        "internal carotid artery",
        "internal carotid",
        "ica",
        "carotid artery",
        "carotid",
    ),
    "skull base": (
        "skull base",
        "anterior skull base",
        "anterior cranial fossa",
        "dura",
        "intracranial space",
        "cranial cavity",
    ),
    "brain": ("brain",),
    "ethmoidal arteries": (
        "anterior ethmoidal artery",
        "anterior ethmoid artery",
        "ethmoidal arteries",
        "ethmoidal artery",
        "aea",
    ),
    "nasolacrimal duct": ("nasolacrimal duct", "lacrimal duct", "nld"),
    "sphenopalatine artery": ("sphenopalatine artery", "spa"),
    "vidian nerve": ("vidian nerve", "vidian canal", "pterygoid canal"),
    "maxillary nerve": (
        "maxillary nerve",
        "infraorbital nerve",
        "infraorbital canal",
        "foramen rotundum",
        "cn v2",
        "cranial nerve v2",
    ),
    "septum": ("septum", "nasal septum", "ns"),
}
"""Names of labels by the hazard that they are; sides are taken off beforehand."""

NO_HAZARDS = frozenset(
    """
    background; nasal cavity; nasal pharynx; nasopharynx; oropharynx; hypopharynx;
    maxillary sinus; ms; sinus maxillary; sinus frontal; frontal sinus; sphenoid sinus;
    ethmoid sinus; ethmoid; inferior turbinate; it; middle turbinate; mt;
    superior turbinate; skull; mandible; maxilla; head; teeth lower; teeth upper;
    eye lens; parotid gland; submandibular gland; auditory canal; soft palate;
    hard palate; larynx air; thyroid cartilage; hyoid; cricoid cartilage;
    zygomatic arch; styloid process; internal jugular vein; airway; air; face; skin;
    levator palpebrae superioris; superior rectus; inferior rectus; lateral rectus;
    medial rectus; superior oblique; inferior oblique; lower jawbone; upper jawbone;
    inferior alveolar canal; pharynx; bridge; crown; implant; tooth; teeth; incisor;
    canine; premolar; molar; other structure; common carotid artery; trachea;
    vertebrae; spinal cord; sphenoid; frontal; maxilla bone; zygoma; tongue; masseter;
    temporalis; lateral pterygoid; medial pterygoid; digastric
    """.replace("\n", " ").split("; ")
)
"""Known names of what need not be kept clear of."""

_KNOWN = {name: hazard for hazard, names in HAZARDS.items() for name in names}
_KNOWN |= {" ".join(name.split()): "" for name in NO_HAZARDS}

_KNOWN |= {
    " ".join(part.removesuffix("s") for part in name.split()): hazard
    for name, hazard in _KNOWN.items()
}

_IDLE = frozenset(("muscle", "muscles", "the", "of"))

_LAST = frozenset(("incisor", "canine", "premolar", "molar", "tooth"))
"""Words that say what a structure is, whatever goes before them."""

_SIDES = frozenset(("left", "right", "l", "r", "lt", "rt", "both", "bilateral"))

TASKS: dict[str, tuple[str, ...]] = {
    # of the whole body, values that are of a head; the rest is none
    "total": tuple(
        {
            57: "common_carotid_artery_right",
            58: "common_carotid_artery_left",
            90: "brain",
            91: "skull",
        }.get(value, "other structure")
        for value in range(1, 118)
    ),
    "oculomotor_muscles": (
        "skull",
        "eyeball_right",
        "lateral_rectus_muscle_right",
        "superior_oblique_muscle_right",
        "levator_palpebrae_superioris_right",
        "superior_rectus_muscle_right",
        "medial_rectus_muscle_left",
        "inferior_oblique_muscle_right",
        "inferior_rectus_muscle_right",
        "optic_nerve_left",
        "eyeball_left",
        "lateral_rectus_muscle_left",
        "superior_oblique_muscle_left",
        "levator_palpebrae_superioris_left",
        "superior_rectus_muscle_left",
        "medial_rectus_muscle_right",
        "inferior_oblique_muscle_left",
        "inferior_rectus_muscle_left",
        "optic_nerve_right",
    ),
    "head_glands_cavities": (
        "eye_left",
        "eye_right",
        "eye_lens_left",
        "eye_lens_right",
        "optic_nerve_left",
        "optic_nerve_right",
        "parotid_gland_left",
        "parotid_gland_right",
        "submandibular_gland_right",
        "submandibular_gland_left",
        "nasopharynx",
        "oropharynx",
        "hypopharynx",
        "nasal_cavity_right",
        "nasal_cavity_left",
        "auditory_canal_right",
        "auditory_canal_left",
        "soft_palate",
        "hard_palate",
    ),
    "craniofacial_structures": (
        "mandible",
        "teeth_lower",
        "skull",
        "head",
        "sinus_maxillary",
        "sinus_frontal",
        "teeth_upper",
    ),
    "headneck_bones_vessels": (
        "larynx_air",
        "thyroid_cartilage",
        "hyoid",
        "cricoid_cartilage",
        "zygomatic_arch_right",
        "zygomatic_arch_left",
        "styloid_process_right",
        "styloid_process_left",
        "internal_carotid_artery_right",
        "internal_carotid_artery_left",
        "internal_jugular_vein_right",
        "internal_jugular_vein_left",
    ),
}
"""Names by label value, from 1, of tasks whose label maps may come without names."""


def hazard_of(name: str) -> str | None:
    """Return the hazard that a label of this name is.

    "" for a known structure that is none; None for an unknown name.
    """
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    parts = [p for p in re.split(r"[^a-z0-9]+", words.lower()) if p]
    own = [p for p in parts if p not in _SIDES]
    # pieces are counted, and several are one
    uncounted = [p for p in own if not p.isdecimal() and p not in _IDLE]
    single = [p.removesuffix("s") for p in uncounted]
    for found in (own, uncounted, single):
        hazard = _KNOWN.get(" ".join(found))
        if hazard is not None:
            return hazard
    # a name that says where in a structure it is
    return _KNOWN.get(uncounted[-1]) if uncounted and uncounted[-1] in _LAST else None
