"""Numbers that the robot's program prints for a grasp, and their columns."""

from __future__ import annotations

import json
import math
import re
import sys
from collections.abc import Mapping
from typing import Any

from ajgdata.types.robot_columns import ROBOT_PREFIX

#: Name of the force that the gripper reached.
FORCE = "force_n"
#: Column of this force, which also exists if a person moves the gripper.
FORCE_COLUMN = "force_reached_n"
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,79}")


def parse_numbers(text: str) -> dict[str, float]:
    """Return the numbers of a JSON object by name; elements of a list are numbered from 1.

    Raises ValueError for any other text, for a value that is not a finite number or a list of
    them, for a name that no column can have, and for two numbers with one name.

    >>> parse_numbers('{"force_n": 7.9, "joints_rad": [0.1, 0.2]}')
    {'force_n': 7.9, 'joints_rad_1': 0.1, 'joints_rad_2': 0.2}
    """
    try:
        pairs = json.loads(text, object_pairs_hook=list)
    except ValueError:
        pairs = None
    if not isinstance(pairs, list) or not all(isinstance(pair, tuple) for pair in pairs):
        raise ValueError(f"{text.strip()[:60]!r}, which is not a JSON object")
    numbers: dict[str, float] = {}
    for name, value in pairs:
        if not _NAME.fullmatch(name):
            rule = "a letter, then letters, digits and _, up to 80"
            raise ValueError(f"{name[:60]!r}, which cannot be the name of a column ({rule})")
        elements = {name: value}
        if isinstance(value, list):
            elements = {f"{name}_{place}": element for place, element in enumerate(value, 1)}
        for element_name, element in elements.items():
            if element_name in numbers:
                raise ValueError(f"two numbers named {element_name!r}")
            numbers[element_name] = _finite(element_name, element)
    return numbers


def _finite(name: str, value: Any) -> float:
    """Return a JSON value as a number. Raises ValueError if it is not a finite number."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    number = math.nan
    if is_number and abs(value) <= sys.float_info.max:  # whole numbers of JSON have no limit
        number = float(value)
    if math.isnan(number):
        raise ValueError(f"{name} = {json.dumps(value)[:60]}, which is not a finite number")
    return number


def number_labels(numbers: Mapping[str, float]) -> dict[str, str]:
    """Return the columns of a recording with the numbers of its grasp.

    >>> number_labels({"force_n": 7.90625, "x_m": 0.31})
    {'force_reached_n': '7.90625', 'robot_force_n': '7.90625', 'robot_x_m': '0.31'}
    >>> number_labels({})
    {'force_reached_n': ''}
    """
    force = numbers.get(FORCE)
    return {
        FORCE_COLUMN: "" if force is None else f"{force:g}",
        **{f"{ROBOT_PREFIX}{name}": repr(value) for name, value in numbers.items()},
    }
