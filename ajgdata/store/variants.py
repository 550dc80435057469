"""Files `reports/variants/<name>.yaml`: experiments of the tasks whose evaluation they change."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import ValidationError

from ajgdata.paths import Paths
from ajgdata.store.files import line_of, read_model, read_yaml
from ajgdata.types import DataError, describe
from ajgdata.types.documentation import documentation
from ajgdata.types.variants import WITHHELD, Variants

if TYPE_CHECKING:
    from ajgdata.types import DatasetSpec

#: Name of the experiment.
VARIANTS = "variants"
#: Folders of earlier versions.
REPLACED_FOLDERS = ("comparisons", "ablations")


def with_variants(paths: Paths, spec: DatasetSpec) -> DatasetSpec:
    """Return a declaration whose tasks ask for the variants that train on the data set.

    Raises DataError with file, line and fix for a file that is wrong, and for a folder of an
    earlier version.
    """
    _check_folders(paths)
    files: dict[str, dict[str, Variants]] = {}
    for file in sorted(paths.variants.glob("*.yaml")):
        content = read_yaml(file)
        if content.get("train") == spec.name:
            variants = read_model(file, Variants, content)
            _check(file, variants, paths, spec)
            files.setdefault(variants.task, {})[file.stem] = variants
    tasks = dict(spec.tasks)
    for task, by_name in files.items():
        settings = {
            "files": {name: item.model_dump(mode="json") for name, item in by_name.items()},
        }
        experiments = tasks[task].experiments | {VARIANTS: settings}
        tasks[task] = tasks[task].model_copy(update={"experiments": experiments})
    return spec.model_copy(update={"tasks": tasks})


def files_without_data(paths: Paths) -> Iterator[str]:
    """Yield a line for each file that is not measured, because its data set does not exist."""
    for file in sorted(paths.variants.glob("*.yaml")):
        name = read_yaml(file).get("train")
        if not paths.dataset(str(name)).is_file():
            where = f"{file}:{line_of(file, ['train'])}"
            yield f"{where}: skipped, there is no data set {name!r}. Correct the name."


def _check_folders(paths: Paths) -> None:
    """Raise DataError for files in a folder of an earlier version."""
    for name in REPLACED_FOLDERS:
        folder = paths.reports / name
        if any(folder.glob("*.yaml")):
            problem = f"{name} were replaced by variants, which are in {paths.variants}"
            fix = f"move the files there and write them as in {documentation('variants')}"
            raise DataError(folder, problem, fix)


def _check(file: Path, variants: Variants, paths: Paths, spec: DatasetSpec) -> None:
    """Raise DataError for an unknown task or data set, and for impossible features or sounds."""
    for task in (variants.task, *variants.tasks):
        if task not in spec.tasks:
            where = f"{file}:{line_of(file, ['task'])}"
            raise DataError(where, f"there is no task {task!r}", f"name a task of {spec.name}")
    _check_targets(file, variants, spec)
    for name in (*variants.test_sets, *variants.train_sets):
        if not paths.dataset(name).is_file():
            where = f"{file}:{line_of(file, ['test'])}"
            raise DataError(where, f"there is no data set {name!r}", "name a data set")
    _check_withheld(file, variants, spec)
    for variant in variants.all_variants:
        try:
            variant.change.feature_settings(spec.features)
            if variant.change.excitation:
                variant.change.played()
        except ValidationError as error:
            where = f"{file}:{line_of(file, ['variants', variant.name])}, {variant.name}"
            raise describe(error, where) from None


def _check_targets(file: Path, variants: Variants, spec: DatasetSpec) -> None:
    """Raise DataError for tasks with targets of different kinds or units, and for vectors."""
    own, *others = (spec.targets[spec.tasks[t].target] for t in (variants.task, *variants.tasks))
    if own.columns:
        problem = f"the target of the task {variants.task!r} is a vector"
        raise DataError(file, problem, "name a task whose target is one column")
    for target, task in zip(others, variants.tasks, strict=True):
        if (target.kind, target.unit, target.columns) != (own.kind, own.unit, ()):
            problem = f"the target of the task {task!r} has another kind or unit"
            raise DataError(file, problem, f"name a task that is like {variants.task}")


def _check_withheld(file: Path, variants: Variants, spec: DatasetSpec) -> None:
    """Raise DataError for a hypothesis on withheld values of a task that withholds none."""
    for hypothesis in variants.hypotheses:
        for name, tested in hypothesis.sides:
            task = variants.variant(name).change.task or variants.task
            if tested == WITHHELD and not spec.tasks[task].withhold:
                where = f"{file}:{line_of(file, ['hypotheses'])}"
                problem = f"the task {task!r} withholds no values, so none are tested"
                raise DataError(where, problem, "correct `tested` of the hypothesis")
