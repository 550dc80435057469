"""Contact effects between materials, estimated on paper."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ajgdata.gripper import Scene
from ajgdata.gripper.bending import Plate, plate_modes
from ajgdata.gripper.column import pad_stiffness
from ajgdata.gripper.contact import (
    GRAIN_SOLIDS,
    GRAVITY,
    Latex,
    Pack,
    Spring,
    contact_modulus,
    hertz_approach,
    microslip_loss,
    rest,
    seat,
    stack_admittance,
    thermal_admittance,
)
from ajgdata.gripper.geometry import RASTER_M, cavity
from ajgdata.gripper.object_materials import MATERIALS, Material, MaterialName
from ajgdata.types.table import Column, Table, Value

R = NDArray[np.inexact]
HARD: tuple[MaterialName, ...] = ("aluminium", "wood", "plastic")
REFERENCE: MaterialName = "steel"
AIR_IMPEDANCE = 412.0
SOUND_PA = 2 * np.sqrt(2.0)
FRICTION = 0.3
#: What an estimate must exceed for its effect to be worth simulating: relative change of the
#: reflection at the imprint. A repeat of a recording moves the feature by about as much.
WORTH = 1e-3
OMEGA = 2 * np.pi * np.geomspace(100, 10_000, 400)
#: Effusivity √(κρc_p) of air over that of the solid: 5.6 over 14,000, 24,000, 400, 600 J/(m² K √s).
EFFUSIVITY: dict[MaterialName, float] = {
    "steel": 4e-4,
    "aluminium": 2.3e-4,
    "wood": 1.4e-2,
    "plastic": 9e-3,
}
SHAPES: dict[str, dict[str, object]] = {
    "80 mm sphere": {"kind": "ellipsoid", "diameters_mm": (80, 80, 80)},
    "30 mm sphere": {"kind": "ellipsoid", "diameters_mm": (30, 30, 30)},
    "5 mm plate": {"kind": "box", "length_mm": 100, "width_mm": 100, "height_mm": 5},
}


PLASTIC_BALLS = Pack(6e-3, 0.40, GRAIN_SOLIDS["plastic"])
RUBBER = MATERIALS["rubber"], 5e-3


class PressedShape:
    """One shape under the default gripper: force, pressed area and stress (SI), depth of grains."""

    def __init__(self, shape: str, pack: Pack) -> None:
        scene = Scene.model_validate({"object": SHAPES[shape]})
        pressed = cavity(scene)
        self.force, self.pack = scene.grasp.force_n, pack
        self.area = float(pressed.contact.sum()) * RASTER_M**2
        self.stress = self.force / self.area
        deep = (pressed.surface - pressed.floor)[pressed.contact > 0.5]
        self.depth, self.frame = float(deep.mean()), pack.frame(self.stress)
        self.radius = {"80 mm sphere": 0.04, "30 mm sphere": 0.015}.get(shape)
        self.volume = 4 / 3 * np.pi * self.radius**3 if self.radius else 0.1 * 0.1 * 5e-3
        self.base = self.area if self.radius else 0.1 * 0.1

    def mass(self, solid: Material) -> float:
        """Mass of the object per pressed area, kg/m²."""
        return solid.density_kg_m3 * self.volume / self.base

    def reflected(self, held: Spring | None, between: Spring, solid: Material, **frame: float) -> R:
        """Loss of reflection 2ρc/Z of the imprint at OMEGA, for a held object and its seat."""
        grains = self.frame._replace(**frame)
        mass = self.mass(solid)
        return 2 * AIR_IMPEDANCE * stack_admittance(OMEGA, grains, self.depth, between, mass, held)

    def support(self, solid: Material, rubber: bool) -> Spring | None:
        """Spring that the object rests on; None where nothing gives way."""
        if self.radius is None:
            held = pad_stiffness(*RUBBER, self.base) / self.base
            return Spring(held, RUBBER[0].loss) if rubber else None
        pressed = self.force + GRAVITY * solid.density_kg_m3 * self.volume
        return rest(pressed, self.area, solid, self.radius, RUBBER if rubber else None)

    def seat(self, solid: Material) -> Spring:
        """Grains on the membrane on the object."""
        return seat(self.stress, self.pack, solid)

    def bare_seat(self, solid: Material) -> Spring:
        """Grains on the object as if there were no membrane."""
        return seat(self.stress, self.pack, solid, Latex(thickness=0.0))

    def bending(self, solid: Material) -> R:
        """A plate's bending on the sheet of rubber, pressed over a disc of the imprint's area."""
        sheet = self.support(solid, rubber=True)
        assert sheet is not None
        modes = plate_modes(Plate(0.1, 0.1, 5e-3, solid), sheet)
        edge = np.sqrt(self.area) / 2
        u, v = (a.ravel() for a in np.meshgrid(*2 * [np.linspace(-edge, edge, 21)]))
        pressed = modes.at(u, v).mean(axis=1)[:, None] ** 2 * self.area
        square = modes.square[:, None] * (1 + 1j * modes.loss[:, None])
        return 2 * AIR_IMPEDANCE * np.sum(1j * OMEGA * pressed / (square - OMEGA**2), axis=0)


def estimates() -> Table:
    """Each effect on paper: what it changes at the imprint between steel and another hard solid."""
    rows: tuple[dict[str, Value], ...] = tuple(
        {"shape": shape, "effect": effect, "change": change, "worth": change > WORTH}
        for shape in SHAPES
        for effect, change in _changes(PressedShape(shape, PLASTIC_BALLS)).items()
    )
    return Table(
        "material_estimates",
        "Contact effects on paper, hard materials",
        "Largest change between steel and aluminium, wood or plastic of what the imprint reflects,"
        f" 0.1-10 kHz, relative to a rigid wall; worth simulating above {WORTH:g}. Plastic balls,"
        " 8 N. An upper bound: the whole pressure presses the grains, and all at once.",
        (
            Column("shape", "Object"),
            Column("effect", "Effect"),
            Column("change", "Change"),
            Column("worth", "Worth it"),
        ),
        rows,
    )


def _changes(bench: PressedShape) -> dict[str, float]:
    steel, stress, pack = MATERIALS[REFERENCE], bench.stress, bench.pack
    seated = bench.seat(steel)
    fixed = bench.reflected(None, seated, steel)

    def most(reflected: Callable[[Material], R]) -> float:
        reference = reflected(steel)
        return max(float(np.max(np.abs(reflected(MATERIALS[m]) - reference))) for m in HARD)

    def flat(solid: Material) -> R:
        per_grain = stress / pack.seats_per_m2
        modulus = contact_modulus(pack.grain, solid)
        return 2 * OMEGA / 344 * hertz_approach(per_grain, pack.diameter / 2, modulus)

    def heat(solid: Material) -> R:
        ratio = next(e for name, e in EFFUSIVITY.items() if MATERIALS[name] is solid)
        return 2 * thermal_admittance(OMEGA, ratio)

    slip = float(microslip_loss(SOUND_PA / stress, 1.0, FRICTION))
    softer = bench.frame.modulus_pa * (1 - SOUND_PA / (3 * stress))
    changes = {
        "grain on object, no membrane": most(
            lambda m: bench.reflected(None, bench.bare_seat(m), steel)
        ),
        "grain on object through the membrane": most(
            lambda m: bench.reflected(None, bench.seat(m), steel)
        ),
        "depth of the imprint": most(flat),
        "heat into a bare surface": most(heat),
        "micro-slip at 100 dB": float(
            np.max(
                np.abs(bench.reflected(None, seated, steel, loss=bench.frame.loss + slip) - fixed)
            )
        ),
        "stiffening by sound at 100 dB": float(
            np.max(np.abs(bench.reflected(None, seated, steel, modulus_pa=softer) - fixed))
        ),
        "weight on 5 mm of rubber": most(
            lambda m: bench.reflected(bench.support(m, True), seated, m)
        ),
    }
    if bench.radius is None:
        return changes | {"bending on 5 mm of rubber": most(bench.bending)}
    return changes | {
        "weight on its Hertz contact, hard ground": most(
            lambda m: bench.reflected(bench.support(m, False), seated, m)
        )
    }
