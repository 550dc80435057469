"""File names of unknown form: fields by separator, and patterns that `ajgdata import` could use."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

#: Plus, minus sign (U+2212) and hyphen.
_SIGNS = "+\u2212-"
#: A dot or a comma between digits is a decimal point.
_PLAIN_SEPARATOR = r"[/_ =;]|(?<!\d)[.,]|[.,](?!\d)"
#: A hyphen before a digit separates after a letter, a digit or a bracket (`bar-30`). Otherwise it
#: is a sign: at the beginning, or after another separator (`bar_-30`).
_SEPARATOR = rf"(?:{_PLAIN_SEPARATOR}|-(?!\d)|(?<=[^\W_]|[)\]}}])-)+"
#: In `bar+10` and `bar-30`, a hyphen after a letter is a sign.
_SEPARATOR_BEFORE_SIGN = rf"(?:{_PLAIN_SEPARATOR}|-(?!\d)|(?<=[\d)\]}}])-)+"
#: Empty separators: between a letter and a number, which has a sign or not.
_LETTER_TO_SIGN = rf"(?<=[^\W\d_])(?=[{_SIGNS}]?\d)"
_LETTER_TO_DIGIT = r"(?<=[^\W\d_])(?=\d)"
_LETTERS_AND_DIGITS = re.compile(r"([^\W\d_]+)\d+")
_HYPHEN_OR_SIGN = re.compile(r"[^\W\d_]-(?!0\d)\d")
_PLUS_AFTER_LETTER = re.compile(r"[^\W\d_][+\u2212]\d")
_NUMBER = re.compile(rf"([^\d{_SIGNS}]*)([{_SIGNS}]?\d+(?:\.\d+)?)(\D*)")
_TEXT = r"[^/_. -]+"
_TEXT_WITH_DOTS = r"(?:[^/_. -]|(?<=\d)\.(?=\d))+"
_LETTERS = rf"[^\d/_. {_SIGNS}]+"
_SUFFIX = r"\.[^./]+"
#: Between two words of a name; "" is the beginning or the end.
_WORD_ENDS = ("", "/", "_", " ")
#: Words before a number (or text) that specify its role.
_ROLE_WORDS = {
    "session": ("session", "sess", "ses", "day", "date", "week", "run", "series"),
    "grasp": ("grasp", "grip", "g", "gr"),
    "sample": ("sample", "s", "smp", "repeat", "rep", "r", "repetition", "take", "trial"),
    "object": ("object", "obj"),
}
#: Group of a field without a role, with its number in the printed table: stored, but not a target.
UNUSED_FIELD = "field_{}"
#: First and last field of a group, and the name of the group.
Roles = dict[tuple[int, int], str]


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
    def value_type(self) -> str:
        """Return a description: constant, number or text."""
        if len(self.values) == 1:
            return "constant"
        return "text" if self.affixes is None else "number"

    @cached_property
    def is_counter(self) -> bool:
        """True for whole numbers without a sign, and for single letters."""
        if self.value_type == "number":
            return not any(character in f"{_SIGNS}." for text in self.texts for character in text)
        return max(map(len, self.values)) == 1

    @property
    def before(self) -> str:
        """Return the letters before the number, in lower case; "" if the field is not a number."""
        return self.affixes[0].lower() if self.affixes else ""

    def numbers(self) -> tuple[str, ...]:
        """Return the part of each text (n,) that a group captures: the number, else the text."""
        if self.value_type != "number" or self.affixes is None:
            return self.texts
        before, after = self.affixes
        return tuple(text[len(before) : len(text) - len(after)] for text in self.texts)

    def pattern(self, role: str, *, before_number: bool = False) -> str:
        """Return the regular expression of the field; `role` is the name of its group, or "".

        The group captures a number without the text before and after, but the whole name of
        a session. `before_number` is True if no separator is between this text and a number.
        """
        before = ""
        after = ""
        if self.value_type == "constant":
            expression = re.escape(self.values[0])
        elif self.affixes is not None:
            before, after = map(re.escape, self.affixes)
            expression = self._number_expression(any_decimals=role == "label")
        elif before_number:
            expression = _LETTERS
        else:
            expression = self._text_expression()
        if not role:
            return before + expression + after
        if role == "session":
            return f"(?P<{role}>{before}{expression}{after})"
        return f"{before}(?P<{role}>{expression}){after}"

    def _number_expression(self, *, any_decimals: bool) -> str:
        """Return an expression with the signs that occur, and with decimals if they occur."""
        numbers = self.numbers()
        signs = [sign for sign in _SIGNS if any(number.startswith(sign) for number in numbers)]
        sign = ""
        if signs:
            sign = "-?" if signs == ["-"] else f"[{''.join(signs)}]?"
        has_decimals = any_decimals or any("." in number for number in numbers)
        decimals = r"(?:\.\d+)?" if has_decimals else ""
        return rf"{sign}\d+{decimals}"

    def _text_expression(self) -> str:
        """Return an expression for texts, which may begin with a sign (`none`, `-30`)."""
        sign = "-?" if any(text.startswith("-") for text in self.values) else ""
        return sign + (_TEXT_WITH_DOTS if any("." in text for text in self.values) else _TEXT)


@dataclass(frozen=True)
class NameForm:
    """The commonest form of some file names: its fields, separators, files (n,) of this form, and
    files of other forms.

    `has_signs` is True if a hyphen between a letter and a digit is read as a sign.
    """

    fields: tuple[NameField, ...]
    separators: tuple[str, ...]
    files: tuple[Path, ...]
    other_files: tuple[Path, ...]
    has_signs: bool

    def pattern(self, roles: Roles) -> str:
        """Return a pattern for `ajgdata import` with a named group per role."""
        spans = {first: (first, last) for first, last in roles}
        text = ""
        index = 0
        while index < len(self.fields):
            span = spans.get(index, (index, index))
            role = roles.get(span, "")
            separator = self.separators[span[1]] if span[1] < len(self.separators) else None
            if role == "session" and span in self._folders:
                levels = 1 + "".join(self.separators[index : span[1]]).count("/")
                text += f"(?P<session>{'/'.join(['[^/]+'] * levels)})"
            else:
                text += self.fields[index].pattern(role, before_number=separator == "")
            text += _SUFFIX if separator is None else _escaped(separator)
            index = span[1] + 1
        return text

    def grasp_template(self, roles: Roles) -> str:
        """Return `--grasp` of a proposal: "" if the import needs none.

        It needs none if session, object (else label), number of the grasp and sample identify the
        file. Otherwise the template has all groups except session and sample.
        """
        names = set(roles.values())
        object_name = "object" if "object" in names else "label"
        identity = {"session", object_name, "grasp", "sample"}
        if "grasp" not in names or self._is_unique(roles, identity):
            return ""
        columns = [
            roles[span] for span in sorted(roles) if roles[span] not in ("session", "sample")
        ]
        return "/".join(f"{{{column}}}" for column in columns)

    def proposals(self) -> list[Roles]:
        """Return up to three choices of the roles label, session, grasp and sample, by field.

        The label is a text if there is one, and has several files per value. Counters are the
        remaining whole numbers and single letters. Words specify their roles (`g1`, `s1`, `day2`);
        of the other counters, the one with most values is the grasp. Fields without a role are
        named by their number in the table, so a pattern uses all parts of the names. Each pattern
        reads the fields of each file of this form exactly.
        """
        varied = self._varied
        free = [i for i in varied if self._word_role(i) in ("", "object")] or varied
        shared = [i for i in free if len(self.fields[i].values) < len(self.files)]
        labels = sorted(shared or free, key=self._unlikely_label)
        choices: list[Roles] = []
        for label in labels[:2]:
            for has_grasps in (True, False):
                roles = self._roles(label, has_grasps=has_grasps)
                if roles not in choices and self._is_read_exactly(roles):
                    choices.append(roles)
        return choices[:3]

    def values(self, span: tuple[int, int], role: str) -> tuple[str, ...]:
        """Return the texts (n,) that a group captures, one per file."""
        first, last = span
        if role == "session":
            pieces = [self.fields[first].texts]
            for index in range(first, last):
                pieces += [
                    (self.separators[index],) * len(self.files),
                    self.fields[index + 1].texts,
                ]
            return tuple("".join(texts) for texts in zip(*pieces, strict=True))
        return self.fields[first].numbers()

    @property
    def _varied(self) -> list[int]:
        return [i for i, field in enumerate(self.fields) if field.value_type != "constant"]

    @cached_property
    def _folders(self) -> set[tuple[int, int]]:
        """Return the first and the last field of each run of adjacent folders."""
        ends = [i for i, separator in enumerate(self.separators) if "/" in separator]
        starts = [0, *(end + 1 for end in ends)][: len(ends)]
        return {(first, last) for first in starts for last in ends if first <= last}

    def _roles(self, label: int, *, has_grasps: bool) -> Roles:
        """Return the roles of all fields that vary, if `label` is the label."""
        roles: Roles = {(label, label): "label"}
        remaining = [i for i in self._varied if i != label]
        session = self._session(label, remaining)
        if session:
            roles[session] = "session"
            remaining = [i for i in remaining if not session[0] <= i <= session[1]]
        grasp, sample = self._counters(remaining) if has_grasps else (None, None)
        if sample is not None and not self._word_role(sample):
            spans: Roles = {**roles, (grasp, grasp): "grasp"} if grasp is not None else roles
            if self._is_unique(spans, set(spans.values())):  # each file is a grasp
                sample = None
        for index in remaining:
            if index == grasp:
                name = "grasp"
            elif index == sample:
                name = "sample"
            elif self._word_role(index) == "object" and "object" not in roles.values():
                name = "object"
            else:
                name = UNUSED_FIELD.format(index + 1)
            roles[index, index] = name
        return roles

    def _counters(self, indices: Sequence[int]) -> tuple[int | None, int | None]:
        """Return the fields of the grasp and of the sample within the grasp, if there are any.

        A field that words specify as a sample does not become the grasp: without a grasp, it has
        no role.
        """
        grasps = [i for i in indices if self._word_role(i) == "grasp"]
        samples = [i for i in indices if self._word_role(i) == "sample"]
        free = [i for i in indices if self.fields[i].is_counter and not self._word_role(i)]
        free.sort(key=lambda i: (not self._is_folder(i), -len(self.fields[i].values)))
        ranked = [*grasps, *free]
        if not ranked and len(samples) > 1:  # `rep1_take2`: the first contains the second
            ranked.append(samples.pop(0))
        if not ranked:
            return None, None
        inner = [*samples, *ranked[1:]]
        return ranked[0], inner[0] if inner else None

    def _session(self, label: int, indices: Sequence[int]) -> tuple[int, int] | None:
        """Return the fields of the session: folders, or a field with a word such as `day`.

        A folder is a session if a word specifies it, or if it has digits and contains the folder or
        the file with the label.
        """
        folders = [
            (first, last)
            for first, last in sorted(self._folders)
            if not first <= label <= last and self._is_session(first, last, label)
        ]
        if folders:
            return max(folders, key=lambda span: span[1] - span[0])
        fields = [i for i in indices if self._word_role(i) == "session"]
        return (fields[0], fields[0]) if fields else None

    def _is_session(self, first: int, last: int, label: int) -> bool:
        """True if each folder of a run of folders varies, and is a session."""
        ends = [i for i in range(first, last + 1) if "/" in self.separators[i]]
        starts = [first, *(end + 1 for end in ends[:-1])]
        for start, end in zip(starts, ends, strict=True):
            words = [self._word_role(i) for i in self._varied if start <= i <= end]
            if not words or "grasp" in words or "sample" in words:
                return False
            names = self.values((start, end), "session")
            have_digits = all(any(map(str.isdigit, name)) for name in names)
            have_digits = have_digits and not any(name[0] in _SIGNS for name in names)
            if "session" not in words and not (have_digits and end < label):
                return False
        return True

    def _is_folder(self, index: int) -> bool:
        return any(first <= index <= last for first, last in self._folders)

    def _word_role(self, index: int) -> str:
        """Return the role that the letters before a counter, or the constant before it, specify."""
        field = self.fields[index]
        if not field.is_counter:
            return ""
        word = field.before
        if not word and index and self.fields[index - 1].value_type == "constant":
            word = self.fields[index - 1].values[0].lower()
        word = word.strip("_ -.#")
        return next((role for role, words in _ROLE_WORDS.items() if word in words), "")

    def _unlikely_label(self, index: int) -> tuple[bool, bool, int]:
        affixes = self.fields[index].affixes
        return self.fields[index].is_counter, affixes is not None and not any(affixes), index

    def has_doubtful_hyphen(self, index: int) -> bool:
        """True for a number that varies, after a hyphen that could be its sign."""
        field = self.fields[index]
        return (
            field.value_type == "number"
            and self.separators[index - 1] == "-"
            and self.fields[index - 1].texts[0][-1:].isalpha()
            and not self._word_role(index)
            and not any(re.match(r"0\d", number) for number in field.numbers())
        )

    def could_be_decimal(self, index: int) -> bool:
        """True for two numbers that vary, with _ between them, if the second could be decimals."""
        before = self.fields[index - 1]
        field = self.fields[index]
        return (
            before.value_type == field.value_type == "number"
            and self.separators[index - 1] == "_"
            and (before.affixes or ("", ""))[1] == ""
            and field.is_counter
            and not any(field.affixes or ("",))
            and not any(re.match(r"0\d", text) or len(text) > 2 for text in field.texts)
        )

    def _is_unique(self, roles: Roles, names: set[str]) -> bool:
        """True if the groups with these names identify each file."""
        groups = [self.values(span, role) for span, role in roles.items() if role in names]
        return len(set(zip(*groups, strict=True))) == len(self.files)

    def _is_read_exactly(self, roles: Roles) -> bool:
        """True if the pattern matches each file of this form and reads the texts of its fields."""
        pattern = re.compile(self.pattern(roles))
        groups = {role: self.values(span, role) for span, role in roles.items()}
        for number, path in enumerate(self.files):
            match = pattern.fullmatch(path.as_posix())
            expected = {role: texts[number] for role, texts in groups.items()}
            if match is None or match.groupdict() != expected:
                return False
        return True


def name_form(files: Sequence[Path]) -> NameForm:
    """Return the commonest form of the paths (n,) of audio files, relative to their folder.

    A hyphen between a letter and a digit is ambiguous. It is a separator (`bar-30`: bar, 30),
    unless other files have a plus or U+2212 in this place, or more files have one form if it is
    a sign (`bar-30` and `bar30`: bar, -30 and 30). Letters and a number without a separator are
    two fields if several numbers follow the same letters (`cube1`, `cube2`, `ball1`, `ball2`).
    """
    separated = _form(files, re.compile(f"({_SEPARATOR})"), has_signs=False)
    with_signs = re.compile(f"({_SEPARATOR_BEFORE_SIGN}|{_LETTER_TO_SIGN})")
    signed = _form(files, with_signs, has_signs=True)
    has_hyphens = any(_HYPHEN_OR_SIGN.search(path.as_posix()) for path in files)
    has_plus = any(_PLUS_AFTER_LETTER.search(path.as_posix()) for path in files)
    gain = len(separated.other_files) - len(signed.other_files)
    if (has_hyphens and gain > 0) or (has_plus and gain >= 0):
        return signed
    split = _form(files, re.compile(f"({_SEPARATOR}|{_LETTER_TO_DIGIT})"), has_signs=False)
    has_joined_numbers = any(map(_has_joined_numbers, separated.fields))
    if has_joined_numbers and len(split.other_files) <= len(separated.other_files):
        return split
    return separated


def _has_joined_numbers(field: NameField) -> bool:
    """True if each text is letters and a number, and two numbers or more follow the letters."""
    matches = [_LETTERS_AND_DIGITS.fullmatch(text) for text in field.values]
    words = Counter(match[1] for match in matches if match)
    return all(matches) and len(words) > 1 and min(words.values()) > 1


def ambiguous_readings(form: NameForm) -> list[str]:
    """Return how ambiguous hyphens and underscores are read, with examples.

    Numbers such as `01` are counters, so a hyphen before them is a separator. A hyphen after
    another separator is a sign (`bar_-30`), which is ambiguous only for `bar--30`.
    """
    names = [path.as_posix() for path in form.files]
    readings = []
    double = [name for name in names if re.search(r"--\d", name)]
    if double:
        readings.append(
            f"the second of two hyphens before a number is read as a sign, e.g. {double[0]!r}"
        )
    single = [name for name in names if _HYPHEN_OR_SIGN.search(name)]
    if single and form.has_signs:
        readings.append(f"a hyphen after a letter is read as a sign, e.g. {single[0]!r}")
    elif single and any(form.has_doubtful_hyphen(i) for i in range(1, len(form.fields))):
        readings.append(
            f"a hyphen after a letter is read as a separator, e.g. {single[0]!r}. "
            r"If it is a sign, move it into the group: (?P<label>-?\d+)"
        )
    decimals = [name for name in names if re.search(r"(?<!\d)\d+_[1-9]\d?(?!\d)", name)]
    if decimals and any(form.could_be_decimal(i) for i in range(1, len(form.fields))):
        readings.append(
            f"numbers with _ between them are two fields, e.g. {decimals[0]!r}. "
            r"If they are one decimal number, use one group: (?P<label>\d+_\d+)"
        )
    return readings


def folder_pattern(files: Sequence[Path]) -> str:
    """Return a pattern whose label is the folder; it matches names of all forms.

    Returns "" if the paths (n,) are not all in one level of at least two folders, or if the
    folders are sessions.
    """
    folders = {path.parts[0] for path in files}
    if any(len(path.parts) != 2 for path in files) or len(folders) < 2:
        return ""
    if any("session" in roles.values() for roles in name_form(files).proposals()[:1]):
        return ""
    return rf"(?P<label>[^/]+)/(?P<take>.+){_SUFFIX}"


def _form(files: Sequence[Path], separator: re.Pattern[str], *, has_signs: bool) -> NameForm:
    """Return the commonest form of paths if `separator` separates their fields."""
    parts = {path: separator.split(path.with_suffix("").as_posix()) for path in files}
    forms = Counter(tuple(texts[1::2]) for texts in parts.values())
    separators = forms.most_common(1)[0][0]
    same = {path: texts[::2] for path, texts in parts.items() if tuple(texts[1::2]) == separators}
    return NameForm(
        fields=tuple(NameField(texts) for texts in zip(*same.values(), strict=True)),
        separators=separators,
        files=tuple(same),
        other_files=tuple(path for path in parts if path not in same),
        has_signs=has_signs,
    )


def _escaped(text: str) -> str:
    """Return a literal text as an expression, without needless backslashes."""
    return re.escape(text).replace(r"\ ", " ").replace(r"\-", "-")


def unused_parts(matches: Sequence[re.Match[str]]) -> list[list[str]]:
    """Return the texts of each part of file names that varies and is in no named group.

    `matches` (n,) are of one pattern and whole paths. The texts of a part are distinct and
    sorted. Suffixes do not count. Words that one named group determines do not count (`001 - Dog`,
    `002 - Rain` with the name as label): each of them belongs to one value of the group, and
    several files have this value. A sign or a digit that touches a group always counts.
    """
    by_groups: dict[tuple[str, ...], list[re.Match[str]]] = defaultdict(list)
    for match in matches:
        present = tuple(name for name in match.re.groupindex if match[name] is not None)
        by_groups[present].append(match)
    parts = []
    for names, equal in by_groups.items():
        groups = [[match[name] for match in equal] for name in names]
        columns = list(zip(*map(_outside_of_groups, equal), strict=True))
        for number, texts in enumerate(columns):
            is_separate = all(
                (number == 0 or text[:1] in _WORD_ENDS)
                and (number == len(columns) - 1 or text[-1:] in _WORD_ENDS)
                for text in texts
            )
            is_known = is_separate and any(_determines(group, texts) for group in groups)
            if len(set(texts)) > 1 and not is_known:
                parts.append(sorted(set(texts)))
    return parts


def _outside_of_groups(match: re.Match[str]) -> list[str]:
    """Return the texts before, between and after the named groups, without the suffix.

    The text before a group within another group is empty, so all matches have equally many texts.
    """
    path = match.string
    end = len(path) - len(Path(path).suffix)
    names = [name for name in match.re.groupindex if match[name] is not None]
    texts = []
    position = 0
    for first, last in sorted(map(match.span, names)):
        texts.append(path[position : min(first, end)])
        position = max(position, last)
    texts.append(path[position:end])
    return texts


def _determines(values: Sequence[str], texts: Sequence[str]) -> bool:
    """True if each text belongs to one value and each value to one text, and values repeat."""
    pairs = len(set(zip(values, texts, strict=True)))
    return pairs == len(set(values)) == len(set(texts)) < len(texts)
