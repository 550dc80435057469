"""Settings of a small embedding."""

from report_samples import SCRIPT

SETTINGS = {
    "supervision": f"Which things are the same, and {SCRIPT}.",
    "target": "object",
    "category": "category",
    "dimensions": (2, 4),
    "shown": 4,
    "folds": 2,
    "inits": 1,
}
