"""Tables of what `benchmarks/scale.py` measured."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

Found = Sequence[dict[str, Any]]
NONE = "–"
BEGIN, END = "<!-- benchmarks/scale.py -->", "<!-- /benchmarks/scale.py -->"


def as_markdown(about: dict[str, Any]) -> str:
    """Return all tables: cost of each stage, cost of a recording more, files opened."""
    found = about["found"]
    measured = [one for one in found if {"cpu_s", "beyond_s", "failed"} & one.keys()]
    told = f"Recordings of {about['take_s']:g} s, {about['cores']} cores ({about['machine']})"
    parts = [
        f"{told}. Seconds of a processor; peak memory, MB; written, MB:",
        _table(measured, _cost),
        "Milliseconds of a processor that each recording more costs, between two sizes, and what "
        "a stage takes before its first, s:",
        _slopes(measured),
        "The report: its largest page, kB; the page of an embedding, kB; figures, "
        "tables and sounds beside them, MB:",
        _table([one for one in found if "page_kb" in one], _page),
        "Files opened, of the project and the recordings:",
        _table([one for one in found if "opened" in one], lambda one: f"{one['opened']:,}"),
    ]
    return "\n\n".join(parts) + "\n"


def into(page: Path, text: str) -> None:
    """Put the tables between the marks of a page."""
    before, rest = page.read_text(encoding="utf-8").split(BEGIN)
    _, after = rest.split(END)
    page.write_text(f"{before}{BEGIN}\n\n{text}\n{END}{after}", encoding="utf-8")


def _sizes(found: Found) -> list[int]:
    return sorted({one["recordings"] for one in found})


def _table(found: Found, cell: Any) -> str:
    if not found:
        return NONE
    sizes, names = _sizes(found), dict.fromkeys(one["stage"] for one in found)
    by_key = {(one["stage"], one["recordings"]): one for one in found}
    lines = ["| stage | " + " | ".join(f"{size:,}" for size in sizes) + " |"]
    lines.append("| --- |" + " --- |" * len(sizes))
    for name in names:
        cells = [by_key.get((name, size)) for size in sizes]
        lines.append(f"| {name} | " + " | ".join(cell(c) if c else NONE for c in cells) + " |")
    return "\n".join(lines)


def _cost(one: dict[str, Any]) -> str:
    if "failed" in one:
        return "failed"
    if "beyond_s" in one:
        return f"more than {one['beyond_s']:.0f} s"
    memory, written = (one.get(key) for key in ("peak_mb", "written_mb"))
    more = [f"{number:.0f}" if number is not None else NONE for number in (memory, written)]
    return "; ".join([f"{one['cpu_s']:.1f} s", *more])


def _page(one: dict[str, Any]) -> str:
    return f"{one['page_kb']:.0f}; {one['explorer_kb']:.0f}; {one['beside_mb']:.1f}"


def _slopes(found: Found) -> str:
    sizes = _sizes(found)
    heads = [f"{a:,} to {b:,}" for a, b in pairwise(sizes)]
    lines = ["| stage | start, s | " + " | ".join(heads) + " |"]
    lines.append("| --- | --- |" + " --- |" * len(heads))
    for name in dict.fromkeys(one["stage"] for one in found):
        cpu = {one["recordings"]: one["cpu_s"] for one in found
               if one["stage"] == name and "cpu_s" in one}  # fmt: skip
        if len(cpu) < 2:
            continue
        cells = list(_per_recording(cpu, sizes))
        lines.append(f"| {name} | {_start(cpu)} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _per_recording(cpu: dict[int, float], sizes: Sequence[int]) -> Iterator[str]:
    for a, b in pairwise(sizes):
        known = a in cpu and b in cpu
        yield f"{1e3 * (cpu[b] - cpu[a]) / (b - a):.3f}" if known else NONE


def _start(cpu: dict[int, float]) -> str:
    """Return what the line through the two smallest sizes says of none."""
    (a, first), (b, second) = sorted(cpu.items())[:2]
    return f"{max(0.0, first - a * (second - first) / (b - a)):.1f}"
