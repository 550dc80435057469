"""The report of `ajgdata device check` that a session keeps: of the same card."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ajgdata.acquire.card import CardSettings
from ajgdata.acquire.card_check import Advice
from ajgdata.store.files import read_json
from ajgdata.types import DataError, describe


class _Device(CardSettings):
    """A card as its report names it, with what the driver said of it."""

    model_config = ConfigDict(extra="allow")


class _Report(BaseModel):
    """What a report (`CardCheck.summary`) must hold; it holds more."""

    model_config = ConfigDict(allow_inf_nan=False)
    device: _Device
    peak_dbfs: float
    latency_samples: tuple[int, ...] = Field(min_length=1)
    verdict: tuple[Advice, ...] = Field(min_length=1)


def kept_check(
    path: Path, settings: CardSettings, warn: Callable[[str], object]
) -> Mapping[str, Any]:
    """Return the report at `path`; `warn` is told what is *bad* in it.

    Raises DataError if it is no report, or one of another device, rate or channel.
    """
    content = read_json(path)
    again = f'make it anew: ajgdata device check "{settings.device}" --json {path}'
    try:
        report = _Report.model_validate(content)
    except ValidationError as error:
        problem = f"is no report of `ajgdata device check` ({describe(error, path).problem})"
        raise DataError(path, problem, again) from None
    for key, now in settings.model_dump(exclude={"attempts"}).items():
        if (was := getattr(report.device, key)) != now:
            raise DataError(path, f"is of another setup: {key} was {was}, is {now}", again)
    for advice in report.verdict:
        if advice.level == "bad":
            warn(f"{path}: {advice.said}; {advice.fix}")
    return dict(content)
