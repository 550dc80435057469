"""Measures that have no value, and why: they are missing values, never a guess, and never zero."""

from __future__ import annotations

from ajgdata.evaluate.agreement import GRASP_INTERVAL

#: Beginning of a part and of a metric, in the order in which they are looked for, with the reason.
_REASONS = (
    ("silhouette", "", "fewer than two labels among what is tested, or one for each recording"),
    ("distances", "", "no such pair of recordings"),
    ("", "r2", "all true values are the same"),
    ("", "rank_correlation", "truth or readings never change, or the target is an angle"),
    ("probe", "", "fewer than two values to learn from, or none to read"),
    ("", "accuracy of", "nothing was accepted"),
)


def why_undefined(part: str, metric: str, statistic: str) -> str:
    """Return why a number of the table of results may be missing, "" if it never may."""
    if part.endswith(", accepted") and metric == "accuracy":
        return "nothing was accepted"
    for of_part, of_metric, reason in _REASONS:
        if part.startswith(of_part) and metric.startswith(of_metric):
            return reason
    if statistic in ("low", "high"):
        return "all folds have the same value: how far others would differ is not known"
    if statistic in GRASP_INTERVAL:
        return "too few grasps, or all resamples of grasps give the same value"
    return "one value has no deviation" if statistic == "sd" else ""
