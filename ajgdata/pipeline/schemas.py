"""JSON Schemas of dataset.yaml and source.yaml, with which editors complete and explain keys.

The models of `ajgdata.types` decide what is valid; the schemas follow from them. They are in
`datasets/`, so that the address in the first line of the YAML files is the same in each project.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from typing import Any

from pydantic import TypeAdapter

from ajgdata.experiments.registry import EXPERIMENTS
from ajgdata.gripper import Scene, SignalChain
from ajgdata.gripper.grippers import GRIPPERS
from ajgdata.gripper.object_library import OBJECTS
from ajgdata.gripper.objects import Object
from ajgdata.gripper.scene import Grasp
from ajgdata.gripper.variation import Variation
from ajgdata.paths import Paths
from ajgdata.store.files import write_if_changed
from ajgdata.store.sessions import NOT_INHERITED, write_dataset
from ajgdata.store.variants import VARIANTS
from ajgdata.types import CROSS_VALIDATION, MODELS, NAME_PATTERN, DatasetSource, DatasetSpec

Schema = dict[str, Any]
VERSION = "https://json-schema.org/draft/2020-12/schema"


def register_dataset(paths: Paths, spec: DatasetSpec, schema: bytes) -> None:
    """Write dataset.yaml of a new data set, and the schema that its first line names.

    `schema` is that of `dataset_schema`. It takes longer than the rest, so a command that cannot be
    repeated after an interruption makes it before it writes recordings.
    """
    write_if_changed(paths.dataset_schema, schema)
    write_dataset(paths, spec)


def schema_bytes(schema: Schema) -> bytes:
    """Return a schema as JSON, with keys in the order of the models."""
    return (json.dumps(schema, indent=1, ensure_ascii=False) + "\n").encode()


def source_schema() -> Schema:
    """Return the JSON Schema of source.yaml."""
    schema = {"$schema": VERSION, **DatasetSource.model_json_schema()}
    _remove_titles(schema)
    return schema


def dataset_schema() -> Schema:
    """Return the JSON Schema of dataset.yaml.

    It accepts what the models accept, except for numbers and truth values written as text (`"5"`).
    A data set with `from` takes over the other keys of another data set. These keys are therefore
    not required.
    """
    settings = {
        f"experiments.{name}": experiment.settings
        for name, experiment in EXPERIMENTS.items()
        if not experiment.of_embedding and name not in (CROSS_VALIDATION, VARIANTS)
    }
    parts: dict[str, Any] = {
        "dataset": DatasetSpec,
        "scene": Scene,
        "signal": SignalChain,
        "variation": Variation,
        "grasp": Grasp,
        "shape": Object,
    }
    by_key, common = TypeAdapter.json_schemas(
        (key, "validation", TypeAdapter(part)) for key, part in (parts | settings).items()
    )
    schema_of = {key: schema for (key, _), schema in by_key.items()}
    definitions = common["$defs"]
    _add_gripper(definitions, schema_of)
    task = definitions["Task"]["properties"]
    task["models"]["items"] = _one_of(MODELS, {"type": "string", "pattern": NAME_PATTERN.pattern})
    task["experiments"]["properties"] = {
        key.removeprefix("experiments."): schema_of[key] for key in settings
    }

    spec = definitions.pop("DatasetSpec")
    origin = {
        "type": "string",
        "pattern": NAME_PATTERN.pattern,
        "description": "data set whose keys it takes over, except for tasks, embeddings and level: "
        "only differences are declared",
    }
    schema = {
        "$schema": VERSION,
        **spec,
        "properties": {"from": origin, **spec["properties"]},
        "$defs": definitions,
    }
    _remove_titles(schema)
    inherited = [value for key, value in schema["properties"].items() if key not in NOT_INHERITED]
    for name in _mergeable(inherited, definitions):
        definitions[name].pop("required", None)
    for node in _nodes(schema):
        # Without required keys, a value can fit several alternatives.
        if "oneOf" in node:
            node["anyOf"] = node.pop("oneOf")
            node.pop("discriminator", None)
    return schema


def _add_gripper(definitions: Schema, schema_of: Schema) -> None:
    """Describe the keys of a recipe that the virtual gripper checks."""
    scene = definitions["Scene"]["properties"]
    scene["gripper"] = _one_of(GRIPPERS, scene["gripper"])
    scene["object"] = _one_of(OBJECTS, scene["object"])
    recipe = definitions["Recipe"]["properties"]
    recipe["scene"].update(schema_of["scene"])
    recipe["signal"].update(schema_of["signal"])
    recipe["variation"]["anyOf"] = [schema_of["variation"], {"type": "null"}]
    recipe["variants"]["patternProperties"] = {NAME_PATTERN.pattern: schema_of["scene"]}
    item = definitions["RecipeObject"]["properties"]
    item["grasp"].update(schema_of["grasp"])
    item["shape"]["anyOf"] = _one_of(OBJECTS, schema_of["shape"])["anyOf"]


def _one_of(names: Iterable[str], other: Schema) -> Schema:
    """Return the schema of one of several names, or of something else."""
    return {"anyOf": [{"enum": sorted(names)}, other]}


def _remove_titles(schema: Schema) -> None:
    """Remove the titles: pydantic derives them from names of keys, so they add nothing."""
    for node in _nodes(schema):
        if isinstance(node.get("title"), str):
            del node["title"]


def _mergeable(nodes: Iterable[Any], definitions: Schema) -> set[str]:
    """Return the names of the definitions of mappings that `from` joins key by key.

    Elements of lists are not joined, so they are complete.
    """
    names: set[str] = set()
    waiting = list(nodes)
    while waiting:
        for node in _nodes(waiting.pop(), without=("items", "prefixItems")):
            name = node.get("$ref", "").rpartition("/")[2]
            if name and name not in names:
                names.add(name)
                waiting.append(definitions[name])
    return names


def _nodes(node: Any, without: tuple[str, ...] = ()) -> Iterator[Schema]:
    """Yield each mapping of a schema, the outer ones first; the keys `without` are skipped."""
    if isinstance(node, dict):
        yield node
        inner = [value for key, value in node.items() if key not in without]
    elif isinstance(node, list):
        inner = node
    else:
        inner = []
    for value in inner:
        yield from _nodes(value, without)
