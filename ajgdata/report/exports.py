"""Tables as files for other programs: CSV, LaTeX and BibTeX. Values in, text out."""

from __future__ import annotations

import csv
import io
import re
import unicodedata
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from ajgdata.report.blocks import ResultRow, ShownTable
from ajgdata.report.format import DASH
from ajgdata.store.files import spreadsheet_cell
from ajgdata.types.table import Column, Table

NUMBERS = "|"  #: ends the head of a column of numbers
#: Text cells longer than this break into lines in LaTeX.
LONG = 36
_SUPERSCRIPTS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
_TEX = str.maketrans(
    {
        **{char: f"\\{char}" for char in "&%$#_{}"},
        "\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}",
        "<": r"\textless{}", ">": r"\textgreater{}", "|": r"\textbar{}", '"': r"\char34{}",
        "—": "---", "–": "--", "…": r"\ldots{}", "\N{NO-BREAK SPACE}": "~", "−": "$-$",
        "±": r"$\pm$", "×": r"$\times$", "·": r"$\cdot$", "°": r"$^{\circ}$", "∞": r"$\infty$",
        "→": r"$\rightarrow$", "≤": r"$\leq$", "≥": r"$\geq$", "≈": r"$\approx$", "µ": r"$\mu$",
        **dict(zip("αβγδλμπρστφωΔΣΩ", (f"$\\{name}$" for name in (
            "alpha", "beta", "gamma", "delta", "lambda", "mu", "pi", "rho", "sigma", "tau", "phi",
            "omega", "Delta", "Sigma", "Omega",
        )), strict=True)),
    }
)  # fmt: skip


class Entry(NamedTuple):
    """One source: its key, the BibTeX type, and its fields as plain text; empty ones are left out.

    `authors` are family name and given names, or a name alone that stays as it is.
    """

    key: str
    kind: str
    authors: tuple[tuple[str, ...], ...]
    fields: Mapping[str, str]


def csv_of(table: Table | ShownTable) -> str:
    """Return a table as CSV with Unix line ends.

    Columns of a `Table` are headed by their keys, with the unit in brackets unless the key has it,
    and numbers keep every digit. Cells of a table for people are as they are shown, but that
    nothing is empty, and numbers have `-` for minus and no thousands separators.
    """
    if isinstance(table, ShownTable):
        heads = [head.removesuffix(NUMBERS) for head in table.heads]
        rows = [list(map(_plain_cell, row, table.heads)) for row in table.rows]
    else:
        heads = [_keyed(column) for column in table.columns]
        rows = [[row[column.key] for column in table.columns] for row in table.rows]
    text = io.StringIO(newline="")
    cells = [[spreadsheet_cell(cell) for cell in row] for row in (heads, *rows)]
    csv.writer(text, lineterminator="\n").writerows(cells)
    return text.getvalue()


def _keyed(column: Column) -> str:
    own = not column.unit or column.key.lower().endswith(f"_{column.unit.lower()}")
    return column.key if own else f"{column.key} ({column.unit})"


def _plain_cell(cell: str, head: str) -> str:
    if cell == DASH:
        return ""
    if not head.endswith(NUMBERS):
        return cell
    return re.sub(r"(?<=\d),(?=\d{3})", "", cell.replace("−", "-"))  # no thousands separators


def tex(text: str) -> str:
    r"""Return plain text as LaTeX that shows it: nothing in it is a command.

    Letters beyond ASCII stay; XeLaTeX and LuaLaTeX have them all, pdfLaTeX those of Europe.

    >>> from ajgdata.report.exports import tex
    >>> print(tex("5 % of edge_mm: 2 × 10⁻³"))
    5 \% of edge\_mm: 2 $\times$ 10$^{-3}$
    """
    visible = "".join(c if c.isprintable() else " " for c in text)
    raised = re.compile("[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+")
    return raised.sub(
        lambda run: f"$^{{{run[0].translate(_SUPERSCRIPTS)}}}$", visible.translate(_TEX)
    )


