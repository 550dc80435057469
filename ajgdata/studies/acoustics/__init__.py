"""Acoustics with a source: how fast the gripper falls silent, what is heard of sound from outside,
and what each choice of losses, transducers and noise does to the feature."""

from __future__ import annotations

from ajgdata.studies.acoustics.choices import choices
from ajgdata.studies.acoustics.decay import decays
from ajgdata.studies.acoustics.from_outside import from_outside
from ajgdata.types.table import Table


def tables(quick: bool = False) -> tuple[Table, ...]:
    """Decay times, sound from outside and choices; `quick`: on a coarse grid, one scene."""
    return decays(quick), from_outside(quick), choices(quick)
