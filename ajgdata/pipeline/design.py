"""File of a designer's ranges -> table and figure of designs, best first."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import ValidationError

from ajgdata.paths import Paths
from ajgdata.store.files import line_of, read_yaml
from ajgdata.store.sessions import read_dataset
from ajgdata.types import DataError, DatasetSpec, describe, location

if TYPE_CHECKING:
    from ajgdata.design.compare import DesignSpec, Ranking
    from ajgdata.types.table import Table


def read_design(path: Path) -> DesignSpec:
    """Return the designs that a file asks for. Raises DataError with file, line, key and fix."""
    from ajgdata.design.compare import DesignSpec

    content = read_yaml(path)
    try:
        return DesignSpec.model_validate(content)
    except ValidationError as error:
        line = line_of(path, location(error))
        raise describe(error, f"{path}:{line}") from None


def planned(paths: Paths, spec: DesignSpec) -> tuple[dict[str, str], int, float]:
    """Return the settings of each design in words, scenes of each, and CPU seconds of all,
    about; nothing is solved."""
    from ajgdata.design.compare import SCENE_S, designs_of, in_words, scenes_of

    designs = designs_of(spec)
    scenes = scenes_of(spec, _specs(paths))
    said = {name: ", ".join(in_words(one)) or "the default" for name, one in designs.items()}
    return said, scenes, SCENE_S * scenes * len(designs)


def rank_designs(
    paths: Paths,
    spec: DesignSpec,
    folder: Path,
    by: Ranking = "skill",
    progress: Callable[[str], None] = lambda name: None,
) -> tuple[Table, list[Path]]:
    """Compare the designs; return the table, and the files that `folder` now has of it.

    Raises DataError for a setting that no scene allows.
    """
    from ajgdata.design.compare import compare_designs, ranked
    from ajgdata.pipeline.exports import write_csv
    from ajgdata.report.canvas import save_figure, styled
    from ajgdata.report.design_figure import design_figure

    try:
        compared = compare_designs(spec, _specs(paths), progress)
    except ValidationError as error:
        raise describe(error, "a design") from None
    table = ranked(compared, spec, by)
    if not any(row["skill"] is not None for row in table.rows):
        raise DataError("designs", f"none can be read ({table.rows[0]['missing']})", "change them")
    write_csv(folder / "designs.csv", table)
    figures = save_figure(styled(design_figure)(table), folder / "designs")
    return table, [folder / "designs.csv", *figures]


def _specs(paths: Paths) -> dict[str, DatasetSpec]:
    from ajgdata.design.rows import datasets_of

    return {name: read_dataset(paths, name) for name in datasets_of()}
