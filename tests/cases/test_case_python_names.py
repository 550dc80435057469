"""Names in Python: completion by the tab key, misspelt data sets, and short descriptions."""

import subprocess
import sys

import numpy as np
import pytest

import ajgdata as package
from ajgdata.evaluate.novelty import NoveltyGuard
from ajgdata.loading import Part
from ajgdata.types import DataError


@pytest.fixture
def three(paths):
    """Three data sets without recordings."""
    for name in ("mine", "stones", "Cubes"):
        path = paths.dataset(name)
        path.parent.mkdir(parents=True)
        path.write_text(f"name: {name}\n", encoding="utf-8")
    return paths


def refused(name: str, paths) -> str:
    with pytest.raises(DataError) as error:
        package.load_features(name, paths.root)
    return str(error.value)


@pytest.mark.parametrize(
    ("name", "proposed"),
    [
        ("minee", "Use one of mine."),
        ("MINE", "Use one of mine."),
        ("cube", "Use one of Cubes."),
        ("xyz", "Use one of Cubes, mine, stones."),  # none is similar
    ],
)
def test_a_misspelt_data_set_is_answered_by_the_nearest_names(three, ajgdata, name, proposed):
    said = refused(name, three)
    assert said == f"{three.dataset(name)}: no such data set. {proposed}"
    printed = ajgdata("check", name)
    assert (printed.code, printed.err.count("\n")) == (1, 1)
    assert proposed in printed.text


def test_a_data_set_without_features_is_answered_by_the_command_that_computes_them(three):
    assert refused("mine", three).endswith("does not exist yet. Run `ajgdata run mine` first.")


def test_an_empty_project_is_answered_by_the_command_that_adds_a_data_set(paths):
    assert "Add a data set with `ajgdata import FOLDER`" in refused("mine", paths)


def test_completion_lists_the_public_names_and_imports_nothing():
    listed = dir(package)
    assert {*package.__all__, "tutorial"} <= {*listed}
    assert all(hasattr(package, name) for name in listed)
    code = "import ajgdata, sys; dir(ajgdata); print('numpy' in sys.modules)"
    printed = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert printed.stdout == "False\n"


def test_descriptions_state_sizes_and_no_arrays():
    generator = np.random.default_rng(0)
    grasps = np.arange(12) // 2
    guard = NoveltyGuard.from_grasps(generator.uniform(1, 2, (12, 500)).astype(np.float32), grasps)
    assert repr(guard) == "<NoveltyGuard: 6 grasps, 0 references, 500 bins, no threshold>"
    x = np.zeros((12, 500), np.float32)
    part = Part(x, np.zeros(12), grasps, grasps.astype(str), ())
    assert repr(part) == "<Part: 12 recordings of 6 groups, 500 bins>"
