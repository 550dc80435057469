"""Files and modules that docstrings and settings name exist."""

import re
import tomllib
from pathlib import Path

from ajgdata.gripper import grippers, object_library
from ajgdata.gripper.scene import Scene

ROOT = Path(__file__).parents[2]


def test_the_files_of_the_mutation_tests_exist():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"][
        "mutmut"
    ]
    named = (
        settings["only_mutate"]
        + settings["pytest_add_cli_args_test_selection"]
        + settings["source_paths"]
        + settings["also_copy"]
    )
    assert [name for name in named if not (ROOT / name).exists()] == []
    (module,) = settings["only_mutate"]
    (tests,) = settings["pytest_add_cli_args_test_selection"]
    imported = module.removesuffix(".py").replace("/", ".")
    assert f"from {imported} import" in (ROOT / tests).read_text(encoding="utf-8")


def test_the_scene_names_the_modules_that_hold_its_names():
    named = dict(re.findall(r"`(\w+)\.([A-Z]+)`", Scene.__doc__))
    assert named == {"grippers": "GRIPPERS", "object_library": "OBJECTS"}
    assert Scene.model_validate({"gripper": "small"}).gripper == grippers.GRIPPERS["small"]
    assert "cube_20p7" in object_library.OBJECTS
