"""What is said of a metric."""

from scenarios.metrics import Metric
from scenarios.metrics.value_text import value_text

_OF_MANY = (
    *("speed peaks: ", "smallest distance: ", "time in margin: "),
    *("hazard dose: ", "near misses: "),
)
"""Metrics that most hazards or thresholds have nothing to tell of."""

_NOISE = "below the noise floor"


def says_nothing(metric: Metric) -> bool:
    """Return whether a hazard or a threshold did not come into play."""
    far = metric.value is None and "nearer than" in metric.reason
    return metric.name.startswith(_OF_MANY) and (far or metric.value == 0.0)


def metric_text(metric: Metric) -> str:
    """Return a value with its 1 sigma and its unit, or why there is none."""
    remark = "" if metric.value is None else metric_remark(metric)
    return metric_figure(metric) + (f" ({remark})" if remark else "")


def metric_figure(metric: Metric) -> str:
    """Return the same without what is to be known of it."""
    if metric.value is None:
        return metric.reason
    return value_text(metric.value, metric.sigma, metric.unit)


def metric_remark(metric: Metric) -> str:
    """Return what is to be known of a value; "" for nothing."""
    return _NOISE if metric.is_noise else metric.reason
