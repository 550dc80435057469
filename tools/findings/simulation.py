"""Blocks on the virtual gripper, made of the tables of its studies and of the ablations."""

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from ajgdata.gripper.scene import Numerics
from ajgdata.report.format import DASH, Score, mean_sd, number, value
from ajgdata.studies.accuracy import PLAIN
from ajgdata.types.table import Table

from .markdown import markdown_table, pivoted, study_table
from .results import Results

#: Of tables with verdicts; others are shown as they are.
VERDICTS = (
    "paper's figure", "hypothesis", "change", "metric", "model", "before", "after", "gain (95 %)",
    "verdict",
)  # fmt: skip


def default_grid(results: Results) -> str:
    """Error and run time of the default grid, beside the plain scheme that it is compared with."""
    table = results.study("accuracy")["accuracy"]
    default = Numerics()
    own = _of_grid(table, default.scheme, default.dx_mm)
    plain = {row["object"]: row for row in _of_grid(table, PLAIN["scheme"], PLAIN["dx_mm"])}
    grid, plain_grid = (f"{number(float(dx_mm))} mm" for dx_mm in (default.dx_mm, PLAIN["dx_mm"]))
    head = (
        "error of the feature", f"default grid, {grid}", f"plain second order, {plain_grid}",
        "time, default over plain",
    )  # fmt: skip
    rows = []
    for row in own:
        beside = plain.get(row["object"])
        rows.append(
            [
                row["object"], number(row["error"], 2),
                number(beside["error"], 2) if beside else DASH, number(row["ratio"], 2),
            ]
        )  # fmt: skip
    return markdown_table(head, rows)


def _rows(table: Table) -> list[dict[str, Any]]:
    """Values are what the study says they are."""
    return [dict(row) for row in table.rows]


def _of_grid(table: Table, scheme: Any, dx_mm: Any) -> list[dict[str, Any]]:
    return [row for row in _rows(table) if (row["scheme"], row["dx_mm"]) == (scheme, dx_mm)]


def grid_sweep(results: Results) -> str:
    """Error, run time and error of the level for each grid; objects side by side."""
    table = results.study("accuracy")["accuracy"]
    objects = list(dict.fromkeys(row["object"] for row in _rows(table)))
    grids = list(dict.fromkeys((row["scheme"], row["dx_mm"]) for row in _rows(table)))
    keys = ("error", "ratio", "db_1_3", "db_3_6")
    head = ("scheme", "grid, mm", "error", "run time", "level 1 to 3 kHz, dB rms",
            "level 3 to 6 kHz, dB rms")  # fmt: skip
    lines = []
    for scheme, dx_mm in grids:
        rows = {row["object"]: row for row in _of_grid(table, scheme, dx_mm)}
        cells = (" / ".join(_short(rows, one, key) for one in objects) for key in keys)
        lines.append([scheme, number(dx_mm), *cells])
    return f"{' / '.join(objects)}:\n\n{markdown_table(head, lines)}"


def _short(rows: Mapping[str, Any], name: str, key: str) -> str:
    return number(rows[name][key], 2) if name in rows else DASH


def grid_settings(results: Results) -> str:
    """What precision, poles and stopping change on the default grid."""
    tables = results.study("accuracy")
    rows = _rows(tables["accuracy-settings"])
    first = rows[0]  # the default settings
    head = ("precision", "relaxation poles", "stops after", "change of the feature", "run time")
    lines = [
        [
            row["precision"], str(row["poles"]), f"{number(row['decay_db'])} dB",
            value(row["change"]), number(row["time_s"] / first["time_s"], 2),
        ]
        for row in rows
    ]  # fmt: skip
    check = study_table(tables["accuracy-reference"])
    return f"{markdown_table(head, lines)}\nAgainst the reference itself:\n\n{check}"


