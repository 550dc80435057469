"""Missing packages of extras: one line with the command that installs them."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from worlds import assert_one_line

from ajgdata.models import make_model
from ajgdata.models.cnn import CnnClassifier
from ajgdata.models.device import training_on
from ajgdata.pipeline.jobs import run_job
from ajgdata.pipeline.plan import plan, requested_models
from ajgdata.store.code_hash import code_hash
from ajgdata.store.models import read_estimator, write_estimator
from ajgdata.types import DataError, extras
from ajgdata.types.extras import missing_packages, optional_packages, packages_of, require_extra
from ajgdata.types.registry import TRUSTED_TYPES

#: A program of a user without extras. The modules of their packages cannot be imported.
LIGHT_PROGRAM = """
import sys

OPTIONAL = {
    "av", "frictionless", "jinja2", "llvmlite", "markupsafe", "matplotlib", "mlcroissant", "numba",
    "onnx", "onnxruntime", "onnxscript", "pyarrow", "snakemake", "sounddevice", "sse_starlette",
    "starlette", "torch", "umap", "uvicorn",
}

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in OPTIONAL:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Absent())

import numpy as np
import ajgdata
from ajgdata.cli.project import diagnostics

with ajgdata.tutorial.load_features("ycb") as features:
    grasps = features.session_id.values + features.grasp_id.values
    result = ajgdata.cross_validate(
        features.feature.values, features.object.values, grasps,
        kind="classification", model="linear_plain",
    )
