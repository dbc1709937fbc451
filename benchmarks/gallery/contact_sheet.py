"""A family's pictures on one sheet: a row for each view, figures below each picture."""

from collections.abc import Mapping, Sequence

from PIL import Image, ImageDraw, ImageFont

from benchmarks.gallery.panel import Absent, Family, Panel
from benchmarks.reporting.section import duration

Font = ImageFont.FreeTypeFont | ImageFont.ImageFont

Rows = Mapping[str, Sequence[Panel | Absent]]
"""The panels of each view, by its name, in the order of the columns."""

HEAD_PX, LINE_PX, NAME_PX = 34, 14, 84
GAP_PX = 4
COLOURS = 256
"""A sheet has a palette: a third of the bytes, and half a code of error or so."""
INK, DIM, GROUND = (225, 225, 225), (240, 160, 110), (16, 16, 16)


def contact_sheet(family: Family, rows: Rows, side: int) -> Image.Image:
    """Lay the panels out, each `side` pixels wide.

    A picture that is not right has a frame and no time; where there is none is a word.
    """
    wide, high = side + GAP_PX, side + 2 * LINE_PX + GAP_PX
    size = NAME_PX + len(family.columns) * wide, HEAD_PX + len(rows) * high
    sheet = Image.new("RGB", size, GROUND)
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(size=10)
    for number, who in enumerate(family.columns):
        at = NAME_PX + number * wide, 3
        draw.multiline_text(at, broken(draw, font, who, side), INK, font, spacing=1)
    for line, (name, panels) in enumerate(rows.items()):
        top = HEAD_PX + line * high
        draw.multiline_text((4, top), broken(draw, font, name, NAME_PX - 8), INK, font)
        for number, panel in enumerate(panels):
            left = NAME_PX + number * wide
            if isinstance(panel, Absent):
                draw.text((left + 4, top + side // 2), "absent", DIM, font)
                continue
            picture = Image.fromarray(panel.pixels)
            if picture.width != side:
                picture = picture.resize((side, side), Image.Resampling.BOX)
            sheet.paste(picture, (left, top))
            colour = DIM if panel.why else INK
            if panel.why:
                corner = left + side - 1, top + side - 1
                draw.rectangle((left, top, *corner), outline=DIM)
            figures = f"{spent(panel.cpu_s)}\n{panel.error:.2g}, SSIM {panel.alike:.3f}"
            draw.multiline_text((left, top + side), figures, colour, font, spacing=1)
    return sheet.quantize(COLOURS, dither=Image.Dither.NONE)


def spent(cpu_s: float | None) -> str:
    """Write CPU time with its unit; a picture that is not right has none."""
    return "not right" if cpu_s is None else duration(cpu_s)


def broken(draw: ImageDraw.ImageDraw, font: Font, text: str, width: int) -> str:
    """Break a text between words where it would be wider than so many pixels."""
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and draw.textlength(longer, font) > width:
            lines.append(word)
        else:
            lines[-1] = longer
    return "\n".join(lines)
