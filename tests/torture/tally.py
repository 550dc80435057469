"""What was promised, how it was tried, how often, and how often it failed."""

from __future__ import annotations

import os
import random
import time
from pathlib import Path

BEGIN, END = "<!-- torture -->\n", "<!-- /torture -->\n"
#: A share of all trials, the seed, and the longest (s) that one kind of trial goes on, and all of
#: them: after that, each kind is tried once.
SHARE = float(os.environ.get("AJGDATA_TORTURE_SHARE", "1"))
SEED = int(os.environ.get("AJGDATA_TORTURE_SEED", "0"))
SECONDS = float(os.environ.get("AJGDATA_TORTURE_SECONDS", "240"))
TOTAL_S = float(os.environ.get("AJGDATA_TORTURE_TOTAL_SECONDS", "1080"))
BEGAN = time.monotonic()


class Tally:
    """Trials of this run by promise and kind."""

    def __init__(self) -> None:
        self.rows: dict[tuple[str, str], list[int]] = {}
        self.failures: list[str] = []

    def add(self, promise: str, how: str, wrong: list[str] | str = ()) -> None:
        """Count one trial; `wrong` says what failed in it."""
        row = self.rows.setdefault((promise, how), [0, 0])
        row[0] += 1
        if wrong:
            row[1] += 1
            self.failures.append(f"{promise}; {how}: {wrong}")
            print(self.failures[-1])

    def table(self) -> str:
        """The outcome as Markdown."""
        rows = [[*key, str(trials), str(bad)] for key, (trials, bad) in self.rows.items()]
        trials, bad = (sum(row[at] for row in self.rows.values()) for at in (0, 1))
        head = f"{trials} trials, {bad} failures; seed {SEED}.\n\n"
        lines = [["Promise", "How it was tested", "Trials", "Failures"], ["---"] * 4, *rows]
        return head + "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def trials(name: str, count: int):
    """Yield a random generator for each trial, whose seed is printed, until the time is up."""
    started = time.monotonic()
    for number in range(max(1, round(count * SHARE))):
        now = time.monotonic()
        if now - started > SECONDS or (number and now - BEGAN > TOTAL_S):
            print(f"{name}: time is up after {number} trials")
            return
        seed = f"{SEED}/{name}/{number}"
        print(f"trial {seed}")
        yield random.Random(seed)


def write_block(page: Path, table: str) -> None:
    """Replace what stands between the markers of a page."""
    text = page.read_text(encoding="utf-8")
    before, _, rest = text.partition(BEGIN)
    page.write_text(before + BEGIN + "\n" + table + "\n" + END + rest.partition(END)[2], "utf-8")
