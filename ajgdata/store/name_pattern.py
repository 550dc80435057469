"""Regular expressions for file names, with one-line errors for wrong patterns and long searches."""

from __future__ import annotations

import regex  # in contrast to `re`, a search can have a limit of time

from ajgdata.types import DataError

#: Longest search in one file name, in seconds. Usual patterns take microseconds. The time for
#: repeated alternatives such as `(a|aa)+` grows exponentially with the length of the name.
MATCH_TIMEOUT_S = 1.0


def compile_pattern(text: str) -> regex.Pattern[str]:
    """Return a regular expression with named groups. Raises DataError for any other text."""
    try:
        pattern: regex.Pattern[str] = regex.compile(text)
    except regex.error as error:
        raise DataError("--pattern", f"not a regular expression ({error})", "correct it") from None
    if not pattern.groupindex:
        fix = r"name the label, e.g. (?P<label>[^/]+), in it"
        raise DataError("--pattern", "has no named group", fix)
    return pattern


def match_name(pattern: regex.Pattern[str], name: str) -> regex.Match[str] | None:
    """Return the match of a whole file name; None if the name does not match.

    Raises DataError if the search takes more than MATCH_TIMEOUT_S.
    """
    try:
        return pattern.fullmatch(name, timeout=MATCH_TIMEOUT_S)
    except TimeoutError:
        problem = f"needs more than {MATCH_TIMEOUT_S:g} s for the file name {name!r}"
        fix = "replace repeated alternatives such as `(a|aa)+`, e.g. by `[^/]+`"
        raise DataError("--pattern", problem, fix) from None
