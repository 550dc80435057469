"""Materials: contact physics, estimated on paper, and its effect on the sound, simulated."""

from __future__ import annotations

from ajgdata.studies.materials.contact_estimates import estimates
from ajgdata.studies.materials.material_distances import STEPS, distances
from ajgdata.types.table import Table


def tables(quick: bool = False) -> tuple[Table, ...]:
    """Estimates and distances; `quick`: the spheres of 80 mm with all effects, two grasps."""
    if quick:
        return estimates(), distances(("80 mm sphere",), list(STEPS)[-1:], grasps=2)
    return estimates(), distances()
