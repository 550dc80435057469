"""Sound from outside at the microphone: through the membrane as solved, and by the mass law."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ajgdata.gripper import SAMPLE_RATE_HZ, Scene, simulate
from ajgdata.gripper.external_noise import transmission
from ajgdata.types.table import Column, Table, Value

#: Edges (Hz) of the bands.
EDGES_HZ = (60, 150, 300, 600, 1_000, 2_000, 4_000, 8_000, 16_000)
#: What is held, in which medium.
HELD = (("cube_20p7", "plastic"), (None, "plastic"), (None, "air"))


def from_outside(quick: bool = False) -> Table:
    """Return the level at the microphone against that in the room, by band, both ways."""
    rows: list[dict[str, Value]] = []
    for held, medium in HELD[:1] if quick else HELD:
        numerics = {"dx_mm": 6.0} if quick else {}
        given = {"object": held, "medium": {"kind": medium}, "numerics": numerics}
        response = simulate(Scene.model_validate(given))
        assert response.outside is not None, "simulated just now"
        known = np.linspace(0, SAMPLE_RATE_HZ / 2, len(response.outside))
        for low, high in pairwise(EDGES_HZ):
            hz = np.linspace(low, high, 200)
            solved = np.interp(hz, known, response.outside**2).mean()
            limp = transmission(hz, response.membrane_kg_m2).mean()
            rows.append(
                {
                    "scene": f"{held or 'nothing'}, {medium}",
                    "hz": float(np.sqrt(low * high)),
                    "band": f"{low}–{high}",
                    "solved": float(10 * np.log10(solved)),
                    "mass_law": float(10 * np.log10(limp)),
                    "difference": float(10 * np.log10(solved / limp)),
                }
            )
    return Table(
        "from_outside",
        "Sound from outside at the microphone",
        "Level at the microphone against that in the room, of white sound from all directions in"
        " each band. Solved: through membrane, grains and cavity, by reciprocity. Mass law: as"
        " through a limp wall of the membrane's mass, without cavity, grains and table.",
        (
            Column("scene", "Scene"),
            Column("hz", "Middle", "Hz"),
            Column("band", "Band", "Hz"),
            Column("solved", "Solved", "dB"),
            Column("mass_law", "Mass law", "dB"),
            Column("difference", "Difference", "dB"),
        ),
        tuple(rows),
    )
