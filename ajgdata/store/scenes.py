"""Files of scenes: YAML or JSON, checked by the gripper's own model."""

from __future__ import annotations

from pathlib import Path

from pydantic import ValidationError

from ajgdata.gripper.scene import Scene
from ajgdata.store.files import line_of, read_yaml
from ajgdata.types import describe, place_of


def read_scene(path: Path) -> Scene:
    """The scene in a YAML or JSON file. Raises DataError with file, line, key and fix."""
    content = read_yaml(path)
    try:
        return Scene.model_validate(content)
    except ValidationError as error:
        line = line_of(path, place_of(error))
        raise describe(error, f"{path}:{line}") from None
