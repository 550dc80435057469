"""Names, errors in one line, issues of recordings, and the base class of all settings."""

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
#: Largest number of characters of a name: file names consist of several names.
LONGEST_NAME = 100
NAME_PATTERN = re.compile(rf"^[A-Za-z0-9][A-Za-z0-9_-]{{0,{LONGEST_NAME - 1}}}$")
_NAME_RULE = (
    f"letters, digits, _ and -, up to {LONGEST_NAME} characters, the first a letter or digit"
)
#: A part that is repeated 20 times at the end of a name. Snakemake does not run a job whose files
#: have this name.
_REPEATED_PART = re.compile(r"(.+)\1{19}$")


def without_repeated_part(name: str) -> str:
    """Return `name`. Raises ValueError if it ends with the same part 20 times."""
    repeated = _REPEATED_PART.search(name)
    if repeated:
        raise ValueError(f"ends with {repeated[1]!r} 20 times, which Snakemake refuses")
    return name


Name = Annotated[
    str,
    Field(pattern=NAME_PATTERN.pattern, description="letters, digits, _ and -"),
    AfterValidator(without_repeated_part),
]
ModelName = Annotated[Name, AfterValidator(MODELS.checked)]


def distinct(values: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return `values`. Raises ValueError if two values, or the names of two values, are equal."""
    if len({getattr(value, "name", value) for value in values}) < len(values):
        raise ValueError("lists one twice")
    return values


#: Rule for tuples of settings: no value is listed twice.
Distinct = AfterValidator(distinct)


class DataError(Exception):
    """An error in the data or settings of a user, whose message is one line.

    `where` is a file, option or object, `problem` is what is wrong, and `fix` is what to do.
    `problem` and `fix` are clauses without a full stop, and `fix` begins with a verb.
    """

    def __init__(self, where: object, problem: str, fix: str) -> None:
        super().__init__(f"{where}: {problem}. {sentence(fix)}")
        self.where = str(where)
        self.problem = problem
        self.fix = fix

    def __reduce__(self) -> tuple[type[DataError], tuple[str, str, str]]:
        """Support pickling: a copy in another process needs all three arguments."""
        return type(self), (self.where, self.problem, self.fix)


def sentence(clause: str) -> str:
    """Return a clause as a sentence: with a capital letter and a full stop."""
    return f"{clause[:1].upper()}{clause[1:]}."


def many(count: int, noun: str) -> str:
    """Return a number with its noun.

    >>> many(1, "job"), many(2000, "job")
    ('1 job', '2,000 jobs')
    """
    plural = "" if count == 1 else "s"
    return f"{count:,} {noun}{plural}"


def checked_name(name: str, what: str = "data set") -> str:
    """Return `name`. Raises DataError if a `what` cannot have this name."""
    if not NAME_PATTERN.fullmatch(name):
        rule = _NAME_RULE
    elif _REPEATED_PART.search(name):
        rule = "a name that does not end with the same part 20 times: Snakemake refuses it"
    else:
        return name
    raise DataError(reprlib.repr(name), f"is not a valid name of a {what}", f"use {rule}")


#: What to do after an error of the operating system, by its number.
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
            name = (
                error.filename2
            )  # if a copy fails, the disk of the target is full, not the source
        return f"{name}: {error.strerror}. {sentence(fix)}"
    return " ".join(str(error).split())


class NotPossibleError(ValueError):
    """The data are not sufficient for a measurement. The message is one line.

    The measurement is skipped, and the run continues. Any other ValueError is an error in the code,
    and its job fails.
    """


#: Levels of issues, the worst first.
ISSUE_LEVELS = ("error", "warning", "note")
#: The recording_id of an issue of a whole session, and the session_id of an issue of a data set.
WHOLE = "*"


@dataclasses.dataclass(frozen=True, order=True)
class Finding:
    """An issue that a check reports about one recording, or about a whole session or data set.

    The fields are the columns of results/quarantine/NAME.csv.
    """

    session_id: str  #: `*` for a whole data set
    recording_id: str  #: `*` for a whole session
    file: str
    #: error: the recording is quarantined; warning: it is used, but a person should check it; note:
    #: it is unusual, but correct.
    level: Literal["error", "warning", "note"]
    code: str  #: fixed name of the check's result, e.g. `truncated`
    problem: str
    fix: str

    @property
    def leaves_out(self) -> bool:
        """Whether the recording is excluded from the feature file."""
        return self.level == "error" or self.code in ("copy", "rejected")


def left_out(findings: Iterable[Finding]) -> set[tuple[str, str]]:
    """Return (session_id, recording_id) of each recording that the feature file excludes."""
    return {(f.session_id, f.recording_id) for f in findings if f.leaves_out}


def flagged(findings: Collection[Finding]) -> set[tuple[str, str]]:
    """Return (session_id, recording_id) of each recording with issues that is used nevertheless."""
    return {(f.session_id, f.recording_id) for f in findings} - left_out(findings)


class Strict(BaseModel):
    """Base class of all settings: unknown keys are errors, and instances are immutable."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


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
        return f"Names are {_NAME_RULE}"
    return error["msg"].removeprefix(without)
