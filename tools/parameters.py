"""Write docs/parameters.md from the table of physical parameters (`make docs` runs this)."""

from collections.abc import Mapping
from pathlib import Path

from ajgdata.gripper.parameters import PARAMETERS, Parameter, default_of
from ajgdata.paths import Paths
from ajgdata.pipeline.draws import kept_files
from ajgdata.store.tables import read_tables

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "parameters.md"
#: Said of each level, in the order of the hierarchy.
LEVELS = {
    "fixed": "The design, and what is the same for all",
    "gripper": "Between grippers of one design",
    "session": "Between sessions",
    "grasp": "Between grasps",
    "recording": "Between recordings of one grasp",
}
HEAD = """# Parameters of the simulation

Every physical setting, made from `ajgdata/gripper/parameters.py` by `tools/parameters.py`: do not
edit. What has a source has its value from there. What has none has a range, and its default is the
middle of it (the geometric one where the range spans more than a factor of 3), unless the source
says why not. None was chosen by what a model makes of it.

The headings say at which level a setting would differ in a laboratory. What does differ between
the scenes of a recipe are its variants, the nuisances of a grasp (standard deviations), what the
recipe varies of the pose, and the amounts of `variation.…`: what is drawn lies evenly within ± the
amount, on each axis (memory and grain_force are no amounts: they are used as they are). All else
is the same in all scenes."""


MOVES = """
*Moves*: which rows of the paper a parameter moves among the drawn grippers of the report's page
*Which gripper would have given this*, with the share of the row's variance that an emulator lays to
it, alone and together with others (total Sobol index times the emulator's R²): from 5 % on, and
where its ranks alone say so, too; — moves none so much."""


def kept_sensitivity() -> dict[str, str] | None:
    """What each parameter moves in the sweep that is kept; None if none is."""
    files = kept_files(Paths(ROOT))
    if not files:
        return None
    tables = {one.name: one for one in read_tables(files[0])[1]}
    found: dict[str, list[str]] = {}
    for row in tables["draws_sensitivity"].rows:
        found.setdefault(row["setting"], []).append(f"{row['row']} {100 * row['share']:.0f} %")
    return {setting: "; ".join(words) for setting, words in found.items()}


def page(sensitivity: Mapping[str, str] | None = None) -> str:
    """The whole page; `sensitivity` says, by setting, which results move with it."""
    lines = [HEAD, *([MOVES] if sensitivity is not None else [])]
    for level, title in LEVELS.items():
        rows = [one for one in PARAMETERS if one.level == level]
        if rows:
            lines += ["", f"## {title}", "", *table(rows, sensitivity)]
    return "\n".join(lines) + "\n"


def table(rows: list[Parameter], sensitivity: Mapping[str, str] | None) -> list[str]:
    """The rows of one level."""
    heads = ["parameter", "value", "range", "unit", "evidence", "source"]
    heads += ["moves"] if sensitivity is not None else []
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    for one in rows:
        value = default_of(one.setting)
        cells = [
            f"`{one.setting}`",
            "none" if value is None else f"{value:g}",
            "known" if one.low == one.high else f"{one.low:.3g} to {one.high:.3g}",
            one.unit,
            one.evidence,
            one.source,
        ]
        cells += [sensitivity.get(one.setting, "—")] if sensitivity is not None else []
        lines.append("| " + " | ".join(cells) + " |")
    return lines


if __name__ == "__main__":
    PAGE.write_text(page(kept_sensitivity()), encoding="utf-8")
