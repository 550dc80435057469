"""Would weights that know how far a cut face is open make the wide scheme more accurate?

The four-point differences take one weight wherever the four cells are open. Here it is scaled by
how far the faces before and after are open against the face itself, in several ways. Each is a
weight of a face, so that the adjoint, hence the energy, is kept as it is. Shown: errors of the
dipole mode of a sphere and of a box that is turned, and of the feature of three objects against a
fine grid.

    python benchmarks/cut_weights.py                # some three minutes of one core
    python benchmarks/cut_weights.py --modes        # the resonances alone, some seconds
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper import system
from ajgdata.studies.accuracy import OBJECTS, relative_error, run, scene
from ajgdata.studies.verification.resonances import BoxOffGrid, SphereDipole

Real = NDArray[np.floating]
#: Openings of the face before, of the face itself and of the face after -> factor of its weight.
SCALES: dict[str, Callable[[Real, Real, Real], Real]] = {
    "one weight (as it is)": lambda before, here, after: np.ones_like(here),
    "smaller neighbour": lambda b, h, a: np.minimum(np.minimum(b, a) / h, 1),
    "product of neighbours": lambda b, h, a: np.minimum(b * a / h**2, 1),
    "mean of neighbours": lambda b, h, a: np.minimum((b + a) / 2 / h, 1),
    "smallest over largest": lambda b, h, a: (
        np.minimum(np.minimum(b, a), h) / np.maximum(np.maximum(b, a), h)
    ),
    "none at cut faces": lambda b, h, a: 1.0 * (np.minimum(np.minimum(b, a), h) > 0.999 * h.max()),
}
MODES_MM = (6.0, 4.2, 3.3)
FEATURE_MM, REFERENCE_MM = 4.2, 1.5


def scaled(scale: Callable[[Real, Real, Real], Real]) -> Callable[..., Real]:
    """Return a function that makes the weights of the faces along one axis, each times `scale`."""
    plain = system._weight

    def weight(area: Real, axis: int, share: Real, wide: float) -> Real:
        found, positive = plain(area, axis, share, wide), np.where(area > 0, area, 1.0)
        around = (np.roll(area, 1, axis), np.roll(area, -1, axis))
        return found * scale(around[0], positive, around[1])

    return weight


def main() -> None:
    """Print a row for each way to weigh."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--modes", action="store_true", help="errors of resonances alone")
    modes = parser.parse_args().modes
    fine = {} if modes else {
        name: run(scene(name, {"dx_mm": REFERENCE_MM})).feature for name in OBJECTS
    }  # fmt: skip
    heads = [f"{what} {mm:g} mm" for what in ("sphere", "box") for mm in MODES_MM]
    print(" | ".join(["weight", *heads, *fine]))
    for name, scale in SCALES.items():
        with patch.object(system, "_weight", scaled(scale)):
            cases = (SphereDipole("wide"), BoxOffGrid("wide"))
            errors = [case.error(mm * 1e-3) for case in cases for mm in MODES_MM]
            for held, reference in fine.items():
                found = run(scene(held, {"dx_mm": FEATURE_MM})).feature
                errors.append(relative_error(found, reference))
        print(" | ".join([name, *(f"{error:.2e}" for error in errors)]), flush=True)


if __name__ == "__main__":
    main()
