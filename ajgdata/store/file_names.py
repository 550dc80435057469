"""File names of unknown form: fields by separator, and patterns that `ajgdata import` could use."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

#: A dot between digits is a decimal point.
_SEPARATORS = re.compile(r"((?:[/_ -]|(?<!\d)\.|\.(?!\d))+)")
_DIGITS = r"\d+(?:\.\d+)?"
_TEXT = r"(?:[^/_. -]|(?<=\d)\.(?=\d))+"
_NUMBER = re.compile(rf"(\D*)({_DIGITS})(\D*)")
_SUFFIX = r"\.[^./]+"
#: Roles of the fields that count: first the grasp, then the recording of the grasp.
_COUNTERS = ("grasp", "sample")


@dataclass(frozen=True)
class NameField:
    """One field of the file names: its texts (n,), one per file of the commonest form."""

    texts: tuple[str, ...]

    @cached_property
    def values(self) -> list[str]:
        """Return the distinct texts, sorted."""
        return sorted(set(self.texts))

    @cached_property
    def affixes(self) -> tuple[str, str] | None:
        """Return the texts before and after a number, if they are the same in all files."""
        matches = [_NUMBER.fullmatch(text) for text in self.values]
        affixes = {(match[1], match[3]) for match in matches if match}
        return affixes.pop() if all(matches) and len(affixes) == 1 else None

    @property
    def kind(self) -> str:
        """Return a description: constant, number or text."""
        if len(self.values) == 1:
            return "constant"
        return "text" if self.affixes is None else "number"

    def pattern(self, role: str) -> str:
        """Return the regular expression of the field; `role` is the name of its group, or ""."""
        if self.kind == "constant":
            return re.escape(self.values[0])
        before, after = self.affixes or ("", "")
        expression = _TEXT if self.affixes is None else _DIGITS
        group = f"(?P<{role}>{expression})" if role else expression
        return re.escape(before) + group + re.escape(after)


@dataclass(frozen=True)
class NameForm:
    """The commonest form of some file names: its fields, separators, and files of other forms."""

    fields: tuple[NameField, ...]
    separators: tuple[str, ...]
    other_files: tuple[Path, ...]

    def pattern(self, roles: dict[int, str]) -> str:
        """Return a pattern for `ajgdata import` with a named group per role, by field number."""
        texts = [field.pattern(roles.get(i, "")) for i, field in enumerate(self.fields)]
        separators = [re.escape(text).replace(r"\ ", " ") for text in self.separators]
        pairs = zip(texts, [*separators, _SUFFIX], strict=True)
        return "".join(text + separator for text, separator in pairs).replace(r"\-", "-")

    def proposals(self) -> list[dict[int, str]]:
        """Return up to three choices of the roles label, grasp and sample, by field number.

        The label is a text if there is one, and has several files per value. Counters are the
        remaining numbers and single letters; the one with most values is the grasp.
        """
        varied = [i for i, field in enumerate(self.fields) if field.kind != "constant"]
        shared = [i for i in varied if len(self.fields[i].values) < len(self.fields[i].texts)]
        labels = sorted(shared or varied, key=self._unlikely_label)
        choices = []
        for label in labels[:2]:
            counters = [i for i in varied if i != label and self._counts(i)]
            counters.sort(key=lambda i: -len(self.fields[i].values))
            roles = {label: "label"} | dict(zip(counters, _COUNTERS, strict=False))
            choices += [roles, {label: "label"}]
        return [roles for i, roles in enumerate(choices) if roles not in choices[:i]][:3]

    def _counts(self, index: int) -> bool:
        field = self.fields[index]
        return field.kind == "number" or max(map(len, field.values)) == 1

    def _unlikely_label(self, index: int) -> tuple[bool, bool, int]:
        affixes = self.fields[index].affixes
        return self._counts(index), affixes is not None and not any(affixes), index


def name_form(files: Sequence[Path]) -> NameForm:
    """Return the commonest form of the paths (n,) of audio files, relative to their folder."""
    parts = {path: _SEPARATORS.split(path.with_suffix("").as_posix()) for path in files}
    forms = Counter(tuple(texts[1::2]) for texts in parts.values())
    separators = forms.most_common(1)[0][0]
    same = [texts[::2] for texts in parts.values() if tuple(texts[1::2]) == separators]
    different = tuple(path for path, texts in parts.items() if tuple(texts[1::2]) != separators)
    return NameForm(
        tuple(NameField(texts) for texts in zip(*same, strict=True)), separators, different
    )