def latex_of(
    shown: ShownTable,
    label: str,
    *,
    bold: Collection[tuple[int, int]] = (),
    headings: Mapping[int, str] | None = None,
    cites: Sequence[str] = (),
    made: str = "",
) -> str:
    r"""Return a table as LaTeX for `\usepackage{booktabs}`: escaped, but for `cites`, keys of
    sources that its caption ends with.

    `bold` cells are given by row and column; `headings` stand above the rows that they are given
    for. `made` is a comment at the top.
    """
    columns = len(shown.heads)
    cited = f"~\\cite{{{','.join(cites)}}}" if cites else ""
    body = []
    for at, row in enumerate(shown.rows):
        if headings and at in headings:
            rule = [r"\midrule"] if at else []
            above = rf"\emph{{{tex(headings[at])}}}"
            body += [*rule, rf"\multicolumn{{{columns}}}{{p{{0.85\linewidth}}}}{{{above}}} \\"]
        cells = [rf"\textbf{{{tex(c)}}}" if (at, i) in bold else tex(c) for i, c in enumerate(row)]
        body.append(" & ".join(cells) + r" \\")
    heads = " & ".join(tex(head.removesuffix(NUMBERS)) for head in shown.heads)
    lines = [
        *([f"% {' '.join(made.split())}"] if made else []),
        r"% Needs \usepackage{booktabs}.",
        r"\begin{table}",
        r"\centering\footnotesize",
        rf"\caption{{{tex(shown.caption)}{cited}}}",
        rf"\label{{tab:{_key(label)}}}",
        rf"\begin{{tabular}}{{{''.join(_alignments(shown))}}}",
        r"\toprule",
        heads + r" \\",
        r"\midrule",
        *body,
        r"\bottomrule",
        r"\end{tabular}",
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


def _alignments(shown: ShownTable) -> list[str]:
    """Return one column letter of a tabular for each head; long text breaks into lines."""
    columns = list(zip(*shown.rows, strict=True)) or [()] * len(shown.heads)
    long = [max(map(len, column), default=0) > LONG for column in columns]
    width = f"p{{{min(0.2, 0.5 / max(1, sum(long))):.2f}\\linewidth}}"
    return [
        "r" if head.endswith(NUMBERS) else width if wraps else "l"
        for head, wraps in zip(shown.heads, long, strict=True)
    ]


#: Columns of the results of a task: head, and how a row has it.
RESULT_HEADS = {
    "Model": "label", "Metric": "metric", "Result|": "value", "Chance|": "chance",
    "Train, s|": "train_s", "Predict, ms|": "inference_ms", "MB|": "peak_memory_mb",
}  # fmt: skip


def results_latex(
    rows: Sequence[ResultRow], caption: str, label: str, *, cites: Sequence[str] = (), made: str
) -> str:
    """Return the rows of a task's results as LaTeX; what no row has gets no column.

    The part of the task that rows are of, and what the paper says of it, stand above them; `cites`
    are the keys of the paper.
    """
    columns = {head: [getattr(row, key) for row in rows] for head, key in RESULT_HEADS.items()}
    kept = {head: cells for head, cells in columns.items() if any(cells)}
    shown = ShownTable(caption, tuple(kept), tuple(zip(*kept.values(), strict=True)))
    best = list(kept).index("Result|") if "Result|" in kept else 0
    bold = {(at, best) for at, row in enumerate(rows) if row.best}
    told = ["; ".join(filter(None, (row.part, _papers(row)))) for row in rows]
    headings = {at: text for at, text in enumerate(told) if text != (told[at - 1] if at else "")}
    cited = cites if any(row.paper for row in rows) else ()
    return latex_of(shown, label, bold=bold, headings=headings, cites=cited, made=made)


def _papers(row: ResultRow) -> str:
    return f"the paper: {row.paper.text}" if row.paper else ""


def bibtex(entries: Iterable[Entry]) -> str:
    """Return sources as a BibTeX file. Raises ValueError if two share a key."""
    listed = list(entries)
    keys = [one.key for one in listed]
    if twice := sorted({key for key in keys if keys.count(key) > 1}):
        raise ValueError(f"two sources have the key {', '.join(twice)}")
    return "\n".join(map(_entry, listed))


def _entry(one: Entry) -> str:
    fields = {"author": " and ".join(map(_author, one.authors))}
    for field, text in one.fields.items():  # twice in braces: it keeps its capitals
        fields[field] = f"{{{tex(text)}}}" if field == "title" else _address(field, text)
    told = [f"  {field} = {{{text}}}," for field, text in fields.items() if text]
    return "\n".join([f"@{one.kind}{{{one.key},", *told, "}", ""])


def _author(name: Sequence[str]) -> str:
    """Return family and given names, or a name alone, in braces where it would be taken apart."""
    whole = len(name) == 1 or any(re.search(r",|\band\b", part) for part in name)
    return ", ".join(f"{{{tex(part)}}}" if whole else tex(part) for part in name)


def _address(field: str, text: str) -> str:
    """Return a field's text; an address keeps its marks, but for those that would end the field."""
    if field not in ("url", "eprint"):
        return tex(text)
    return re.sub(r"[\s{}\\]", lambda mark: "".join(f"%{b:02X}" for b in mark[0].encode()), text)


def paper_entry(about: Mapping[str, Any]) -> Entry:
    """Return the paper as a source: the head of `paper.yaml` (`source`, `title`, `authors`, `url`).

    Authors are family names with commas between them; brackets after them are a note.
    """
    listed, _, note = str(about["authors"]).partition("(")
    names = tuple((name.strip(),) for name in listed.split(",") if name.strip())
    note = note.strip(" )")
    year = re.search(r"\b(19|20)\d\d\b", note)
    arxiv = re.search(r"arXiv[: ]\s*(\S+)", str(about["source"]), re.IGNORECASE)
    fields = {
        "title": str(about["title"]),
        "year": year[0] if year else "",
        "note": note,
        "eprint": arxiv[1] if arxiv else "",
        "archiveprefix": "arXiv" if arxiv else "",
        "url": str(about["url"]),
    }
    first = names[0][0] if names else "paper"
    words = re.findall(r"\w+", fields["title"])
    key = _key(f"{first}{fields['year']}{words[0] if words else ''}".lower())
    return Entry(key, "misc", names, fields)


def software_entry(citation: Mapping[str, Any], commit: str = "", date: str = "") -> Entry:
    """Return software as a source: the content of its CITATION.cff, and the commit with its day."""
    authors = tuple(
        (str(a["name"]),)
        if "name" in a
        else tuple(str(a[part]) for part in ("family-names", "given-names") if part in a)
        for a in citation.get("authors", ())
    )
    title, version = str(citation["title"]), str(citation.get("version", ""))
    told = [f"version {version}" if version else "", f"commit {commit}" if commit else ""]
    fields = {
        "title": title,
        "year": date[:4],
        "note": ", ".join(["Software", *filter(None, told)]),
        "url": str(citation.get("repository-code", citation.get("url", ""))),
    }
    return Entry(_key(title.partition(":")[0].lower()), "misc", authors, fields)


def dataset_entry(name: str, title: str, citation: str, url: str, licence: str) -> Entry:
    """Return a data set as a source; `citation` is what it asks to be cited as."""
    note = ". ".join(filter(None, [citation.rstrip("."), f"Licence: {licence}" if licence else ""]))
    return Entry(_key(f"dataset-{name}"), "misc", (), {"title": title, "note": note, "url": url})


def _key(text: str) -> str:
    """Return text as a key: ASCII letters, digits and `-`."""
    ascii_only = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9-]+", "-", ascii_only).strip("-") or "source"
