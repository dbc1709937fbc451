"""What no ray can reach is not looked at: blocks hidden behind walls."""

from renderers.fsr.occlusion.blocks import Blocks

__all__ = ["Blocks"]
