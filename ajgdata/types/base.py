"""Names, complaints in one line, and the strict model that every declaration is made of."""

from __future__ import annotations

import dataclasses
import errno
import re
import reprlib
from collections.abc import Collection, Iterable, Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from ajgdata.types.registry import MODELS
from ajgdata.types.replaced_keys import replacement

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

ModelType = TypeVar("ModelType", bound=BaseModel)
#: Names are parts of file names, several of which are joined.
LONGEST_NAME = 100
NAME_PATTERN = re.compile(rf"^[A-Za-z0-9][A-Za-z0-9_-]{{0,{LONGEST_NAME - 1}}}$")
_NAME_RULE = (
    f"letters, digits, _ and -, up to {LONGEST_NAME} characters, the first a letter or digit"
)
#: The same part 20 times at the end of a name: Snakemake refuses to run a job with this name.
_REPEATED_PART = re.compile(r"(.+)\1{19}$")


def without_repeated_part(name: str) -> str:
    """Return a name. Raises ValueError if it ends with the same part 20 times."""
    if repeated := _REPEATED_PART.search(name):
        raise ValueError(f"ends with {repeated[1]!r} 20 times, which Snakemake refuses")
    return name


Name = Annotated[
    str,
    Field(pattern=NAME_PATTERN.pattern, description="letters, digits, _ and -"),
    AfterValidator(without_repeated_part),
]
ModelName = Annotated[Name, AfterValidator(MODELS.checked)]


def distinct(values: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return values, or objects with names. Raises ValueError if two are equal."""
    if len({getattr(value, "name", value) for value in values}) < len(values):
        raise ValueError("lists one twice")
    return values


Distinct = AfterValidator(distinct)


class DataError(Exception):
    """An error in the data, in one line: where, what is wrong, and what to do.

    `problem` and `fix` are clauses without a full stop; `fix` begins with a verb.
    """

    def __init__(self, where: object, problem: str, fix: str) -> None:
        super().__init__(f"{where}: {problem}. {sentence(fix)}")
        self.where, self.problem, self.fix = str(where), problem, fix

    def __reduce__(self) -> tuple[type[DataError], tuple[str, str, str]]:
        """Comes back whole from another process, which the joined text alone would not."""
        return type(self), (self.where, self.problem, self.fix)


def sentence(clause: str) -> str:
    """Return a clause as a sentence: with a capital letter and a full stop."""
    return f"{clause[:1].upper()}{clause[1:]}."


def many(count: int, noun: str) -> str:
    """Return `1 job` or `2,000 jobs`."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


def checked_name(name: str, what: str = "data set") -> str:
    """Return a name. Raises DataError if no file could have it."""
    if NAME_PATTERN.fullmatch(name) and not _REPEATED_PART.search(name):
        return name
    rule = _NAME_RULE
    if NAME_PATTERN.fullmatch(name):
        rule = "a name that does not end with the same part 20 times: Snakemake refuses it"
    raise DataError(reprlib.repr(name), f"is not a valid name of a {what}", f"use {rule}")


#: What helps against errors of the operating system.
_FIXES = {
    errno.EACCES: "change its permissions, or use an account that has them",
    errno.EROFS: "use a disk that can be written",
    errno.ENOSPC: "free some space on its disk",
    errno.EDQUOT: "free some space, or ask for a larger quota",
}


def one_line(error: DataError | OSError | MemoryError) -> str:
    """Describe an error in one line: file, problem and fix."""
    if isinstance(error, MemoryError):
        return "Not enough memory. Use fewer --cores, or close other programs."
    if isinstance(error, OSError) and error.strerror:
        fix = _FIXES.get(error.errno or 0, "check this file and its disk")
        name = error.filename or "a file"
        if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EROFS) and error.filename2:
            name = error.filename2  # of a copy, the target has no space, not the source
        return f"{name}: {error.strerror}. {sentence(fix)}"
    return " ".join(str(error).split())


class NotPossibleError(ValueError):
    """What the data lack for a measurement, in a line: it is skipped, and the run continues.

    Any other ValueError is a mistake in the code, and a failure of its job.
    """


