"""Names of data sets, tasks, targets and models, which are parts of file names."""

from __future__ import annotations

import re
import reprlib
from typing import Annotated

from pydantic import AfterValidator, Field

from ajgdata.types.errors import DataError
from ajgdata.types.registry import MODELS

#: Largest number of characters of a name: file names consist of several names.
LONGEST_NAME = 100
#: Pattern of a name; `NAME_RULE` describes it.
NAME_PATTERN = re.compile(rf"^[A-Za-z0-9][A-Za-z0-9_-]{{0,{LONGEST_NAME - 1}}}$")
NAME_RULE = (
    f"letters, digits, _ and -, up to {LONGEST_NAME} characters, the first a letter or digit"
)
#: A part that is repeated 20 times at the end of a name. Snakemake does not run a job whose files
#: have this name.
_REPEATED_PART = re.compile(r"(.+)\1{19}$")
#: Names of devices on Windows.
_DEVICE = re.compile(r"(?i)con|prn|aux|nul|com\d|lpt\d")


def is_device_name(name: str) -> bool:
    """Return True if Windows reserves a name, so that no file or folder can have it.

    >>> is_device_name("Aux"), is_device_name("auxiliary")
    (True, False)
    """
    return _DEVICE.fullmatch(name) is not None


def without_device_name(name: str) -> str:
    """Return `name`. Raises ValueError if Windows reserves it."""
    if is_device_name(name):
        raise ValueError(f"{name!r} is reserved by Windows: use another name")
    return name


def without_repeated_part(name: str) -> str:
    """Return `name`. Raises ValueError if it ends with the same part 20 times."""
    repeated = _REPEATED_PART.search(name)
    if repeated:
        raise ValueError(f"ends with {repeated[1]!r} 20 times, which Snakemake refuses")
    return name


Name = Annotated[
    str,
    Field(pattern=NAME_PATTERN.pattern, description="letters, digits, _ and -"),
    AfterValidator(without_repeated_part),
    AfterValidator(without_device_name),
]
ModelName = Annotated[Name, AfterValidator(MODELS.checked)]


def checked_name(name: str, what: str = "data set") -> str:
    """Return `name`. Raises DataError if a `what` cannot have this name."""
    if not NAME_PATTERN.fullmatch(name):
        rule = NAME_RULE
    elif _REPEATED_PART.search(name):
        rule = "a name that does not end with the same part 20 times: Snakemake refuses it"
    elif is_device_name(name):
        rule = "another name: Windows reserves this one for a device"
    else:
        return name
    raise DataError(reprlib.repr(name), f"is not a valid name of a {what}", f"use {rule}")