def omissions(results: Results) -> str:
    """What all that is left out of each scene changes, and the time it saves."""
    table = results.study("omissions")["omissions"]
    rows = [row for row in _rows(table) if row["part"] == "all that is left out"]
    head = (
        "scene", "left out", "largest change in a third octave", "of the feature", "tolerance",
        "run time, without / with",
    )  # fmt: skip
    return markdown_table(
        head,
        [
            [
                row["scene"], _left_out(table, row["scene"]), value(row["measured"]),
                value(row["feature"]), value(row["tolerance"]), number(row["time_ratio"], 2),
            ]
            for row in rows
        ],
    )  # fmt: skip


def _left_out(table: Table, scene: str) -> str:
    parts = [row["part"] for row in _rows(table) if row["scene"] == scene and row["kept"] is False]
    return ", ".join(parts) or "nothing"


def omission_summary(results: Results) -> str:
    """By part: scenes that leave it out, what that changes, and scenes that need not solve it."""
    table = results.study("omissions")["omission_summary"]
    keys = ("part", "omitted", "worst", "above", "solved", "needless")
    return study_table(table, keys)


def verification(results: Results) -> str:
    """Every claim with what was measured and its limit."""
    table = results.study("verification")["verification"]
    keys = ("title", "kind", "value", "cap", "order", "least_order", "passed")
    return study_table(table, keys)


def stability(results: Results) -> str:
    """Outcomes and worst bounds of the extreme cases by group."""
    rows = _rows(results.study("stability")["stability"])
    counts = Counter((row["group"], row["expected"], row["outcome"]) for row in rows)
    counted = [
        [*key, str(count), *(_worst(rows, key[0], bound) for bound in ("gain", "transient"))]
        for key, count in counts.items()
    ]
    head = (
        "what is extreme", "expected", "outcome", "cases", "gain of energy per step, any state",
        "growth of stored energy, any state",
    )  # fmt: skip
    return markdown_table(head, counted)


def _worst(rows: Iterable[dict[str, Any]], group: str, key: str) -> str:
    """Return the largest value of the cases of a group, a dash for those that are refused."""
    values = [row[key] for row in rows if row["group"] == group and row[key] is not None]
    return value(max(values)) if values else DASH


def contact_estimates(results: Results) -> str:
    """Each effect on paper, objects side by side."""
    table = results.study("materials")["material_estimates"]
    return pivoted(
        _rows(table), ("effect",), "shape", ("effect",), lambda row: value(row["change"])
    )


def material_distances(results: Results) -> str:
    """Distances from steel as the physics grows, and the scatter between grasps."""
    table = results.study("materials")["material_distances"]
    lines = [
        [
            row["shape"], row["step"],
            *(_pair(row, metal) for metal in ("aluminium", "wood", "plastic", "styrofoam")),
            _pair(row, "scatter"),
        ]
        for row in _rows(table)
    ]  # fmt: skip
    head = ("object", "physics", "aluminium", "wood", "plastic", "Styrofoam", "scatter of grasps")
    return markdown_table(head, lines)


def _pair(row: Mapping[str, Any], name: str) -> str:
    """Whole band, then below 2.5 kHz."""
    whole, low = row[name], row[f"{name}_low"]
    return DASH if whole is None else f"{value(whole)}, {value(low)}"


def ablation(results: Results, name: str) -> str:
    """All tables of an ablation, each with its title and note."""
    parts = []
    for table in results.ablation(name):
        keys = {column.key for column in table.columns}
        lines = (
            markdown_table(VERDICTS, [_judged(row) for row in _rows(table)])
            if "verdict" in keys
            else study_table(table, without="seconds")
        )
        parts.append("\n".join(filter(None, (f"### {table.title}\n", _line(table), lines))))
    return "\n".join(parts)


def _line(table: Table) -> str:
    return f"{table.note}\n" if table.note else ""


def _judged(row: Mapping[str, Any]) -> list[str]:
    """The cells of VERDICTS."""
    before, after = (mean_sd(Score(row[k], row[f"{k}_sd"])) for k in ("before", "after"))
    ends = [row[f"gain_{end}"] for end in ("low", "high")]
    interval = DASH if None in ends else " to ".join(map(number, ends))
    about = [str(row[key]) for key in ("of", "hypothesis", "change", "metric", "model")]
    measured = [cell.replace("-", "−") for cell in (before, after, interval)]
    return [*about, *measured, str(row["verdict"])]