#: Levels of issues, the worst first.
ISSUE_LEVELS = ("error", "warning", "note")
#: The recording_id of an issue of a whole session, and the session_id of an issue of a data set.
WHOLE = "*"


@dataclasses.dataclass(frozen=True, order=True)
class Finding:
    """A check's verdict on one recording (or, with recording_id `*`, on a whole session).

    `level` is *error* (unusable: the recording is quarantined), *warning* (used, but somebody
    should look) or *note* (unusual and fine). `code` is a stable slug such as `truncated`.
    """

    session_id: str
    recording_id: str
    file: str
    level: Literal["error", "warning", "note"]
    code: str
    problem: str
    fix: str

    @property
    def leaves_out(self) -> bool:
        """True if the recording is not in the feature store."""
        return self.level == "error" or self.code in ("copy", "rejected")


def left_out(findings: Iterable[Finding]) -> set[tuple[str, str]]:
    """Return session_id and recording_id of what is not in the feature store, each once."""
    return {(f.session_id, f.recording_id) for f in findings if f.leaves_out}


def flagged(findings: Collection[Finding]) -> set[tuple[str, str]]:
    """Return session_id and recording_id of what is used and not without remark, each once."""
    return {(f.session_id, f.recording_id) for f in findings} - left_out(findings)


class Strict(BaseModel):
    """Base of every model: unknown keys are errors, instances are immutable."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def _most_useful_first(error: ValidationError) -> list[ErrorDetails]:
    """Return unknown keys, then all other errors: a misspelt key is often missing as well."""
    return sorted(error.errors(), key=lambda details: details["type"] != "extra_forbidden")


def location(error: ValidationError) -> tuple[int | str, ...]:
    """Return the keys that lead to the value of which `describe` reports the error."""
    return _most_useful_first(error)[0]["loc"]


def describe(error: ValidationError, where: object) -> DataError:
    """Return one line with file, key, value and fix of the first error."""
    first, *further = _most_useful_first(error)
    place = first["loc"]
    # Where a value may be of several types, pydantic complains once for each: say it together.
    alternatives = []
    if place and re.fullmatch(r"float|str|(constrained-)?int|.*\[.*\]", str(place[-1])):
        place = place[:-1]
        alternatives = [e for e in further if e["loc"][:-1] == place]
    key = " ".join(".".join(str(part) for part in place).split())
    left = len(further) - len(alternatives)
    suffix = f" (and {left} more)" if left else ""
    if first["type"] == "extra_forbidden":
        if replaced := replacement(first["loc"], first["input"], error.title):
            return DataError(where, *replaced)
        return DataError(where, f"unknown key {key}{suffix}", "correct its spelling or remove it")
    if first["type"] == "union_tag_not_found":
        key = f"{key}.{first['ctx']['discriminator'].strip(chr(39))}"
    if first["type"] in ("missing", "union_tag_not_found"):
        return DataError(where, f"{key} is missing{suffix}", f"add {key}")
    value = "" if isinstance(first["input"], dict) else f" = {reprlib.repr(first['input'])}"
    message = " or ".join(
        [_message(first), *(_message(e, "Input should be ") for e in alternatives)]
    )
    return DataError(where, f"{key or 'content'}{value}: {message}{suffix}", "correct the value")


def checked(model: type[ModelType], where: object, content: Mapping[str, Any]) -> ModelType:
    """Return settings of `model`. Raises DataError with `where`, key, value and fix."""
    try:
        return model.model_validate(content)
    except ValidationError as error:
        raise describe(error, where) from None


def overridden(base: dict[str, Any], by: dict[str, Any]) -> dict[str, Any]:
    """Return `base` with the values of `by`; mappings in both are joined in the same way."""
    joined = dict(base)
    for key, value in by.items():
        old = joined.get(key)
        if isinstance(old, dict) and isinstance(value, dict):
            joined[key] = overridden(old, value)
        else:
            joined[key] = value
    return joined


def _message(error: ErrorDetails, without: str = "Value error, ") -> str:
    if (
        error["type"] == "string_pattern_mismatch"
        and error["ctx"]["pattern"] == NAME_PATTERN.pattern
    ):
        return f"Names are {_NAME_RULE}"
    return error["msg"].removeprefix(without)
