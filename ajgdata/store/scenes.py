"""Files of scenes: YAML or JSON, checked by the gripper's own model."""

from __future__ import annotations

from pathlib import Path

from pydantic import ValidationError

from ajgdata.gripper.scene import Scene
from ajgdata.store.files import read_yaml
from ajgdata.types import describe


def read_scene(path: Path) -> Scene:
    """The scene in a YAML or JSON file (JSON is YAML). Raises DataError with file, key and fix."""
    content = read_yaml(path)
    try:
        return Scene.model_validate(content)
    except ValidationError as error:
        raise describe(error, path) from None
