"""Write docs/configuration.md and the schemas in datasets/ from the models; part of `make docs`."""

import builtins
import json
import typing
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import yaml
from pydantic import AfterValidator, BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from ajgdata import gripper
from ajgdata.experiments.registry import EXPERIMENTS
from ajgdata.gripper.variation import Variation
from ajgdata.paths import Paths
from ajgdata.pipeline.schemas import dataset_schema, schema_bytes, source_schema
from ajgdata.store.variants import VARIANTS
from ajgdata.types import (
    CROSS_VALIDATION,
    MODELS,
    DatasetSource,
    DatasetSpec,
    Recording,
    Session,
)
from ajgdata.types.features import SHIPPED, FeatureKind
from ajgdata.types.protocol import SortPlan
from ajgdata.types.variants import Variants

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "configuration.md"
SCHEMAS = {
    Paths(ROOT).dataset_schema: dataset_schema,
    Paths(ROOT).source_schema: source_schema,
}
Model = type[BaseModel]
#: What people write, and where.
FILES: dict[str, Model] = {
    "datasets/&lt;name&gt;/dataset.yaml": DatasetSpec,
    "datasets/&lt;name&gt;/source.yaml": DatasetSource,
    "reports/variants/&lt;name&gt;.yaml": Variants,
    "session.yaml": Session,
    "recordings.csv": Recording,
    "PLAN.yaml of `ajgdata sort`": SortPlan,
}
#: Settings of a task's `experiments`, by their names.
MEASURED: dict[str, Model] = {
    f"`tasks.<name>.experiments.{name}`": EXPERIMENTS[name].settings
    for name in EXPERIMENTS
    if not EXPERIMENTS[name].of_embedding and name not in (CROSS_VALIDATION, VARIANTS)
}
#: Parts of `scene`, `signal` and `variation` of a recipe.
SCENES: dict[str, Model] = {
    "Scene": gripper.Scene,
    "Signal chain": gripper.SignalChain,
    "Variation": Variation,
}
UNITS = {
    "mm": "mm",
    "deg": "degrees",
    "hz": "Hz",
    "pa": "Pa",
    "s": "s",
    "db": "dB",
    "dba": "dB(A)",
    "m2": "m²",
    "m3": "m³",
    "c": "°C",
}


def models_in(annotation: object) -> list[Model]:
    """Models that a type mentions, in order."""
    if annotation is FeatureKind:
        return [*SHIPPED]
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [m for part in typing.get_args(annotation) for m in models_in(part)]


def nested(roots: Mapping[str, Model]) -> Iterator[tuple[str, Model]]:
    """Yield each model once, with the title of its section: the roots, then nested models."""
    waiting = list(roots.items())
    known = set()
    while waiting:
        title, model = waiting.pop(0)
        if model in known:
            continue
        known.add(model)
        yield title, model
        inner = [
            (f"{model.__name__}: `{key}`" if title not in roots else f"`{key}`", part)
            for key, field in model.model_fields.items()
            for part in models_in(field.annotation)
        ]
        waiting = [(f"{t} ({m.__name__})", m) for t, m in inner] + waiting


def type_of(field: FieldInfo) -> str:
    """A type as people read it."""
    models = models_in(field.annotation)
    if models:
        several = "mapping of " if typing.get_origin(field.annotation) is dict else ""
        return several + " or ".join(dict.fromkeys(m.__name__ for m in models))
    return _named(field.metadata) or _type_text(field.annotation)


PLAIN: dict[object, str] = {
    str: "text",
    int: "whole number",
    float: "number",
    bool: "true or false",
    type(None): "null",
}


def _type_text(annotation: object) -> str:
    parts = typing.get_args(annotation)
    match typing.get_origin(annotation):
        case typing.Literal:
            text = ", ".join(f"`{part}`" for part in parts)
        case typing.Annotated:
            text = _named(parts[1:]) or _type_text(parts[0])
        case builtins.dict:
            text = f"mapping to {_type_text(parts[1])}"
        case builtins.tuple if parts[-1] is Ellipsis:
            text = f"list of {_type_text(parts[0])}"
        case builtins.tuple:
            text = f"list of {len(parts)}: {', '.join(map(_type_text, parts))}"
        case None:
            text = PLAIN.get(annotation, "any")
        case _:
            text = " or ".join(dict.fromkeys(map(_type_text, parts)))
    return text


def _named(metadata: Sequence[object]) -> str:
    """Return the names of models if a value must be one of them, else ""."""
    if AfterValidator(MODELS.checked) in metadata:
        return ", ".join(f"`{name}`" for name in MODELS)
    return ""


def default_of(field: FieldInfo) -> str:
    """Return the default of a key as text."""
    default = field.get_default(call_default_factory=True)
    if default is PydanticUndefined:
        return "required"
    if isinstance(default, BaseModel):
        if not default.model_fields_set:
            return "its defaults"
        default = default.model_dump(mode="json", exclude_defaults=True)
        return f"`{json.dumps(default)}`" if default else "its defaults"
    if default in ("", (), {}):
        return "none"
    return f"`{json.dumps(default, ensure_ascii=False, default=_as_written)}`"


def _as_written(model: BaseModel) -> dict[str, object]:
    return model.model_dump(mode="json", exclude_defaults=True)


def meaning_of(key: str, field: FieldInfo) -> str:
    """The description; of a scene's key that has none, its name in words with its unit."""
    if field.description:
        return field.description
    words = key.split("_")
    last = words[-1]
    if len(words) > 1 and last in UNITS:
        return f"{' '.join(words[:-1])} in {UNITS[last]}"
    return " ".join(words)


def table(model: Model) -> list[str]:
    """The keys of a model, required keys first."""
    rows = ["| key | value | default | meaning |", "|---|---|---|---|"]
    fields = sorted(model.model_fields.items(), key=lambda item: not item[1].is_required())
    for key, field in fields:
        cells = [f"`{key}`", type_of(field), default_of(field), meaning_of(key, field)]
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return rows


def workflow_table() -> list[str]:
    """The keys of the workflow's own settings."""
    schema = yaml.safe_load((ROOT / "workflow/schemas/config.schema.yaml").read_text())
    rows = ["| key | default | meaning |", "|---|---|---|"]
    for key, setting in schema["properties"].items():
        default = json.dumps(setting["default"])
        meaning = " ".join(setting["description"].split())
        rows.append(f"| `{key}` | `{default}` | {meaning} |")
    return rows


def page() -> str:
    """The whole page."""
    lines = [
        "# Configuration",
        "",
        "All keys with their defaults. `make docs` generates this page from the models of the "
        "settings. Unknown keys are errors.",
        "",
        "Editors with yaml-language-server, such as VS Code with the extension *YAML*, complete "
        "and explain the keys of `dataset.yaml`. The first line of the file names the schema: "
        "`# yaml-language-server: $schema=../dataset.schema.json`.",
        "",
        "## Workflow",
        "",
        "The defaults are in `config/config.yaml`. To change keys for a run: "
        "`snakemake --config 'datasets=[size]' seed=1`.",
        "",
        *workflow_table(),
    ]
    for roots, level in ((FILES, 2), (MEASURED, 2), (SCENES, 2)):
        for title, model in nested(roots):
            heading = "#" * (level if title in roots else level + 1)
            text = " ".join((model.__doc__ or "").split("\n\n")[0].split())
            lines += ["", f"{heading} {title}", "", *([text, ""] if text else []), *table(model)]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    for file, schema in SCHEMAS.items():
        file.write_bytes(schema_bytes(schema()))
