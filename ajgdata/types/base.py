"""The base class of all settings, and errors of settings in one line."""

from __future__ import annotations

import re
import reprlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, ValidationError

from ajgdata.types.errors import DataError
from ajgdata.types.names import NAME_PATTERN, NAME_RULE
from ajgdata.types.replaced_keys import replacement

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

ModelType = TypeVar("ModelType", bound=BaseModel)


class Strict(BaseModel):
    """Base class of all settings: unknown keys are errors, and instances are immutable."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def distinct(values: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return `values`. Raises ValueError if two values, or the names of two values, are equal."""
    if len({getattr(value, "name", value) for value in values}) < len(values):
        raise ValueError("lists one twice")
    return values


#: Rule for tuples of settings: no value is listed twice.
Distinct = AfterValidator(distinct)


def checked(model: type[ModelType], where: object, content: Mapping[str, Any]) -> ModelType:
    """Return settings of the class `model` with this content.

    Raises DataError with `where`, key, value and fix.
    """
    try:
        return model.model_validate(content)
    except ValidationError as error:
        raise describe(error, where) from None


def overridden(base: dict[str, Any], by: dict[str, Any]) -> dict[str, Any]:
    """Return `base` with the values of `by`. A mapping in both is overridden key by key.

    >>> overridden({"stft": {"hop": 512, "window": 2048}}, {"stft": {"hop": 128}})
    {'stft': {'hop': 128, 'window': 2048}}
    """
    result = dict(base)
    for key, value in by.items():
        old = result.get(key)
        if isinstance(old, dict) and isinstance(value, dict):
            result[key] = overridden(old, value)
        else:
            result[key] = value
    return result


def location(error: ValidationError) -> tuple[int | str, ...]:
    """Return the keys that lead to the value in the message of `describe`."""
    return _most_useful_first(error)[0]["loc"]


def describe(error: ValidationError, where: object) -> DataError:
    """Return an error of pydantic as one line: `where`, key, value and fix of the first error."""
    first, *remaining = _most_useful_first(error)
    place = first["loc"]
    # pydantic reports one error per type that a value may have. One message lists all types.
    alternatives = []
    if place and re.fullmatch(r"float|str|(constrained-)?int|.*\[.*\]", str(place[-1])):
        place = place[:-1]
        alternatives = [e for e in remaining if e["loc"][:-1] == place]
    key = " ".join(".".join(str(part) for part in place).split())
    n_more = len(remaining) - len(alternatives)
    suffix = f" (and {n_more} more)" if n_more else ""
    if first["type"] == "extra_forbidden":
        replaced = replacement(first["loc"], first["input"], error.title)
        if replaced is not None:
            problem, fix = replaced
            return DataError(where, problem, fix)
        return DataError(where, f"unknown key {key}{suffix}", "correct its spelling or remove it")
    if first["type"] == "union_tag_not_found":
        discriminator = first["ctx"]["discriminator"].strip("'")
        key = f"{key}.{discriminator}"
    if first["type"] in ("missing", "union_tag_not_found"):
        return DataError(where, f"{key} is missing{suffix}", f"add {key}")
    value = "" if isinstance(first["input"], dict) else f" = {reprlib.repr(first['input'])}"
    messages = [_message(first, "Value error, ")]
    messages += [_message(alternative, "Input should be ") for alternative in alternatives]
    problem = f"{key or 'content'}{value}: {' or '.join(messages)}{suffix}"
    return DataError(where, problem, "correct the value")


def _most_useful_first(error: ValidationError) -> list[ErrorDetails]:
    """Return errors on unknown keys, then all other errors.

    A misspelt key causes two errors: an unknown key, and often a missing key.
    """
    return sorted(error.errors(), key=lambda details: details["type"] != "extra_forbidden")


def _message(error: ErrorDetails, without: str) -> str:
    """Return the message of one error, without the words `without` at its beginning."""
    if (
        error["type"] == "string_pattern_mismatch"
        and error["ctx"]["pattern"] == NAME_PATTERN.pattern
    ):
        return f"Names are {NAME_RULE}"
    return error["msg"].removeprefix(without)
