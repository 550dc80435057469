"""Names of columns that a published data set cannot have, because readers give them a meaning."""

from __future__ import annotations

from collections.abc import Collection

#: Reserved names of columns, with the reader that gives them a meaning.
RESERVED = {
    "audio": "Hugging Face stores the recording there",
    "file_name": "Hugging Face opens its values as recordings",
    "split": "Hugging Face and Croissant describe the training and test parts there",
}
#: Fix for columns that cannot be published.
RENAME = "rename or delete these columns in each recordings.csv, and in dataset.yaml"
#: End of the names of columns whose values Hugging Face opens as recordings.
FILE_ENDING = "_file_name"
#: Croissant's reader numbers the rows in the first unused column of these two.
ROW_NUMBERS = {"index", "level_0"}


def unpublishable(names: Collection[str]) -> dict[str, str]:
    """Return the names that no published column can have, sorted, each with the reason.

    >>> unpublishable(["form", "split", "profile_name"])
    {'split': 'Hugging Face and Croissant describe the training and test parts there'}
    """
    reasons = {}
    for name in sorted(names):
        if name in RESERVED:
            reasons[name] = RESERVED[name]
        elif name.endswith(FILE_ENDING):
            reasons[name] = RESERVED["file_name"]
    if set(names) >= ROW_NUMBERS:
        reasons["level_0"] = "Croissant's reader numbers the rows there if `index` is a label"
    return reasons
