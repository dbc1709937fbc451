"""The slices inside a DICOM file: one, or many in an enhanced file.

The functional groups of an enhanced file place its frames: those of one frame, or those
that all frames share. In other files the main header does.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from renderers.scene.volume import AIR_HU
from system import UserError, simple_itk

if TYPE_CHECKING:
    from pydicom import Dataset
    from pydicom.uid import UID

GROUPS = {
    "ImagePositionPatient": "PlanePositionSequence",
    "ImageOrientationPatient": "PlaneOrientationSequence",
    "PixelSpacing": "PixelMeasuresSequence",
    "SliceThickness": "PixelMeasuresSequence",
    "RescaleSlope": "PixelValueTransformationSequence",
    "RescaleIntercept": "PixelValueTransformationSequence",
    "StackID": "FrameContentSequence",
    "TemporalPositionIndex": "FrameContentSequence",
}
"""Which functional group holds what."""

SLICE_CLASSES = tuple(
    f"1.2.840.10008.5.1.4.1.1.{ending}"
    for ending in ("2", "2.1", "2.2", "4", "4.1", "4.4")
)
"""CT and MR, of one slice, enhanced, and converted into enhanced ones."""

MANY_FRAMES = (
    "holds many frames in one file and does not say where each lies; export it as one "
    "file a slice"
)


COPIED = (
    "Rows",
    "Columns",
    "BitsAllocated",
    "BitsStored",
    "HighBit",
    "PixelRepresentation",
    "SamplesPerPixel",
    "PhotometricInterpretation",
)
"""What a decoder needs to know of a picture."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One slice's header. image: pydicom's dataset of the whole file.

    number: of the frame in its file, from 0. groups: the functional groups that tell
    of it, its own first; none in a file of one slice.
    """

    file: Path
    image: "Dataset"
    number: int
    groups: tuple["Dataset", ...]

    def get(self, name: str) -> Any:
        """Return a field's value; None where the file does not tell it."""
        for group in self.groups if name in GROUPS else ():
            items = group.get(GROUPS[name])
            if items and name in items[0]:
                return items[0].get(name)
        return self.image.get(name)

    def numbers(self, name: str, count: int) -> NDArray[np.float64]:
        """Read a list of numbers; UserError names the file that lacks it."""
        value = self.get(name)
        if value is None or value == "":
            raise UserError(f"{self.file} has no {name}, which places it")
        try:
            numbers = np.array([_number(part) for part in value], dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise UserError(f"{self.file} has an unusable {name}: {value}") from error
        if numbers.shape != (count,) or not np.isfinite(numbers).all():
            raise UserError(f"{self.file} has an unusable {name}: {value}")
        return numbers

    def number_of(self, name: str, default: float) -> float:
        """Read one number that a file need not hold."""
        value = self.get(name)
        try:
            number = default if value in (None, "") else _number(value)
        except (TypeError, ValueError) as error:
            raise UserError(f"{self.file} has an unusable {name}: {value}") from error
        if not np.isfinite(number) and np.isfinite(default):
            raise UserError(f"{self.file} has an unusable {name}: {value}")
        return number

    @property
    def thickness_mm(self) -> float:
        """Return the slice's thickness, NaN where it is not known."""
        try:
            thickness = self.number_of("SliceThickness", float("nan"))
        except UserError:
            # nothing hangs on it
            thickness = float("nan")
        return thickness if thickness > 0 else float("nan")

    @property
    def stack(self) -> tuple[str, str]:
        """Return what tells the stacks and the phases of one enhanced series apart."""
        if not self.groups:
            return "", ""
        return str(self.get("StackID")), str(self.get("TemporalPositionIndex"))


def _number(told: Any) -> float:
    """Read a number; some programs write a comma where the standard has a point."""
    return float(told.strip().replace(",", ".") if isinstance(told, str) else told)


def frames_of(image: "Dataset", file: Path) -> list[Frame]:
    """List the slices of a file, none where it is no image with places in the patient.

    image: pydicom's dataset of the file, with or without its pixels.
    """
    own = image.get("PerFrameFunctionalGroupsSequence") or []
    shared = image.get("SharedFunctionalGroupsSequence") or []
    frames = [
        Frame(file, image, n, (group, *shared[:1])) for n, group in enumerate(own)
    ]
    frames = frames or [Frame(file, image, 0, ())]
    is_placed = all(f.get("ImageOrientationPatient") is not None for f in frames)
    return frames if is_placed and "Rows" in image else []


def check_whole(image: "Dataset", file: Path) -> None:
    """Refuse a file whose header ends before it says what it holds.

    Passed over as no image, it would leave a hole, or at an end not even that.
    """
    kind = kind_of(image)
    # older images do not say what they are, but hold rows
    if "Rows" not in image and (kind is None or str(kind) in SLICE_CLASSES):
        raise UserError(f"{file} is cut off: its header ends too early")


def kind_of(image: "Dataset") -> "UID | None":
    """Return what a file says it is, None where it does not."""
    own: UID | None = image.get("SOPClassUID")
    return own or image.file_meta.get("MediaStorageSOPClassUID")


def has_many_frames(image: "Dataset") -> bool:
    """Return whether a file holds more than one picture."""
    return int(image.get("NumberOfFrames") or 1) > 1


def frame_values(frames: list[Frame]) -> list[NDArray[np.float32]]:
    """Return slices of one file in real units, each ``(rows, columns)``.

    Raises UserError naming the file where its pixels are cut off, in colour, or
    cannot be decoded.
    """
    image, file = frames[0].image, frames[0].file
    if has_many_frames(image) and not frames[0].groups:
        raise UserError(f"{file} {MANY_FRAMES}")
    if int(image.get("SamplesPerPixel", 1)) != 1:
        raise UserError(f"{file} is a colour image, not a slice of numbers")
    if image.get("PhotometricInterpretation", "MONOCHROME2") != "MONOCHROME2":
        raise UserError(
            f"{file} is stored as {image.PhotometricInterpretation}; slices of numbers "
            "are MONOCHROME2"
        )
    stored = _stored(image, file)
    padding = image.get("PixelPaddingValue")
    values = []
    for frame in frames:
        if frame.number >= len(stored):
            raise UserError(
                f"{file} is cut off: its header lists slice {frame.number + 1}, "
                f"and it holds the pixels of {len(stored)}"
            )
        raw = stored[frame.number]
        slope = frame.number_of("RescaleSlope", 1.0)
        intercept = frame.number_of("RescaleIntercept", 0.0)
        # in floats: a stored -32768 less 1024 does not fit its own type
        real = raw.astype(np.float32) * np.float32(slope) + np.float32(intercept)
        if padding is not None and image.get("Modality") == "CT":
            # some write -2000 into words without a sign, or 63536 into signed ones
            words = 1 << int(image.BitsAllocated)
            real[raw.astype(np.int64) % words == int(padding) % words] = AIR_HU
        values.append(real)
    return values


def _stored(image: "Dataset", file: Path) -> NDArray[Any]:
    """Return the stored values of all frames, ``(n, rows, columns)``, not rescaled."""
    count = max(int(image.get("NumberOfFrames") or 1), 1)
    if image.file_meta.TransferSyntaxUID.is_compressed:
        from pydicom.encaps import generate_frames

        pieces = generate_frames(image.PixelData, number_of_frames=count)
        return np.stack([_decoded(piece, image, file) for piece in pieces])
    bits = int(image.BitsAllocated)
    need = int(image.Rows) * int(image.Columns) * count * bits // 8
    have = len(image.get("PixelData", b""))
    if have < need:
        raise UserError(
            f"{file} is cut off: {have:,} of {need:,} bytes of pixels are there"
        )
    pixels: NDArray[Any] = np.asarray(image.pixel_array)
    return pixels.reshape(count, int(image.Rows), int(image.Columns))


def _decoded(piece: bytes, image: "Dataset", file: Path) -> NDArray[Any]:
    """Decode one compressed frame with SimpleITK, which reads whole files."""
    import pydicom

    single = pydicom.Dataset()
    for name in COPIED:
        if name in image:
            setattr(single, name, image.get(name))
    # of no class whose reader would rescale the values
    single.SOPClassUID = pydicom.uid.SecondaryCaptureImageStorage
    single.SOPInstanceUID = pydicom.uid.generate_uid()
    single.PixelData = pydicom.encaps.encapsulate([piece])
    single["PixelData"].VR = "OB"
    single.file_meta = pydicom.dataset.FileMetaDataset()
    single.file_meta.TransferSyntaxUID = image.file_meta.TransferSyntaxUID
    sitk = simple_itk()
    with tempfile.TemporaryDirectory() as folder:
        name = f"{folder}/frame.dcm"
        single.save_as(name, enforce_file_format=True)
        reader = sitk.ImageFileReader()
        reader.SetFileName(name)
        reader.SetImageIO("GDCMImageIO")
        try:
            decoded = sitk.GetArrayFromImage(reader.Execute())
        except RuntimeError as error:
            raise UserError(f"{file} holds pixels that cannot be decoded") from error
    shape = (1, int(image.Rows), int(image.Columns))
    if decoded.shape != shape:
        raise UserError(
            f"{file} holds a picture of {decoded.shape} pixels, not of {shape}"
        )
    slices: NDArray[Any] = decoded[0]
    return slices
