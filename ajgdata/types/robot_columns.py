"""Columns of recordings.csv with the numbers that the robot's program printed for a grasp."""

from __future__ import annotations

import re

#: Beginning of the names of these columns: the number `x_m` is in the column `robot_x_m`.
ROBOT_PREFIX = "robot_"
#: Unit by the end of a name, e.g. `_m` of `x_m`. Longer ends are first: `_m_s` before `_s`.
UNITS = {
    "deg_s": "°/s",
    "rad_s": "rad/s",
    "mm_s": "mm/s",
    "m_s": "m/s",
    "m_s2": "m/s²",
    "n_m": "N m",
    "degc": "°C",
    "kpa": "kPa",
    "hpa": "hPa",
    "mbar": "mbar",
    "bar": "bar",
    "deg": "°",
    "rad": "rad",
    "khz": "kHz",
    "pa": "Pa",
    "hz": "Hz",
    "um": "µm",
    "mm": "mm",
    "cm": "cm",
    "mn": "mN",
    "kg": "kg",
    "ms": "ms",
    "mv": "mV",
    "ma": "mA",
    "m": "m",
    "n": "N",
    "g": "g",
    "s": "s",
    "v": "V",
    "a": "A",
    "w": "W",
    "k": "K",
}
#: Number of an element of a list at the end of a name.
_ELEMENT = re.compile(r"_\d+$")


def is_robot_column(column: str) -> bool:
    """Return whether a column has the name of a number of the robot's program."""
    return column.startswith(ROBOT_PREFIX)


def robot_unit(column: str) -> str:
    """Return the unit of a column of the robot by the end of its name; "" if it is unknown.

    >>> robot_unit("robot_force_n"), robot_unit("robot_joints_rad_2"), robot_unit("robot_m")
    ('N', 'rad', '')
    """
    name = _ELEMENT.sub("", column.removeprefix(ROBOT_PREFIX)).lower()
    for end, unit in UNITS.items():
        if name.endswith(f"_{end}"):
            return unit
    return ""
