"""What the sessions of a recipe shall hold: planned, or known from the run before.

Called while Snakemake parses: light imports only.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress

import numpy as np

from ajgdata.paths import Paths
from ajgdata.pipeline.recipes import planned_grasps, recipe_of
from ajgdata.store.code_digest import GRIPPER_CODE, code_digest
from ajgdata.store.files import (
    json_bytes,
    read_json,
    sha256_of,
    write_if_changed,
)
from ajgdata.types import SOURCES, DataError, DatasetSpec

PLANNED_BY = "ajgdata.pipeline.planned_scenes:planned_scenes"


def scenes_of(paths: Paths, spec: DatasetSpec, virtual: Sequence[str]) -> dict[str, bytes]:
    """Return what each virtual session shall hold, as JSON; nothing is written.

    Where `keep_scenes` noted that the files are of the same recipe, planned by the same code, they
    are read. Raises DataError for a recipe with a scene that the gripper does not know.
    """
    return _kept(paths, spec, virtual) or planned_scenes(paths, spec, virtual)


def planned_scenes(paths: Paths, spec: DatasetSpec, virtual: Sequence[str]) -> dict[str, bytes]:
    """Return what `scenes_of` does, planned anew."""
    planned = planned_grasps(paths.dataset(spec.name), spec, virtual)
    return {
        session: json_bytes([{**vars(one), "targets": dict(one.targets)} for one in grasps])
        for session, grasps in zip(virtual, planned, strict=True)
    }


def keep_scenes(paths: Paths, spec: DatasetSpec, scenes: Mapping[str, bytes]) -> None:
    """Write the scenes of each session, where they changed, and note what they follow from."""
    for session, content in scenes.items():
        write_if_changed(paths.scenes(spec.name, session), content)
    if scenes:
        note = {"follow_from": _follow_from(paths, spec), "sha256": _hashes(scenes)}
        write_if_changed(paths.planned(spec.name), json_bytes(note))


def _kept(paths: Paths, spec: DatasetSpec, virtual: Sequence[str]) -> dict[str, bytes]:
    """Return the scenes on disk if all are what would be planned, else nothing."""
    with suppress(DataError, OSError):
        note = read_json(paths.planned(spec.name))
        if note.get("follow_from") == _follow_from(paths, spec):
            scenes = {one: paths.scenes(spec.name, one).read_bytes() for one in virtual}
            if note.get("sha256") == _hashes(scenes):
                return scenes
    return {}


def _hashes(scenes: Mapping[str, bytes]) -> dict[str, str]:
    return {session: sha256_of(content) for session, content in scenes.items()}


def _follow_from(paths: Paths, spec: DatasetSpec) -> str:
    """Return a digest of all that scenes follow from."""
    recipe = recipe_of(paths.dataset(spec.name), spec)
    declared = spec.model_dump(mode="json", include={"name", "recipe", "excitation"})
    code = code_digest(PLANNED_BY), code_digest(*GRIPPER_CODE), SOURCES.origin(recipe.source)
    content = [declared, *code, np.__version__]
    return sha256_of(json.dumps(content, sort_keys=True).encode())
