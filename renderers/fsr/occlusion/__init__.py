"""What no ray can reach is not looked at: blocks hidden behind walls."""

from renderers.fsr.occlusion.blocks import FAR, NEAR, Blocks

__all__ = ["FAR", "NEAR", "Blocks"]