score = ajgdata.estimate_score(result, grasps)
assert ajgdata.spectrum(np.sin(np.arange(44_100)), 44_100).shape == (1025,)
assert "numpy" in diagnostics(None)["packages"]
print(score.value > 2 * score.chance)
"""


@pytest.fixture
def absent(monkeypatch):
    """Make a package look as if it were not installed."""

    def make(package: str) -> None:
        installed = extras.installed_version

        def version(name: str) -> str:
            return "" if name == package else installed(name)

        monkeypatch.setattr(extras, "installed_version", version)

    return make


def block_torch(monkeypatch) -> None:
    """Let no module of torch be imported; the module that uses it is imported again."""
    for name in list(sys.modules):
        if name.partition(".")[0] == "torch" or name == "ajgdata.models.cnn":
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "torch", None)


def test_simulate_includes_the_packages_of_the_workflow():
    assert {"numba", "snakemake", "matplotlib"} <= set(packages_of("simulate"))
    assert packages_of("cnn") == ["torch", "umap-learn"]
    assert packages_of("no such extra") == []


def test_a_missing_package_is_named_with_the_command_that_installs_it(absent):
    require_extra("live", "--dashboard")
    absent("sse-starlette")
    assert missing_packages("live") == ["sse-starlette"]
    with pytest.raises(DataError) as raised:
        require_extra("live", "--dashboard")
    assert str(raised.value) == (
        '--dashboard: sse-starlette is not installed. Run `pip install "ajgdata[live]"`.'
    )


@pytest.mark.parametrize(
    ("module", "package", "extra"),
    [
        ("torch.nn", "torch", "cnn"),
        ("umap", "umap-learn", "cnn"),
        ("numba", "numba", "simulate"),
        ("markdown_it.tree", "markdown-it-py", "workflow"),
        ("sse_starlette.sse", "sse-starlette", "live"),
        ("onnx", "onnx", "export"),
    ],
)
def test_an_import_error_becomes_one_line(module, package, extra):
    with pytest.raises(DataError) as raised, optional_packages("here"):
        raise ModuleNotFoundError(name=module)
    assert raised.value.problem == f"{package} is not installed"
    assert raised.value.fix == f'run `pip install "ajgdata[{extra}]"`'


@pytest.mark.parametrize("name", ["numpy", "ajgdata.nothing", "torchvision", None])
def test_other_import_errors_are_not_changed(name):
    with pytest.raises(ModuleNotFoundError), optional_packages("here"):
        raise ModuleNotFoundError(name=name)


def test_a_network_names_its_extra(monkeypatch):
    block_torch(monkeypatch)
    with pytest.raises(DataError, match=r'model cnn: torch .*"ajgdata\[cnn\]"'):
        make_model("cnn", "regression")
    make_model("linear", "regression")


def test_a_stored_network_names_its_extra(monkeypatch, tmp_path):
    features = np.random.default_rng(0).random((12, 64), np.float32)
    network = CnnClassifier(epochs=1, min_steps=1).fit(features, np.arange(12) % 2)
    write_estimator(tmp_path, network)
    block_torch(monkeypatch)
    with pytest.raises(DataError, match=r'torch is not installed.*"ajgdata\[cnn\]"'):
        read_estimator(tmp_path, TRUSTED_TYPES)


def test_the_setting_auto_needs_no_torch(monkeypatch):
    for module in ("ajgdata.types.extras", "ajgdata.models.device"):
        monkeypatch.setattr(f"{module}.installed_version", lambda package: "")
    with training_on("auto"):
        pass
    with (
        pytest.raises(DataError, match=r"device=cuda: torch is not installed"),
        training_on("cuda"),
    ):
        pass


@pytest.mark.parametrize(
    ("arguments", "package", "extra"),
    [
        (["run", "d"], "snakemake", "workflow"),
        (["status"], "matplotlib", "workflow"),
        (["simulate", "d"], "numba", "simulate"),
        (["scene", "d", "cube"], "numba", "simulate"),
        (["publish", "d"], "mlcroissant", "publish"),
        (["export", "d", "t"], "onnx", "export"),
    ],
)
def test_a_command_without_its_extra_prints_one_line(ajgdata, absent, arguments, package, extra):
    absent(package)
    code, out, err = ajgdata(*arguments)
    assert (code, out) == (1, "")
    assert_one_line(err, f'{package} is not installed. Run `pip install "ajgdata[{extra}]"`.')


def without_numba() -> None:
    raise ModuleNotFoundError(name="numba")


def test_a_command_that_fails_at_an_import_prints_one_line(ajgdata, monkeypatch):
    monkeypatch.setattr("ajgdata.pipeline.validate.validate_dataset", lambda *_: without_numba())
    code, _, err = ajgdata("check", "d")
    assert code == 1
    assert_one_line(err, 'ajgdata check: numba is not installed. Run `pip install "ajgdata[simul')


class Named(dict):
    """Values by name, which are attributes also, as Snakemake has them."""

    __getattr__ = dict.__getitem__


def test_a_job_without_a_package_ends_with_one_line(tmp_path, monkeypatch):
    monkeypatch.setattr("ajgdata.pipeline.studies.run_study", without_numba)
    log = tmp_path / "job.log"
    job = SimpleNamespace(
        rule="study",
        params=Named(function="studies:run_study"),
        input=Named(),
        output=Named(),
        wildcards=Named(),
        log=[str(log)],
        threads=1,
    )
    with pytest.raises(SystemExit) as ended:
        run_job(job)
    line = 'rule study: numba is not installed. Run `pip install "ajgdata[simulate]"`.'
    assert ended.value.code == line
    assert log.read_text() == f"{line}\n"


@pytest.mark.parametrize(
    ("keys", "package", "message"),
    [
        ({"models": ["linear", "cnn"]}, "torch", r"model cnn: torch .*ajgdata\[cnn\]"),
        ({"models": ["linear"]}, "torch", ""),
        ({"models": ["linear"]}, "umap-learn", ""),
    ],
)
def test_a_run_names_the_missing_extra_of_a_model_first(project, absent, keys, package, message):
    project.session()
    project.declare(tasks={"edge": {"target": "edge_mm", **keys}})
    absent(package)
    assert list(plan(project.paths)) == ["d"]  # only the main process checks
    if message:
        with pytest.raises(DataError, match=message):
            plan(project.paths, check=True)
    else:
        plan(project.paths, check=True)


@pytest.mark.parametrize(
    ("target", "is_refused"),
    [
        ("results/models/d/edge/knn", False),
        ("results/models/d/edge/cnn", True),
        ("results/features/d.nc", False),
        ("everything", True),
    ],
)
def test_only_requested_models_need_their_extra(project, absent, target, is_refused):
    project.session()
    project.declare(tasks={"edge": {"target": "edge_mm", "models": ["knn", "cnn"]}})
    absent("torch")
    models = requested_models([target])
    if is_refused:
        with pytest.raises(DataError, match="model cnn: torch"):
            plan(project.paths, check=True, models=models)
    else:
        plan(project.paths, check=True, models=models)


def test_a_run_names_the_missing_extra_of_a_recipe_first(project, absent):
    project.declare(
        recipe={
            "grasps_per_object": 1,
            "objects": [{"name": "cube", "shape": {"kind": "cube", "edge_mm": 20}}],
        }
    )
    absent("numba")
    with pytest.raises(DataError, match=r"dataset.yaml: recipe: numba .*ajgdata\[simulate\]"):
        plan(project.paths, check=True)


def test_the_hash_of_features_does_not_depend_on_packages_of_extras(absent, monkeypatch):
    code_hash.cache_clear()
    before = code_hash("features"), code_hash("acquire"), code_hash("train")
    for package in ("numba", "torch", "umap-learn"):
        absent(package)
    monkeypatch.setattr("ajgdata.store.code_hash.installed_version", extras.installed_version)
    code_hash.cache_clear()
    after = code_hash("features"), code_hash("acquire"), code_hash("train")
    code_hash.cache_clear()
    assert [old == new for old, new in zip(before, after, strict=True)] == [True, False, False]


def test_features_scores_and_diagnostics_need_no_extra(run_python):
    assert run_python(LIGHT_PROGRAM) == "True\n"
