"""Which physical settings vary, at which level, within which range, and where that is known from.

A setting with a source has its value from there. One without has a range, and its default is the
middle of it: the arithmetic one, or the geometric one (`scale` "log") where the range spans more
than a factor of 3. Where that is not so, the source says after "default:" why.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal, get_args

from pydantic import BaseModel

from ajgdata.gripper.scene import Scene
from ajgdata.gripper.signal_settings import SignalChain
from ajgdata.gripper.variation import Variation

Level = Literal["fixed", "gripper", "session", "grasp", "recording"]
Evidence = Literal["paper", "data sheet", "literature", "handbook", "estimate"]

#: What the first name of a setting's path stands for, where it is not a key of Scene.
ROOTS: dict[str, type[BaseModel]] = {"signal": SignalChain, "variation": Variation}
#: Last words of names that are units.
UNITS = {
    "mm": "mm", "deg": "°", "n": "N", "k": "K", "c": "°C", "pa": "Pa", "hz": "Hz", "db": "dB",
    "spl": "dB", "dba": "dB(A)", "kg_m2": "kg/m²", "pa_s_m": "Pa s/m", "n_m3": "N/m³",
}  # fmt: skip


@dataclass(frozen=True)
class Parameter:
    """A setting that varies or is not known, and what is known about it.

    `setting` is the dotted path from Scene or, as "signal....", from SignalChain or, as
    "variation....", from a recipe's variation; a number of a list is named by its place
    ("gripper.speaker_mm.0" is x). `level` is that at which it differs: between grippers, sessions,
    grasps or recordings. `low` and `high` bound what is swept, and are equal where it is known.
    """

    setting: str
    level: Level
    low: float
    high: float
    scale: Literal["linear", "log"]
    evidence: Evidence
    source: str

    @property
    def middle(self) -> float:
        """Middle of the range, on its scale."""
        if self.scale == "log":
            return math.sqrt(self.low * self.high)
        return (self.low + self.high) / 2

    @property
    def unit(self) -> str:
        """Unit, as the name ends; "" for a plain number."""
        words = [part for part in self.setting.split(".") if not part.isdigit()][-1].split("_")
        ends = ("_".join(words[-count:]) for count in (3, 2, 1) if len(words) > count)
        return next((UNITS[end] for end in ends if end in UNITS), "")


def default_of(setting: str) -> Any:
    """Return the model's default of a setting, None where that is null.

    Raises KeyError for a path that leads nowhere.

    >>> default_of("gripper.speaker_mm.0"), default_of("signal.motor.depth")
    (-35.0, 0.8)
    """
    first, *rest = setting.split(".")
    model, keys = (ROOTS[first], rest) if first in ROOTS else (Scene, [first, *rest])
    value: Any = model()
    for key in keys:
        if isinstance(value, tuple):
            value = value[int(key)]
            continue
        field = type(value).model_fields[key]
        inner = getattr(value, key)
        if inner is None and (models := [m for m in get_args(field.annotation) if _is_model(m)]):
            inner = models[0]()
        value = inner
    return value


def _is_model(kind: object) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


_NO_SIZES = "the paper gives no dimensions"
_LISTED = "kept as the first design had it; the paper gives none"
_FACTOR_3 = "measured by nobody: a factor of 3 either way"

_GRIPPER = (
    Parameter(
        "gripper.roof_radius_mm", "fixed", 40, 45, "linear", "estimate",
        _NO_SIZES + "; default: the smallest roof that holds transducers 70 mm apart",
    ),
    Parameter("gripper.rim_radius_mm", "fixed", 46, 54, "linear", "estimate", _NO_SIZES),
    Parameter("gripper.height_mm", "fixed", 35, 55, "linear", "estimate", _NO_SIZES),
    Parameter("gripper.balloon_depth_mm", "fixed", 35, 55, "linear", "estimate", _NO_SIZES),
    Parameter(
        "gripper.bed_depth_mm", "fixed", 25, 45, "linear", "estimate",
        "the paper does not say how full the balloon is",
    ),
    Parameter(
        "gripper.speaker_mm.0", "fixed", -36, -34, "linear", "paper", "70 mm from the microphone",
    ),
    Parameter(
        "gripper.speaker_mm.1", "fixed", 0, 6, "linear", "estimate",
        "off the line through the axis; the radius is almost that of the microphone",
    ),
    Parameter(
        "gripper.microphone_mm.0", "fixed", 33, 35, "linear", "paper", "70 mm from the speaker",
    ),
    Parameter(
        "gripper.microphone_mm.1", "fixed", -10, 0, "linear", "estimate",
        "as the speaker",
    ),
    Parameter(
        "gripper.transducer_sigma_mm", "fixed", 1.5, 3.5, "linear", "estimate",
        "half of a case of about 5 mm; not the opening, which is smaller than a cell",
    ),
    Parameter("gripper.port_mm.0", "fixed", 15, 21, "linear", "estimate", _LISTED),
    Parameter("gripper.port_mm.1", "fixed", 25, 31, "linear", "estimate", _LISTED),
    Parameter(
        "gripper.port_bore_mm", "fixed", 2, 6, "linear", "estimate",
        "common push-in fittings; the paper gives none",
    ),
    Parameter("gripper.port_length_mm", "fixed", 5, 15, "linear", "estimate", "as the bore"),
    Parameter(
        "gripper.wall_admittance", "gripper", 1.2e-3, 1.25e-2, "log", "estimate",
        "from the thermoviscous boundary layer at 3 kHz (Pierce, Acoustics, section 10-4) to ten "
        "times as much, for rough printed walls, the flange and what leaks there; as absorption "
        "coefficients 0.01 to 0.1",
    ),
    Parameter(
        "gripper.membrane.mass_kg_m2", "gripper", 0.2, 0.4, "linear", "estimate",
        "0.2 to 0.4 mm of latex of 1000 kg/m³; the paper does not give the balloon",
    ),
    Parameter(
        "gripper.membrane.resistance_pa_s_m", "gripper", 200, 1000, "log", "estimate",
        "radiation of a plane wave (ρc = 413) and the loss of latex: half, as a small disc radiates"
        " below 1 kHz, to twice",
    ),
    Parameter(
        "gripper.membrane.stiffness_n_m3", "gripper", 5e4, 2e5, "log", "estimate",
        "T (2.4/R)² at R = 50 mm; T = G h (1 - 1/λ⁶) of 0.3 mm of rubber of G = 0.5 MPa (Treloar "
        "1975) stretched by 2 to 14 %: 20 to 80 N/m, by which the membrane drapes, too",
    ),
    Parameter(
        "gripper.membrane.film", "session", 0.25, 4, "log", "estimate",
        "roughness by process spreads by a factor of four about its middle (ISO 21920-2)",
    ),
    Parameter(
        "gripper.stiffness_n_m3", "gripper", 2e5, 8e5, "log", "estimate",
        "force per displaced volume; a factor of 2 either way",
    ),
    Parameter(
        "gripper.clearance_mm", "fixed", 4, 4, "linear", "handbook",
        "a rule of this simulation: what is narrower is refused, as one cell cannot resolve it",
    ),
)  # fmt: skip

_MEDIUM = (
    Parameter(
        "medium.grain_diameter_mm", "fixed", 6, 6, "linear", "paper",
        "plastic 6 mm, steel 4.5 mm; coffee, medium grind, about 0.7 mm",
    ),
    Parameter(
        "medium.porosity", "session", 0.363, 0.445, "linear", "literature",
        "random close to random loose packing of spheres: Scott & Kilgour 1969, J. Phys. D 2, 863; "
        "Onoda & Liniger 1990, Phys. Rev. Lett. 64, 2727",
    ),
    Parameter(
        "medium.heave_deg", "fixed", 20, 40, "linear", "estimate",
        "friction angle from smooth beads to angular sand",
    ),
    Parameter(
        "medium.heave_fraction", "fixed", 0, 1, "linear", "estimate", "none to all of the grains",
    ),
)  # fmt: skip

_SUPPORT = (
    Parameter(
        "support.thickness_mm", "fixed", 2.5, 10, "log", "estimate",
        "rubber sheets as sold; the paper gives none",
    ),
    Parameter(
        "support.rim_radius_mm", "fixed", 20, 50, "linear", "estimate",
        "a plate of 100 mm lies on it and does not tip under a gripper of 50 mm radius",
    ),
    Parameter(
        "support.rim_width_mm", "fixed", 2, 6, "linear", "estimate",
        "the edge that a mould or a knife leaves",
    ),
    Parameter(
        "support.dish_radius_mm", "fixed", 50, 110, "linear", "estimate",
        "as hollow as the widest rim allows, to so shallow that a sphere of 80 mm rolls easily",
    ),
)  # fmt: skip

_GRASP = (
    Parameter(
        "grasp.angle_deg", "grasp", -90, 90, "linear", "paper", "poses of the household objects",
    ),
    Parameter(
        "grasp.offset_x_mm", "grasp", -10, 10, "linear", "paper", "poses of the household objects",
    ),
    Parameter(
        "grasp.offset_y_mm", "grasp", -10, 10, "linear", "paper", "poses of the household objects",
    ),
    Parameter("grasp.force_n", "fixed", 8, 8, "linear", "paper", "the controller's set point"),
    Parameter(
        "grasp.nuisance.roughness_mm", "grasp", 1 / 3, 3, "log", "estimate",
        "standard deviation of a bed's surface: " + _FACTOR_3 + " of a sixth of a 6 mm grain",
    ),
    Parameter(
        "grasp.nuisance.roughness_correlation_mm", "grasp", 3, 12, "log", "estimate",
        "half a grain to two",
    ),
    Parameter("grasp.nuisance.slope_deg", "grasp", 0.5, 4.5, "log", "estimate", _FACTOR_3),
    Parameter("grasp.nuisance.packing", "grasp", 0.02, 0.18, "log", "estimate", _FACTOR_3),
    Parameter(
        "grasp.nuisance.packing_correlation_mm", "grasp", 2.5, 10, "log", "estimate",
        "about half a grain to one and a half",
    ),
    Parameter("grasp.nuisance.force", "grasp", 0.01, 0.09, "log", "estimate", _FACTOR_3),
    Parameter(
        "grasp.nuisance.temperature_k", "grasp", 0, 1, "linear", "estimate",
        "air within a session in a room",
    ),
    Parameter(
        "environment.temperature_c", "session", 18, 26, "linear", "estimate",
        "rooms that people work in",
    ),
    Parameter(
        "environment.pressure_pa", "session", 98_000, 104_650, "linear", "handbook",
        "weather about the standard atmosphere at sea level (ISO 2533)",
    ),
)  # fmt: skip

_SIGNAL = (
    Parameter(
        "signal.level_db_spl", "fixed", 84, 100, "linear", "estimate",
        "the cavity turns 100 dB in a coupler of 2 cm³ into 84 dB, 105 dB into 89, and 116 dB, a "
        "power receiver, into 100; default: 105 dB, rounded",
    ),
    Parameter(
        "signal.full_scale_db_spl", "fixed", 129, 129, "linear", "data sheet",
        "SPW2430: overload (10 % distortion)",
    ),
    Parameter(
        "signal.gain_db", "fixed", -6, 6, "linear", "estimate", "the paper gives no levels",
    ),
    Parameter(
        "signal.noise_db_spl", "fixed", 38.6, 38.6, "linear", "data sheet",
        "SPW2430: signal to noise 59 dB(A) at 94 dB, 20 Hz to 10 kHz, hence 35 dB(A); white noise "
        "of as much is 38.6 dB up to 22 kHz",
    ),
    Parameter(
        "signal.external_noise_dba", "recording", 45, 80, "linear", "paper",
        "ambient to the loudest white noise",
    ),
    Parameter(
        "signal.motor.level_db_spl", "recording", 50, 70, "linear", "estimate", "a holding servo",
    ),
    Parameter(
        "signal.motor.fundamental_hz", "fixed", 210, 840, "log", "estimate", "an octave either way",
    ),
    Parameter("signal.motor.harmonics", "fixed", 6, 10, "linear", "estimate", "audible ones"),
    Parameter(
        "signal.motor.depth", "fixed", 0.6, 1, "linear", "estimate",
        "most of the hum changes over a turn",
    ),
    Parameter(
        "signal.motor.drift", "recording", 0.0025, 0.01, "log", "estimate", "a factor of 2",
    ),
    Parameter(
        "signal.coupling_hz", "fixed", 50, 200, "log", "estimate", "an octave either way",
    ),
    Parameter(
        "signal.resonances_hz.0", "fixed", 2_000, 4_000, "linear", "estimate",
        "first resonance of receivers of its kind, flat up to about 2.5 kHz (Kim & Allen 2013, "
        "Hearing Research 301)",
    ),
    Parameter(
        "signal.resonances_hz.1", "fixed", 6_000, 11_000, "linear", "estimate",
        "second resonance of receivers of its kind, with the spout",
    ),
    Parameter(
        "signal.resonances_q.0", "fixed", 1.5, 6, "log", "estimate",
        "peaks of 4 to 16 dB: damped and undamped receivers",
    ),
    Parameter(
        "signal.resonances_q.1", "fixed", 1.5, 6, "log", "estimate", "as the first",
    ),
)  # fmt: skip

_VARIATION = (
    Parameter(
        "variation.gripper.askew_mm", "gripper", 0, 5, "linear", "estimate",
        "a latex balloon put over a rim by hand; 5 mm tilt it by 6°",
    ),
    Parameter(
        "variation.gripper.fill_slope_deg", "gripper", 0, 5, "linear", "estimate",
        "grains that were poured through one hole, and a gripper that does not hang plumb",
    ),
    Parameter(
        "variation.gripper.transducers_mm", "gripper", 0, 1, "linear", "estimate",
        "holes of a printed housing, and glue",
    ),
    Parameter(
        "variation.session.jig_mm", "session", 0, 5, "linear", "estimate",
        "jig and calibrated axis of a robot, \"a few mm\", constant within a session",
    ),
    Parameter(
        "variation.session.temperature_k", "session", 0, 4, "linear", "estimate",
        "from one day to the next in one room",
    ),
    Parameter(
        "variation.session.fill_mm", "session", 0, 1.2, "linear", "estimate",
        "grains that settle from a porosity of 0.4 to random close packing lower a bed of 35 mm by "
        "1.2 mm, as their volume is kept (Scott & Kilgour 1969, J. Phys. D 2, 863)",
    ),
    Parameter(
        "variation.session.placement_mm", "session", 0, 2, "linear", "estimate",
        "an object put on a mark by hand",
    ),
    Parameter(
        "variation.session.placement_deg", "session", 0, 2, "linear", "estimate",
        "an object put along a mark by hand",
    ),
    Parameter(
        "variation.grasp.memory", "grasp", 0, 0.95, "linear", "estimate",
        "from grains poured anew to grains hardly loosened; ways of resetting differ (Amend et al. "
        "2012, IEEE Trans. Robot. 28, 341)",
    ),
    Parameter(
        "variation.grasp.grain_force", "grasp", 0.05, 1, "log", "estimate",
        "force of one grain in a packing: exponential, 1 (Liu et al. 1995, Science 269, 513), "
        "less where forces are correlated (Müller et al. 2010, Chem. Phys. 375, 600) and where the "
        "table bears most; grows towards the size of a grain as in Paume et al. 2024, Soft Matter",
    ),
)  # fmt: skip

#: Every physical setting but those of the object, of names and of seeds, those of the solver, and
#: what a variation draws by amounts of its own.
PARAMETERS: tuple[Parameter, ...] = (
    *_GRIPPER, *_MEDIUM, *_SUPPORT, *_GRASP, *_SIGNAL, *_VARIATION,
)  # fmt: skip
