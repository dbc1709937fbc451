"""`paravol tools`: list the instruments that there are, with sizes and forces."""

from dataclasses import asdict
from typing import TYPE_CHECKING

from app.cli.root import Json
from app.cli.terminal import print_json, print_table

if TYPE_CHECKING:
    from scenarios.instruments import Instrument


def tools(*, json: Json = False) -> int:
    """List the surgeon's instruments, with their sizes and forces."""
    from scenarios.instruments import INSTRUMENTS

    if json:
        print_json({name: _record(tool) for name, tool in INSTRUMENTS.items()})
    else:
        rows = [(name, _described(tool)) for name, tool in INSTRUMENTS.items()]
        print_table("Instruments", rows)
    return 0


def _record(tool: "Instrument") -> dict[str, object]:
    return {
        "action": tool.action.value,
        "bone_n": tool.taker.force_n,
        "bone_mm": tool.taker.bone_mm,
        "needs_suction": tool.needs_suction,
        "suction_ml_s": tool.suction_ml_s,
        # a dataclass each, but of no common one that says so
        "shape": asdict(tool.shape),  # type: ignore[call-overload]
    }


def _described(tool: "Instrument") -> str:
    """Return one line: when it takes tissue, its first sizes, its force on bone."""
    shape: dict[str, float] = asdict(tool.shape)  # type: ignore[call-overload]
    sizes = [
        f"{name.removesuffix('_mm').replace('_', ' ')} {value:g}"
        for name, value in shape.items()
        if name.endswith("_mm")
    ]
    words = [tool.action.value, f"{', '.join(sizes[:4])} mm"]
    if tool.taker.force_n:
        words.append(f"{tool.taker.force_n:g} N on bone")
    if tool.taker.bone_mm:
        words.append(f"bone to {tool.taker.bone_mm:g} mm")
    if tool.suction_ml_s:
        words.append(f"sucks {tool.suction_ml_s:g} ml/s")
    return "; ".join(words)
