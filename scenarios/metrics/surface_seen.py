"""What mucosa was seen, and when landmarks were."""

from scenarios.coverage.watch import LANDMARK_S
from scenarios.metrics.measured import Measured
from scenarios.metrics.metric import SCOPE, Answer, Definition, Found

NOBODY = "nobody watched what was seen"


def surface_seen(measured: Measured) -> Answer:
    """Return the share of each site's mucosa that was seen, percent of its area."""
    coverage = measured.coverage
    if coverage is None:
        return {"in all": Found(None, (), NOBODY)}
    whole = sum(site.area_mm2 for site in coverage.sites.values())
    if not whole > 0.0:
        return {"in all": Found(None, (), "the head has no mucosa that is known")}
    in_all = spread = 0.0
    for site in coverage.sites.values():
        in_all += site.area_mm2 / whole * site.seen_percent
        spread += (site.area_mm2 / whole * site.uncertain_percent) ** 2
    answer = {"in all": Found(in_all, sigma=spread**0.5)}
    for name, site in coverage.sites.items():
        answer[name] = Found(site.seen_percent, sigma=site.uncertain_percent)
    return answer


def landmarks_seen(measured: Measured) -> Answer:
    """Return when each landmark had been seen, in their order, s."""
    coverage = measured.coverage
    if coverage is None:
        return {}
    return {
        name: Found(time_s, ((time_s - LANDMARK_S, time_s),))
        for name, time_s in coverage.landmarks_s.items()
    }


SURFACE_SEEN = (
    Definition("surface seen", SCOPE, "%", surface_seen),
    Definition("landmark seen after", SCOPE, "s", landmarks_seen),
)
