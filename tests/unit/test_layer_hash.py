"""Results depend on the code of their layer, of the layers below, and on versions of libraries."""

import pytest

from ajgdata.store import provenance
from ajgdata.store.provenance import LAYERS, layer_hash


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A package with a file in some layers, instead of ours."""
    for file in ("gripper/scene.py", "features/spectrum.py", "models/cnn.py", "report/page.py"):
        (tmp_path / file).parent.mkdir(exist_ok=True)
        (tmp_path / file).write_text("x = 1\n")
    monkeypatch.setattr(provenance, "PACKAGE", tmp_path)
    _clear()
    yield tmp_path
    _clear()


def _clear():
    layer_hash.cache_clear()


def changed_layers(change):
    """Return the layers whose hash `change()` changes."""
    before = {layer: layer_hash(layer) for layer in LAYERS}
    change()
    _clear()
    return {layer for layer in LAYERS if layer_hash(layer) != before[layer]}


@pytest.mark.parametrize(
    ("file", "unchanged"),
    [
        ("gripper/scene.py", {"features", "models", "evaluate"}),
        ("features/spectrum.py", {"gripper"}),
        ("models/cnn.py", {"gripper", "features", "acquire", "studies"}),
        ("report/page.py", set(LAYERS) - {"report"}),
    ],
)
def test_an_edit_concerns_its_layer_and_those_above(package, file, unchanged):
    edit = (package / file).write_text
    assert changed_layers(lambda: edit("x = 2\n")) == set(LAYERS) - unchanged


@pytest.mark.parametrize(
    ("library", "unchanged"),
    [
        ("scikit-learn", {"gripper", "features"}),
        ("umap-learn", {"gripper", "features"}),
        ("numpy", set()),
    ],
)
def test_a_new_version_of_a_library_concerns_the_layers_that_use_it(
    package, monkeypatch, library, unchanged
):
    def upgrade():
        real = provenance.version
        newer = lambda name: "99.0" if name == library else real(name)  # noqa: E731
        monkeypatch.setattr(provenance, "version", newer)

    assert changed_layers(upgrade) == set(LAYERS) - unchanged
