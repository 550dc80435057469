"""What the wave-solver tests share; it lives with the studies."""

from collections.abc import Sequence

from ajgdata.gripper.grid import cut_cells
from ajgdata.studies.discrete import energies, frequencies
from ajgdata.studies.domains import (
    AIR,
    PLASTIC,
    SILENT,
    Region,
    bowl,
    box,
    closed,
    lossy_bowl,
    random_state,
    sphere,
    time_step,
)
from ajgdata.studies.verification.case import fitted_order

__all__ = [
    "AIR",
    "PLASTIC",
    "SILENT",
    "Region",
    "bowl",
    "box",
    "check_convergence",
    "closed",
    "cut_cells",
    "energies",
    "frequencies",
    "lossy_bowl",
    "random_state",
    "sphere",
    "time_step",
]


def check_convergence(
    sizes: Sequence[float], errors: Sequence[float], *, order: float, cap: float
) -> None:
    """The fitted order is at least `order`, and the finest error at most `cap`."""
    slope = fitted_order(sizes, errors)
    assert slope >= order, f"order {slope:.2f} < {order} from {sizes}, {errors}"
    assert errors[-1] <= cap, f"error {errors[-1]:.2e} > {cap}"
