"""Scalable pictures in a page, written element by element; all text is escaped."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from markupsafe import Markup, escape


def element(tag: str, inside: object = "", /, **attributes: object) -> Markup:
    """Return one element. ``_`` in a name of an attribute stands for ``-``.

    inside: escaped, unless it is Markup.
    """
    told = Markup("").join(
        Markup(' {}="{}"').format(name.strip("_").replace("_", "-"), _text(value))
        for name, value in attributes.items()
        if value is not None
    )
    if isinstance(inside, str) and not inside:
        return Markup("<{}{}/>").format(Markup(tag), told)
    return Markup("<{}{}>{}</{}>").format(
        Markup(tag), told, escape(inside), Markup(tag)
    )


def _text(value: object) -> str:
    return (
        f"{value:.2f}".rstrip("0").rstrip(".")
        if isinstance(value, float)
        else str(value)
    )


def path_data(points: Iterable[Sequence[float]]) -> str:
    """Return a path through points ``(x, y)``."""
    return "M" + "L".join(f"{x:.1f},{y:.1f}" for x, y in points)


@dataclass(slots=True)
class Figure:
    """Gather a picture's elements; it scales with the page.

    title, text: what it shows, for those who do not see it. has_links: it can be
    clicked, so that it is no single image.
    """

    width: float
    height: float
    title: str
    text: str
    has_links: bool = False
    parts: list[Markup] = field(default_factory=list)

    def add(self, tag: str, inside: object = "", /, **attributes: object) -> None:
        """Add one element; see `element`."""
        self.parts.append(element(tag, inside, **attributes))

    def label(
        self, x: float, y: float, text: str, /, *, kind: str = "", anchor: str = "start"
    ) -> None:
        """Write a word. kind: class in the style sheet."""
        self.add("text", text, x=x, y=y, text_anchor=anchor, class_=kind or None)

    def markup(self) -> Markup:
        """Return the whole element."""
        head = element("title", self.title) + element("desc", self.text)
        inside = head + Markup("").join(self.parts)
        box = f"0 0 {self.width:g} {self.height:g}"
        return element(
            "svg",
            inside,
            xmlns="http://www.w3.org/2000/svg",
            viewBox=box,
            role="group" if self.has_links else "img",
            aria_label=f"{self.title}. {self.text}",
        )
