"""The virtual gripper: a 3-D wave simulation of the cavity, independent of all other packages.

>>> from ajgdata.gripper import Scene, excitation_sweep, record, simulate
>>> numerics = {"dx_mm": 6, "max_time_s": 0.01}  # coarse and short; the defaults are accurate
>>> scene = Scene.model_validate({"object": {"kind": "cube", "edge_mm": 20}, "numerics": numerics})
>>> recording = record(simulate(scene), excitation_sweep(), seed=1)
>>> recording.samples.shape, recording.clipped_count
((44100,), 0)

Scenes are plain data. The solver and its compiler are imported when they are first used.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from ajgdata.gripper.objects import SceneError
from ajgdata.gripper.scene import SAMPLE_RATE_HZ, Scene, derive_seed, scene_digest
from ajgdata.gripper.signal_settings import SignalChain

if TYPE_CHECKING:
    from ajgdata.gripper.signal_chain import (
        ImpulseResponse,
        SimulatedRecording,
        excitation_sweep,
        record,
    )
    from ajgdata.gripper.simulation import simulate
    from ajgdata.gripper.solver_plan import Plan, build_plan

#: Modules of names that are imported when they are first used.
_MODULES = {
    "Plan": "solver_plan",
    "build_plan": "solver_plan",
    "simulate": "simulation",
    "ImpulseResponse": "signal_chain",
    "SimulatedRecording": "signal_chain",
    "excitation_sweep": "signal_chain",
    "record": "signal_chain",
}

__all__ = [
    "SAMPLE_RATE_HZ",
    "ImpulseResponse",
    "Plan",
    "Scene",
    "SceneError",
    "SignalChain",
    "SimulatedRecording",
    "build_plan",
    "derive_seed",
    "excitation_sweep",
    "record",
    "scene_digest",
    "simulate",
]


def __getattr__(name: str) -> Any:
    """Import a name of `_MODULES`."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_MODULES[name]}"), name)
