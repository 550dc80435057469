"""Write docs/parameters.md from the table of physical parameters (`make docs` runs this)."""

from pathlib import Path

from tools.parameter_ranges import PARAMETERS, Parameter, default_of

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

Every physical setting, made from `tools/parameter_ranges.py` by `tools/parameters.py`: do not
edit. What has a source has its value from there. What has none has a range, and its default is the
middle of it (the geometric one where the range spans more than a factor of 3), unless the source
says why not. None was chosen by what a model makes of it.

The headings say at which level a setting would differ in a laboratory. What does differ between
the scenes of a recipe are its variants, the nuisances of a grasp (standard deviations), what the
recipe varies of the pose, and the amounts of `variation.…`: what is drawn lies evenly within ± the
amount, on each axis (memory and grain_force are no amounts: they are used as they are). All else
is the same in all scenes."""


def page() -> str:
    """The whole page."""
    lines = [HEAD]
    for level, title in LEVELS.items():
        rows = [one for one in PARAMETERS if one.level == level]
        if rows:
            lines += ["", f"## {title}", "", *table(rows)]
    return "\n".join(lines) + "\n"


def table(rows: list[Parameter]) -> list[str]:
    """The rows of one level."""
    heads = ["parameter", "value", "range", "unit", "evidence", "source"]
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
        lines.append("| " + " | ".join(cells) + " |")
    return lines


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
