"""Modules that docstrings name exist."""

import re
from pathlib import Path

from ajgdata.gripper import grippers, object_library
from ajgdata.gripper.scene import Scene

ROOT = Path(__file__).parents[2]


def test_the_scene_names_the_modules_that_hold_its_names():
    named = dict(re.findall(r"`(\w+)\.([A-Z]+)`", Scene.__doc__))
    assert named == {"grippers": "GRIPPERS", "object_library": "OBJECTS"}
    assert Scene.model_validate({"gripper": "small"}).gripper == grippers.GRIPPERS["small"]
    assert "cube_20p7" in object_library.OBJECTS
