"""Meaning of the columns of a label table and of the named groups of a pattern."""

from __future__ import annotations

import re
import reprlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from ajgdata.store.files import sha256_of
from ajgdata.store.plain_text import listed
from ajgdata.store.publishing.archive import bad_name
from ajgdata.types import (
    HIGHEST_SAMPLE,
    LONGEST_NAME,
    QUALITIES,
    DataError,
    ImportSettings,
    is_reserved,
)

if TYPE_CHECKING:
    from ajgdata.store.scan import ScannedFile

#: Column or group in lower case -> its role; every other column or group is a label.
ROLES = {
    **{name: name for name in ("recording_id", "sha256", "grasp", "grasp_id", "object")},
    **{name: name for name in ("sample", "quality", "session")},
    "session_id": "session",
}


@dataclass(frozen=True)
class Fields:
    """Roles and labels of the columns of a table, or of the groups of a pattern.

    `roles` maps a role to its column, `labels` a column to the name under which recordings.csv
    stores it; `notes` name the columns that are not used.
    """

    roles: Mapping[str, str] = field(default_factory=dict)
    labels: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def slug(text: str) -> str:
    """Return `text` with everything but letters, digits and - replaced by _."""
    return re.sub(r"[^A-Za-z0-9-]+", "_", text).strip("_-") or "x"


def session_name(text: str) -> str:
    """Return `text` as the name of a session; a name that is too long ends in a digest."""
    name = slug(text)
    if len(name) <= LONGEST_NAME:
        return name
    return f"{name[: LONGEST_NAME - 13]}-{sha256_of(name.encode())[:12]}"


def fields_of(names: Sequence[str], settings: ImportSettings, where: object, noun: str) -> Fields:
    """Return the meaning of columns or groups (`noun`).

    Names of the data model are matched without regard to case. Raises DataError for two names with
    one meaning, and for a standard name that an import cannot set and that no template uses.
    """
    meanings = {name: ROLES.get(slug(name).lower(), slug(name)) for name in names}
    counts = Counter(meanings.values())
    if doubled := [name for name in names if counts[meanings[name]] > 1]:
        first, second = (
            doubled[0],
            next(n for n in doubled[1:] if meanings[n] == meanings[doubled[0]]),
        )
        problem = f"{noun}s {first!r} and {second!r} would both be {meanings[first]!r}"
        raise DataError(where, problem, "rename one of them")
    roles = {meaning: name for name, meaning in meanings.items() if meaning in ROLES.values()}
    labels = {name: meaning for name, meaning in meanings.items() if meaning not in roles}
    in_templates = _names_in(settings.file, settings.grasp, settings.session, settings.object)
    for name, meaning in list(labels.items()):
        if len(meaning) > LONGEST_NAME:
            problem = f"{noun} {reprlib.repr(name)} has a name of {len(name)} characters"
            raise DataError(where, problem, f"use up to {LONGEST_NAME}")
        if is_reserved(meaning):
            if name not in in_templates:
                problem = f"{noun} {name!r} has the name of a standard column that no import sets"
                fix = "rename it (gripper, medium and source are set in session.yaml)"
                raise DataError(where, problem, fix)
            del labels[name]
    return Fields(roles, labels, tuple(_unused(roles, settings, in_templates, noun)))


def _names_in(*templates: str) -> set[str]:
    return {name for template in templates for name in re.findall(r"\{([^{}]*)\}", template)}


def _unused(
    roles: Mapping[str, str], settings: ImportSettings, in_templates: set[str], noun: str
) -> list[str]:
    """Return a note for each role that an option, or a more exact column, replaces."""
    options = {"session": settings.session, "object": settings.object}
    options |= {"grasp": settings.grasp, "grasp_id": settings.grasp}
    notes = [
        f"{noun} {roles[role]!r} is not used, because --{role.removesuffix('_id')} is {template!r}"
        for role, template in options.items()
        if template and role in roles and roles[role] not in in_templates
    ]
    is_convention = not settings.table and settings.pattern in ("", "starter-kit")
    if not (settings.grasp or is_convention or {"grasp", "grasp_id"} & set(roles)):
        notes.append("each file is one grasp, because nothing names the grasp (see --grasp)")
    if not settings.grasp and {"grasp", "grasp_id"} <= set(roles):
        notes.append(
            f"{noun} {roles['grasp']!r} is not used, because {roles['grasp_id']!r} names the grasp"
        )
    return notes


def check_vocabulary(files: Sequence[ScannedFile], where: object) -> None:
    """Raise DataError for values of `quality` that the data model does not have, and for a
    recording_id that is not a plain name or that two files of one session share."""
    unknown = Counter(f.quality for f in files if f.quality.lower() not in ("", *QUALITIES))
    if unknown:
        values = listed([f"{text!r} ({count})" for text, count in unknown.items()])
        fix = f"use {', '.join(QUALITIES)}, and another column for notes"
        raise DataError(where, f"unknown values of quality: {values}", fix)
    for name in (file.recording_id for file in files if file.recording_id):
        if wrong := bad_name(name):
            fix = "use letters, digits, '_', '-' and '/'"
            raise DataError(where, f"recording_id {name!r} {wrong}", fix)
    ids = Counter((f.session, f.recording_id) for f in files if f.recording_id)
    if doubled := [name for (_, name), count in ids.items() if count > 1]:
        problem = f"several files of a session have the recording_id {listed(doubled)}"
        raise DataError(where, problem, "give each file its own")


def with_numbered_samples(files: Sequence[ScannedFile]) -> tuple[list[ScannedFile], list[str]]:
    """Return files with a number as `sample`, and a note if texts were numbered.

    Whole numbers as people and spreadsheets write them (`1`, `1.0`, `1,0`) keep their value. If
    another text occurs, all texts are numbered from 0 in alphabetical order.
    """
    texts = {file.sample_text for file in files}
    numbers = {text: _whole_number(text) for text in texts}
    if all(number is not None for number in numbers.values()):
        return [replace(f, sample=numbers[f.sample_text] or 0) for f in files], []
    places = {text: place for place, text in enumerate(sorted(texts))}
    note = "sample: " + listed([f"{text!r} is {place}" for text, place in places.items()])
    return [replace(file, sample=places[file.sample_text]) for file in files], [note]


def _whole_number(text: str) -> int | None:
    match = re.fullmatch(r"(\d*)(?:[.,]0{0,2})?", text)  # 1,000 may be 1 or a thousand
    number = int(match[1] or 0) if match and len(match[1]) <= 9 else HIGHEST_SAMPLE + 1
    return number if number <= HIGHEST_SAMPLE else None
