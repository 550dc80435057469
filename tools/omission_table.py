"""Measure `ajgdata/gripper/omissions.yaml`: run `python tools/omission_table.py`.

Each kind of scene is an object of one material and shape on one support, in its smallest, middle
and largest size, in three poses each: of three grippers, sessions and beds.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import yaml

import ajgdata.gripper
from ajgdata.gripper.object_library import MATERIAL_SET, PLATE_MM
from ajgdata.gripper.omissions import TABLE, Measured, MeasuredTable
from ajgdata.gripper.scene import PHYSICS_VERSION, Numerics
from ajgdata.store.files import write_bytes
from ajgdata.store.provenance import software
from ajgdata.studies.omissions import PARTS, Case, Shape, box, changes, cube, sphere

#: "About 5" is half a millimetre either way, and so is the tolerance of sheet steel, planed wood
#: and extruded plastic as sold; that of cut foam boards is twice as much.
PLATE_TOLERANCE_MM = {"metal": 0.5, "wood": 0.5, "plastic": 0.5, "styrofoam": 1.0}
#: Poses of each size; `studies.omissions` has others.
SEEDS = (0, 1, 2)
Kind = tuple[list[Shape], str]


def kinds() -> list[Kind]:
    """Return the shapes, from the smallest to the largest, and the support of each kind."""
    listed: list[Kind] = [
        ([cube(edge) for edge in (10, 20, 30)], "rigid"),
        ([box(270, 15, 44, "wood")], "rigid"),
        ([box(270, 44, 15, "wood")], "rigid"),
        ([sphere(size, "plastic") for size in (30, 55, 80)], "rigid"),
    ]
    for name, material in MATERIAL_SET.items():
        listed += [([sphere(size, material) for size in (30, 55, 80)], "concave")]
        off = PLATE_TOLERANCE_MM[name]
        plates = [box(100, 100, PLATE_MM + by, material) for by in (-off, off)]
        listed += [(plates, "concave")]
    return listed


def measured(kind: Kind, seeds: Iterable[int] = SEEDS) -> Measured:
    """Return the largest change by each part over all sizes and poses of a kind."""
    shapes, support = kind
    cases = [Case("", shape, support, seed) for shape in shapes for seed in seeds]
    measurements = [changes(case) for case in cases]
    largest = {part: max(change[part]["measured"] for change in measurements) for part in PARTS}
    things = [case.plan().scene.object for case in cases[:: len(cases) // len(shapes)]]
    sizes = list(zip(*(thing.size_mm for thing in things if thing is not None), strict=True))
    return Measured(
        shape=shapes[0]["kind"],
        material=shapes[0]["material"],
        support=support,
        least_mm=tuple(map(min, sizes)),
        most_mm=tuple(map(max, sizes)),
        scenes=len(cases),
        change={part: float(f"{value:.3g}") for part, value in largest.items()},
    )


def main() -> None:
    """Measure all kinds and write the table into the package."""
    commit, rows = software()["git_commit"], []
    for kind in kinds():
        rows.append(measured(kind))
        print(rows[-1], flush=True)
    table = MeasuredTable(
        commit=commit,
        physics=PHYSICS_VERSION,
        dx_mm=Numerics().dx_mm,
        kinds=tuple(rows),
    )
    text = yaml.safe_dump(table.model_dump(mode="json"), sort_keys=False, default_flow_style=None)
    write_bytes(Path(ajgdata.gripper.__file__).with_name(TABLE), text.encode())


if __name__ == "__main__":
    main()
