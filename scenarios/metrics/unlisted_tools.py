"""Which tools were used, and whether the exercise allows them."""

from scenarios.metrics.episodes import intervals, weights
from scenarios.metrics.measured import Measured
from scenarios.metrics.metric import TOOL, Definition, Found, Interval

UNLISTED = "unlisted tool in use"


def unlisted_s(measured: Measured) -> Found:
    """Return how long a tool worked, or sucked, that the exercise does not list, s."""
    use, allowed = measured.tool_use, measured.allowed_tools
    if use is None:
        return Found(None, (), "nobody recorded which tools were used")
    if not allowed:
        return Found(0.0, (), "every tool may be used")
    gap_s = measured.settings.gap_s
    lasting = weights(use.time_s, gap_s)
    total, names = 0.0, list[str]()
    spans: list[Interval] = []
    for name, is_used in use.is_used.items():
        if name in allowed or not is_used.any():
            continue
        # a single sample is a use, however short
        total += max(float(lasting[is_used].sum()), 1e-3)
        spans += intervals(use.time_s, is_used, gap_s)
        names.append(name)
    return Found(total, tuple(spans), ", ".join(names))


UNLISTED_TOOLS = (Definition(UNLISTED, TOOL, "s", unlisted_s),)
