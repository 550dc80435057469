"""Write what the ablations of a run found into docs/ablations.md (`make findings` runs this)."""

import sys
from collections.abc import Sequence
from pathlib import Path

from ajgdata.ablations import ABLATIONS
from ajgdata.paths import Paths
from ajgdata.report.format import Score, mean_sd, number, value
from ajgdata.store.tables import read_tables
from ajgdata.types.table import Table

PAGE = Path(__file__).resolve().parents[1] / "docs" / "ablations.md"
#: What follows this line is made, up to the end of the page.
BEGIN = "<!-- made by tools/findings.py: do not edit below -->"
#: Of tables with verdicts; others are shown as they are.
HEAD = (
    "paper's figure", "hypothesis", "change", "metric", "model", "before", "after", "gain (95 %)",
    "verdict",
)  # fmt: skip


def findings(results: Paths) -> str:
    """All tables of the ablations in `results`, as Markdown."""
    studies = [read_tables(results.ablation(name)) for name in ABLATIONS]
    commits = sorted({str(about["git_commit"])[:10] for about, _ in studies})
    quick = any(about["quick"] for about, _ in studies)
    lines = [
        f"Simulated. Figures of the run of commit {', '.join(commits)}"
        f"{' (small, for testing)' if quick else ''}; networks train to other last digits on other "
        "machines. `make findings` writes those of your own run here.",
    ]
    for _, tables in studies:
        for table in tables:
            lines += ["", f"### {table.title}", "", table.note, "", *_markdown(table)]
    return "\n".join(lines) + "\n"


def _markdown(table: Table) -> list[str]:
    columns = [one for one in table.columns if one.key != "seconds"]
    if "verdict" in {one.key for one in columns}:
        return _rows(HEAD, [_judged(row) for row in table.rows])
    head = [f"{one.title}, {one.unit}" if one.unit else one.title for one in columns]
    return _rows(head, [[value(row[one.key]) for one in columns] for row in table.rows])


def _judged(row: dict) -> list[str]:
    """The cells of HEAD."""
    before, after = (mean_sd(Score(row[k], row[f"{k}_sd"])) for k in ("before", "after"))
    interval = " to ".join(number(row[f"gain_{end}"]) for end in ("low", "high"))
    about = [str(row[key]) for key in ("of", "hypothesis", "change", "metric", "model")]
    measured = [cell.replace("-", "−") for cell in (before, after, interval)]
    return [*about, *measured, str(row["verdict"])]


def _rows(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    return ["| " + " | ".join(cells) + " |" for cells in (head, ["---"] * len(head), *rows)]


def page(text: str, found: str) -> str:
    """`text` with everything after BEGIN replaced; ValueError if that is not there once."""
    kept, _ = text.split(BEGIN)
    return f"{kept}{BEGIN}\n\n{found}"


if __name__ == "__main__":
    root = Path(sys.argv[1]) if len(sys.argv) > 1 else Path()
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8"), findings(Paths(root))), encoding="utf-8")
