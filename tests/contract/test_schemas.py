"""The JSON Schemas in datasets/ follow from the models, and accept what the models accept."""

import copy
import json
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from ajgdata.paths import Paths
from ajgdata.pipeline.schemas import dataset_schema, schema_bytes, source_schema
from ajgdata.store.files import read_yaml
from ajgdata.store.sessions import SCHEMA_LINE, read_declaration

PATHS = Paths(Path(__file__).resolve().parents[2])
DECLARED = sorted(PATHS.datasets.glob("*/dataset.yaml"))
SOURCES = sorted(PATHS.datasets.glob("*/source.yaml"))
DATASET = Draft202012Validator(dataset_schema())
SOURCE = Draft202012Validator(source_schema())


def errors(schema: Draft202012Validator, content: object) -> list[str]:
    return [f"{error.json_path}: {error.message}" for error in schema.iter_errors(content)]


@pytest.mark.parametrize(
    ("file", "schema"),
    [(PATHS.dataset_schema, dataset_schema()), (PATHS.source_schema, source_schema())],
    ids=["dataset", "source"],
)
def test_committed_schemas_are_what_make_docs_writes(file, schema):
    Draft202012Validator.check_schema(schema)
    assert file.read_bytes() == schema_bytes(schema)


@pytest.mark.parametrize("file", DECLARED, ids=lambda file: file.parent.name)
def test_declarations_name_the_schema_and_keep_to_it(file):
    first, _ = file.read_text().split("\n", 1)
    assert first == SCHEMA_LINE
    assert (file.parent / first.partition("$schema=")[2]).resolve() == PATHS.dataset_schema
    assert errors(DATASET, read_yaml(file)) == []


@pytest.mark.parametrize("file", DECLARED, ids=lambda file: file.parent.name)
def test_the_schema_accepts_all_keys_with_their_values(file):
    content = json.loads(read_declaration(file).model_dump_json())
    assert errors(DATASET, content) == []


@pytest.mark.parametrize("file", SOURCES, ids=lambda file: file.parent.name)
def test_sources_name_their_schema_and_keep_to_it(file):
    first, _ = file.read_text().split("\n", 1)
    assert (file.parent / first.partition("$schema=")[2]).resolve() == PATHS.source_schema
    assert errors(SOURCE, read_yaml(file)) == []


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("licens",), "CC0-1.0"),
        (("tasks", "object", "fold"), 5),
        (("tasks", "object", "folds"), 1),
        (("tasks", "object", "experiments", "novel_objects", "model"), "cnn"),
        (("targets", "object", "kind"), "class"),
        (("features", "window_shape"), "triangle"),
        (("recipe", "scene", "mediums"), {}),
        (("recipe", "scene", "medium"), {"kind": "sand"}),
        (("recipe", "signal", "noise"), 3),
        (("recipe", "variation", "session", "jig"), 3),
    ],
    ids=lambda value: ".".join(value) if isinstance(value, tuple) else "",
)
def test_the_schema_finds_mistakes(place, value):
    content = copy.deepcopy(read_yaml(PATHS.dataset("ycb")))
    inner = content
    for key in place[:-1]:
        inner = inner.setdefault(key, {})
    inner[place[-1]] = value
    assert errors(DATASET, content) != []


def test_names_of_own_models_and_experiments_are_accepted():
    task = {"target": "mass", "models": ["own"], "experiments": {"own": {"count": 3}}}
    targets = {"mass": {"kind": "regression"}}
    assert errors(DATASET, {"name": "d", "targets": targets, "tasks": {"mass": task}}) == []


def test_a_task_needs_its_target_and_a_derived_data_set_only_what_differs():
    assert errors(DATASET, {"name": "d", "tasks": {"mass": {}}}) != []
    assert errors(DATASET, {"name": "d", "from": "ycb", "recipe": {"sessions": 2}}) == []


def test_every_key_has_a_description_except_those_of_the_scene():
    definitions = DATASET.schema["$defs"]
    models = [DATASET.schema, *(definitions[name] for name in ("Task", "Embedding", "Recipe"))]
    keys = [item for model in models for item in model["properties"].items()]
    assert [key for key, schema in keys if not schema.get("description")] == []
