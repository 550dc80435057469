"""The paper's own numbers, which stand beside ours and are never mixed with them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field, ValidationError, field_validator

from ajgdata.types import Name, Strict, describe


class PaperFigure(Strict):
    """One number that the paper reports for the real gripper and real recordings."""

    id: Name
    metric: str
    value: float | None = Field(description="null where the result is not one number")
    unit: str
    text: Annotated[str, Field(min_length=1, description="the result in a few words")]
    where: str = Field(description="the experiment of the paper that it belongs to")
    reached: float | None = Field(
        None, description="where `value` counts what it takes: the score that it takes it for"
    )
    panel: str = Field("", description="title on the first screen; figures of one title share it")
    row: str = Field("", description="name among the figures of its panel")
    source: str = Field("", description="citation; taken from the head of the file")


class _PaperFile(Strict):
    source: Annotated[str, Field(min_length=1)]
    title: str
    authors: str
    url: str
    figures: tuple[PaperFigure, ...] = Field(min_length=1)

    @field_validator("figures")
    @classmethod
    def _distinct(cls, figures: tuple[PaperFigure, ...]) -> tuple[PaperFigure, ...]:
        ids = [figure.id for figure in figures]
        if twice := sorted({name for name in ids if ids.count(name) > 1}):
            raise ValueError(f"listed twice: {', '.join(twice)}")
        return figures


def parse_paper(mapping: Mapping[str, Any], where: object = "paper.yaml") -> dict[str, PaperFigure]:
    """Content of `paper.yaml` -> its figures by id, each with the citation as its `source`.

    Raises DataError, naming `where` and the key, if the content is not what it should be.
    """
    try:
        paper = _PaperFile.model_validate(mapping)
    except ValidationError as error:
        raise describe(error, where) from error
    return {f.id: f.model_copy(update={"source": f.source or paper.source}) for f in paper.figures}
