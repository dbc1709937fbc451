"""Tools that move, made up: no symmetry, so that a wrong sign shows."""

import numpy as np
from scipy.spatial.transform import Rotation

from paravol.exchange.tool_motion import Message, Motions, ToolMotion


def motion(name: str, count: int = 40, *, seed: int = 3) -> ToolMotion:
    """Move and turn a tool through the head; two of its poses are invalid."""
    rng = np.random.default_rng(seed)
    steps = np.cumsum(rng.normal(scale=0.02, size=(count, 3)), axis=0)
    frames = np.tile(np.eye(4), (count, 1, 1))
    start = Rotation.from_euler("xyz", [75.0, 20.0, 35.0], degrees=True)
    frames[:, :3, :3] = (Rotation.from_rotvec(steps) * start).as_matrix()
    frames[:, :3, 3] = np.array([11.0, -52.0, 23.0]) + 10.0 * steps
    valid = np.ones(count, np.bool_)
    valid[[5, count // 2]] = False
    frames[~valid] = np.eye(4)
    times = np.asarray(100.25 + 0.01 * np.arange(count), np.float64)
    return ToolMotion(name, times, frames, valid)


def motions() -> Motions:
    tools = motion("ScopeTipToRas"), motion("InstrumentTipToRas", seed=8)
    return Motions(tools, (Message(100.3, 'task "look" <done> & more'),))
