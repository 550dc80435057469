"""The virtual gripper: a 3-D wave simulation of the cavity, usable alone.

    from ajgdata.gripper import Scene, excitation_sweep, record, simulate

    scene = Scene.model_validate({"object": {"kind": "cube", "edge_mm": 20}})
    take = record(simulate(scene), excitation_sweep(), seed=1)

Scenes are plain data; the solver and its compiler are imported when they are first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from ajgdata.gripper.chain import SignalChain
from ajgdata.gripper.equivalence import canonical
from ajgdata.gripper.plain import SceneError
from ajgdata.gripper.scene import SAMPLE_RATE_HZ, Scene, derive_seed, parse_scene, scene_digest

if TYPE_CHECKING:
    from ajgdata.gripper.outside import outside_noise
    from ajgdata.gripper.plan import Plan, compile
    from ajgdata.gripper.response import ImpulseResponse
    from ajgdata.gripper.signal import Take, excitation_sweep, record
    from ajgdata.gripper.simulation import simulate

_HOME = {
    "Plan": "plan",
    "compile": "plan",
    "ImpulseResponse": "response",
    "simulate": "simulation",
    "Take": "signal",
    "excitation_sweep": "signal",
    "record": "signal",
    "outside_noise": "outside",
}

__all__ = [
    "SAMPLE_RATE_HZ",
    "ImpulseResponse",
    "Plan",
    "Scene",
    "SceneError",
    "SignalChain",
    "Take",
    "canonical",
    "compile",
    "derive_seed",
    "excitation_sweep",
    "outside_noise",
    "parse_scene",
    "record",
    "scene_digest",
    "simulate",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)
