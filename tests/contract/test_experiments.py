"""Each kind of declared experiment, on made-up spectra with the grasps and labels of its recipe.

What is made up is the sound: a spectrum that tells the label a little, and the grasp. Everything
else is the project's: data sets, labels, groups, tasks and settings as they are declared.
"""

import hashlib
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from ajgdata.acquire.recipe import session_names
from ajgdata.experiments.division import ByModel
from ajgdata.experiments.requests import Request, requests_for
from ajgdata.gripper import SAMPLE_RATE_HZ
from ajgdata.paths import Paths
from ajgdata.pipeline.experiments import run_experiment
from ajgdata.pipeline.planned_grasps import planned_grasps
from ajgdata.store.feature_array import frequency_axis
from ajgdata.store.features import FeatureColumn, FeatureRows, text_column, write_store
from ajgdata.store.sessions import list_datasets, read_dataset
from ajgdata.store.tables import read_measurements
from ajgdata.types.table import Table

PATHS = Paths(Path(__file__).resolve().parents[2])
SPECS = {name: read_dataset(PATHS, name) for name in list_datasets(PATHS)}
SIMULATED = [name for name, spec in SPECS.items() if spec.recipe]
TASKS = [(name, task) for name in SIMULATED for task in SPECS[name].tasks]
#: Each experiment of each task, and those that need recordings, which are not made up here.
ALL = requests_for(SPECS, TASKS)
CHANGED = [request for request in ALL if request.experiment.name == "variants"]
REQUESTS = [request for request in ALL if request.experiment.name != "variants"]


def _branches(request: Request) -> tuple[str, bool, bool]:
    """Return the experiment, and whether it tests on other data sets or withholds values."""
    withholds = bool(SPECS[request.dataset].tasks[request.task].withhold)
    return request.experiment.name, bool(request.other_sets), withholds


#: The first task of each experiment, and of each cross-validation with other parts.
MEASURED = list(
    {
        _branches(request)
        if request.experiment.name == "cross_validation"
        else request.experiment.name: request
        for request in reversed(REQUESTS)
    }.values()
)
STORED = sorted({name for request in MEASURED for name in (request.dataset, *request.other_sets)})
IDS = [f"{request.dataset}-{request.task}-{request.experiment.name}" for request in MEASURED]
HZ = np.linspace(0, 20_000, 24)
#: Of the same kind of result as every other model, at a fraction of the time.
MODEL = "ridge_plain"


def shape_of(text: str) -> np.ndarray:
    """A spectrum (24,) that the text decides."""
    seed = int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "big")
    return np.random.default_rng(seed).normal(size=len(HZ))


@cache
def table(name: str) -> list[dict[str, object]]:
    """One row a recording of a recipe: its names, group and labels."""
    rows = []
    sessions = session_names(SPECS[name].recipe)
    planned = planned_grasps(PATHS.dataset(name), SPECS[name], sessions)
    for session, grasps in zip(sessions, planned, strict=True):
        for grasp in grasps:
            if not grasp.object:
                continue  # a reference: nothing is held, nothing is to be told
            medium = grasp.setup.get("medium", {}).get("kind", "plastic")
            labels = {"object": grasp.object, "medium": medium, **grasp.targets}
            for sample in range(grasp.samples):
                names = {"recording": f"{session}/{grasp.grasp_id}_{sample}"}
                rows.append(names | {"grasp_id": f"{session}/{grasp.grasp_id}"} | labels)
    return rows


@pytest.fixture(scope="session")
def stores(tmp_path_factory) -> dict[str, Path]:
    """A store of every data set that is measured here."""
    paths = Paths(tmp_path_factory.mktemp("stores"))
    return {name: write(paths.features(name), name) for name in STORED}


def write(path: Path, name: str) -> Path:
    rows = table(name)
    targets = SPECS[name].targets
    columns = {key: text_column([str(r[key]) for r in rows]) for key in ("recording", "grasp_id")}
    columns["object"] = text_column([str(r["object"]) for r in rows])
    sessions = [str(r["recording"]).partition("/")[0] for r in rows]
    columns["session_id"] = text_column(sessions)
    level = np.zeros((len(rows), len(HZ)))
    for target, declared in targets.items():
        values = [row[target] for row in rows]
        if declared.kind == "regression":
            number = np.asarray(values, float)
            columns[target] = FeatureColumn(number, {"units": declared.unit})
            level += np.outer((number - number.mean()) / number.std(), shape_of(target))
        else:
            columns[target] = text_column([str(value) for value in values])
            level += [0.5 * shape_of(str(value)) for value in values]
    level += [shape_of(str(row["grasp_id"])) for row in rows]
    level += [0.02 * shape_of(str(row["recording"])) for row in rows]
    attrs = {"data_set": name, "source": "simulated", "git_commit": "", "settings": "{}"}
    write_store(
        path, FeatureRows(np.exp(level).astype(np.float32), (frequency_axis(HZ),), columns, attrs)
    )
    return path


#: Smaller than declared where that takes long.
SMALLER = {
    "learning_curve": lambda s: {"groups": s["groups"][:: len(s["groups"]) - 1], "repeats": 2},
    "cross_gripper": lambda s: {"grasps": sorted({s["grasps"][0], s["grasps"][-1]})},
}
#: Models of experiments that need probabilities.
MODELS = {"sorting": "linear_plain"}


def run(stores: dict[str, Path], request: Request, folder: Path) -> tuple[dict, dict[str, Table]]:
    """Measure an experiment on a store, and return what is stored of it."""
    name = request.experiment.name
    spec = SPECS[request.dataset]
    settings = request.settings.model_dump(mode="json")
    settings |= SMALLER.get(name, lambda _: {})(settings)
    model = MODELS.get(name, MODEL) if isinstance(request.experiment.division, ByModel) else ""
    tables = folder / "tables.json"
    cost = folder / "cost.json"
    run_experiment(
        stores[request.dataset],
        experiment=name,
        parts=[model],
        dataset=request.dataset,
        task=request.task,
        settings=settings,
        task_settings=spec.task_settings(request.task),
        other_sets=list(request.other_sets),
        audio=spec.audio,
        features=spec.features,
        paths=Paths(stores[request.dataset].parents[2]),
        seed=0,
        tables=tables,
        cost=cost,
    )
    about, contents = read_measurements(tables)[0]
    return about, {table.name: table for table in contents}


@pytest.mark.parametrize("case", MEASURED, ids=IDS)
def test_each_experiment_is_made_of_its_task(stores, tmp_path, case):
    about, tables = run(stores, case, tmp_path)
    assert "skipped" not in about
    assert tables["scores"].rows


def test_variants_fit_the_recordings():
    """Recordings last a second; other sounds are played in simulated data sets only."""
    for request in CHANGED:
        spec = SPECS[request.dataset]
        for file in request.settings.files.values():
            for variant in file.all_variants:
                features = variant.change.feature_settings(spec.features)
                assert features.hop <= features.window <= spec.audio.sample_rate_hz
                if variant.change.excitation:
                    assert spec.audio.sample_rate_hz == SAMPLE_RATE_HZ
                    shortest = variant.change.played().length_s * SAMPLE_RATE_HZ
                    assert shortest >= spec.features.window


def test_each_file_of_variants_has_its_task():
    files = {name for request in CHANGED for name in request.settings.files}
    assert files == {file.stem for file in PATHS.variants.glob("*.yaml")}
