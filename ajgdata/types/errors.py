"""Errors for users, each with a message of one line."""

from __future__ import annotations

import errno


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


class NotPossibleError(ValueError):
    """The data are not sufficient for a measurement. The message is one line.

    The measurement is skipped, and the run continues. Any other ValueError is an error in the code,
    and its job fails.
    """


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
            # `filename2` is the target of a copy: its disk has the problem, not that of the source.
            name = error.filename2
        return f"{name}: {error.strerror}. {sentence(fix)}"
    return " ".join(str(error).split())


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
