"""What is said of a metric."""

from scenarios.metrics import Metric

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
    if metric.value is None:
        return metric.reason
    unit = "" if metric.unit == "1" else f" {metric.unit}"
    sigma = "" if not metric.sigma else f" ± {metric.sigma:.2g}"
    remark = metric_remark(metric)
    return f"{_figure(metric.value)}{sigma}{unit}" + (f" ({remark})" if remark else "")


def _figure(value: float) -> str:
    if value == round(value) and abs(value) < 1e6:
        return f"{value:.0f}"
    return f"{value:.0f}" if abs(value) >= 1000.0 else f"{value:.4g}"


def metric_remark(metric: Metric) -> str:
    """Return what is to be known of a value; "" for nothing."""
    return _NOISE if metric.is_noise else metric.reason
