"""Tables of a report for other programs: CSV at full precision, LaTeX, BibTeX."""

import csv
import dataclasses
import io
import re
import shutil
import subprocess

import pytest
from report_samples import PAPER, sample_report
from result_samples import two_tasks

from ajgdata.paths import Paths
from ajgdata.pipeline.exports import (
    results_table,
    table_files,
    tables_beside,
    write_exports,
)
from ajgdata.report.blocks import ResultRow, ShownTable
from ajgdata.report.comparison import Cost, PaperComparison, Twin
from ajgdata.report.exports import (
    Entry,
    bibtex,
    csv_of,
    dataset_entry,
    latex_of,
    paper_entry,
    results_latex,
    software_entry,
    tex,
)
from ajgdata.types.table import table_of

THIRD = 1 / 3
#: Every mark that is a command to LaTeX.
MARKS = r"a\b{c}d$e&f%g#h_i^j~k<l>m|n" + '"'


def read(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def braces(text: str) -> int:
    """Return how many braces are open at the end of LaTeX; escaped ones are text."""
    plain = re.sub(r"\\[{}]", "", text)
    return plain.count("{") - plain.count("}")


def test_numbers_keep_every_digit_and_columns_their_units():
    table = table_of(
        "t", "t", [{"model": "a, b", "width": THIRD, "low_hz": 1e-30, "on": None}],
        model="Model", width="Width, mm", low_hz="Low, Hz", on="On",
    )  # fmt: skip
    (row,) = read(csv_of(table))
    assert list(row) == ["model", "width (mm)", "low_hz", "on"]
    assert float(row["width (mm)"]) == THIRD and float(row["low_hz"]) == 1e-30
    assert (row["model"], row["on"]) == ("a, b", "")


def test_cells_for_people_become_cells_for_programs():
    shown = ShownTable("c", ("Name", "Number|"), (("−1,500", "−1,500"), ("—", "—"), ("x", "1 ± 2")))
    assert [list(row.values()) for row in read(csv_of(shown))] == [
        ["−1,500", "-1500"], ["", ""], ["x", "1 ± 2"],
    ]  # fmt: skip
    assert csv_of(shown).startswith("Name,Number\n")


def test_text_is_never_a_command():
    assert tex(MARKS) == (
        r"a\textbackslash{}b\{c\}d\$e\&f\%g\#h\_i\textasciicircum{}j\textasciitilde{}k"
        r"\textless{}l\textgreater{}m\textbar{}n\char34{}"
    )
    assert tex("2.6 ± 0.1 × 10⁻¹²\n—") == r"2.6 $\pm$ 0.1 $\times$ 10$^{-12}$ ---"
    assert tex("Splettstößer 石") == "Splettstößer 石"


def test_a_latex_table_has_as_many_cells_in_each_row_as_columns():
    rows = ((MARKS, "1", "long " * 20), ("b", "2", ""))
    shown = ShownTable(MARKS, ("Name & co", "Number|", "Text"), rows)
    text = latex_of(
        shown, "size_1", bold={(1, 1)}, headings={1: "part_two"}, cites=("k",), made="a\n\\input{x}"
    )
    assert braces(text) == 0
    opened, closed = (re.findall(rf"\\{end}{{(\w+)}}", text) for end in ("begin", "end"))
    assert opened == ["table", "tabular"] and closed == opened[::-1]
    assert r"\begin{tabular}{lrp{0.20\linewidth}}" in text and r"\label{tab:size-1}" in text
    assert text.startswith("% a \\input{x}\n")  # a comment stays one line
    body = text[text.index(r"\toprule") : text.index(r"\bottomrule")].splitlines()
    cells = [re.split(r"(?<!\\)&", line) for line in body if line.endswith(r"\\")]
    assert [len(row) for row in cells] == [3, 3, 1, 3]
    assert r"\textbf{2}" in cells[-1][1] and "part\\_two" in cells[2][0]
    assert r"\cite{k}}" in text


def test_results_for_a_paper_say_what_the_paper_says_once():
    rows = [
        ResultRow("CNN", "RMSE", "2.2 mm", best=True, paper=PAPER),
        ResultRow("k-NN", "RMSE", "4 mm", paper=PAPER),
        ResultRow("CNN", "RMSE", "3 mm", part="withheld"),
    ]
    text = results_latex(rows, "Sizes", "size", cites=("weber",), made="m")
    assert text.count("RMSE 2.6 mm overall") == 1 and text.count(r"\multicolumn") == 2
    assert text.index("the paper:") < text.index("CNN") < text.index("withheld")
    assert "Model & Metric & Result \\\\" in text  # no column that no row fills
    assert r"\textbf{2.2 mm}" in text and r"\textbf{4 mm}" not in text and r"\cite{weber}" in text
    unbeside = results_latex(rows[2:], "Sizes", "size", cites=("weber",), made="m")
    assert r"\cite" not in unbeside


def test_sources_are_bibtex():
    about = {
        "source": "arXiv 2603.00351", "title": "Acoustic & soft", "url": "https://x.org/a_b#{c",
        "authors": "Weber, Splettstößer, Böck (ICRA 2026)",
    }  # fmt: skip
    paper = paper_entry(about)
    people = {"family-names": "Doe", "given-names": "Jane"}
    cff = {"title": "tool: it", "version": "1.0", "authors": [people, {"name": "Rock and Co"}]}
    software = software_entry(cff, "abc", "2026-02-03")
    stones = dataset_entry("rock_1", "<b>stones", "A. Müller, 2020.", "", "CC0-1.0")
    assert bibtex([paper, software, stones]) == (
        "@misc{weber2026acoustic,\n"
        "  author = {{Weber} and {Splettstößer} and {Böck}},\n"
        "  title = {{Acoustic \\& soft}},\n"
        "  year = {2026},\n"
        "  note = {ICRA 2026},\n"
        "  eprint = {2603.00351},\n"
        "  archiveprefix = {arXiv},\n"
        "  url = {https://x.org/a_b#%7Bc},\n"
        "}\n\n"
        "@misc{tool,\n"
        "  author = {Doe, Jane and {Rock and Co}},\n"
        "  title = {{tool: it}},\n"
        "  year = {2026},\n"
        "  note = {Software, version 1.0, commit abc},\n"
        "}\n\n"
        "@misc{dataset-rock-1,\n"
        "  title = {{\\textless{}b\\textgreater{}stones}},\n"
        "  note = {A. Müller, 2020. Licence: CC0-1.0},\n"
        "}\n"
    )
    with pytest.raises(ValueError, match="two sources have the key a"):
        bibtex([Entry("a", "misc", (), {}), Entry("a", "misc", (), {})])


def test_tables_of_all_models_are_one_file():
    sizes, kinds = two_tasks()
    files = table_files(sizes)
    base = "cross-validation--size--edge"
    assert [name for name in files if "shown" not in name] == [base, f"{base}--predictions"]
    scores = read(csv_of(files[base]))
    found = {(r["model"], r["part"], r["metric"], r["statistic"]): r["value"] for r in scores}
    assert found["cnn", "grouped", "rmse", "fold 1"] == "2.5"
    assert found["knn", "grouped", "rmse", "mean"] == "4.0"
    assert found["cnn", "cost of grouped", "train_s", "measured"] == "3.2"
    predicted = read(csv_of(files[f"{base}--predictions"]))
    assert [row["model"] for row in predicted] == ["cnn"] * 12 + ["knn"] * 12
    assert (
        "model"
        not in read(csv_of(table_files(kinds)["cross-validation--stones--kind--predictions"]))[0]
    )
    shown = files[f"{base}--shown-1"]
    assert isinstance(shown, ShownTable) and shown.rows


def test_all_results_stand_in_one_table_with_their_costs():
    rows = {
        (r["dataset"], r["model"], r["part"], r["metric"]): r
        for r in results_table(two_tasks()).rows
    }
    cnn = rows["size", "cnn", "grouped", "rmse"]
    assert (cnn["mean"], cnn["sd"], cnn["chance"], cnn["unit"]) == (2.2, 0.3, 8.2, "mm")
    assert (cnn["train_s"], cnn["latency_s"], cnn["peak_rss_mb"]) == (3.2, 0.21 / 1e3, 512.0)
    assert rows["size", "cnn", "random", "rmse"]["mean"] == 1.1
    kind = rows["stones", "cnn", "grouped", "accuracy"]
    assert (kind["source"], kind["unit"], kind["pooled"]) == ("recorded", "", None)


@pytest.mark.parametrize(
    ("figure", "tables"),
    [
        ("a--d--t", ["a--d--t"]),
        ("a--d--t--predictions--cnn", ["a--d--t--predictions"]),
        ("a--d--t--objects-raw", ["a--d--t--objects"]),
        ("a--d--t--objectstore", ["a--d--t"]),
        ("b--d--t--plane", ["b--d--t--x", "b--d--t--y"]),
        ("across", ["results"]),
    ],
)
def test_a_figure_is_given_its_own_table(figure, tables):
    own = ["a--d--t", "a--d--t--predictions", "a--d--t--objects", "a--d--t--shown-1"]
    names = ["results", *own, "b--d--t--x", "b--d--t--y", "b--d--t--shown-1"]
    assert list(tables_beside(figure, names)) == tables


def test_a_report_is_written_whole(tmp_path):
    beside = PaperComparison(
        PAPER, "size", "edge", "simulated", "2.2 ± 0.3 mm", "CNN", "no: lower", Cost(3.2, 0.21),
        twins=(Twin("60–6,000 Hz", "2.4 ± 0.2 mm", "yes"),),
    )  # fmt: skip
    report = dataclasses.replace(sample_report(), comparisons=(beside,))
    tables, papers = tmp_path / "report" / "tables", tmp_path / "tables"
    tables.mkdir(parents=True)
    (tables / "of-before.csv").touch()
    names = write_exports(Paths(tmp_path), report, two_tasks(), tables, papers=papers)
    assert {path.stem for path in tables.iterdir()} == set(names) and len(names) == len(set(names))
    (row,) = read((tables / "beside-paper.csv").read_text(encoding="utf-8"))
    assert (row["paper"], row["agrees"], row["train_s"]) == ("2.6", "no: lower", "3.2")
    assert row["parts_of_band"] == "60–6,000 Hz: 2.4 ± 0.2 mm (yes)"
    spectra = read((tables / "spectra--size.csv").read_text(encoding="utf-8"))
    assert len(spectra) == 2 * 33 and spectra[33]["group"] == "<b>granite</b>"
    assert float(spectra[1]["frequency_hz"]) == report.datasets[0].spectra.frequency_hz[1]
    written = {path.name: path.read_text(encoding="utf-8") for path in papers.iterdir()}
    assert set(written) == {"size--edge.tex", "stones--kind.tex", "beside-paper.tex", "sources.bib"}
    assert "Here, 60--6,000 Hz" in written["beside-paper.tex"]
    assert all(braces(text) == 0 for text in written.values())
    assert "<script>" not in "".join(t for n, t in written.items() if n.endswith(".tex"))
    cited = re.findall(r"\\cite{([^}]*)}", "".join(written.values()))
    assert cited and all(f"@misc{{{key}," in written["sources.bib"] for key in cited)
    assert "dataset-stones" in written["sources.bib"]
    before = {p: p.read_bytes() for p in (*tables.iterdir(), *papers.iterdir())}
    write_exports(Paths(tmp_path), report, two_tasks(), tables, papers=papers)
    assert {p: p.read_bytes() for p in (*tables.iterdir(), *papers.iterdir())} == before


@pytest.mark.skipif(not shutil.which("pdflatex"), reason="Debian: texlive-latex-recommended")
def test_latex_sets_the_tables_of_a_report(tmp_path):
    papers = tmp_path / "papers"
    write_exports(Paths(tmp_path), sample_report(), two_tasks(), tmp_path / "t", papers=papers)
    marks = ShownTable(f"{MARKS} α 2σ ⁻²", ("Name", "Number|"), ((MARKS, "−1 ± 2"), ("ß", "—")))
    (papers / "marks.tex").write_text(latex_of(marks, "marks"), encoding="utf-8")
    inputs = "".join(f"\\input{{{path.name}}}\n" for path in sorted(papers.glob("*.tex")))
    whole = "\\documentclass{article}\\usepackage{booktabs}\\begin{document}\n%s\\end{document}"
    (papers / "whole").write_text(whole % inputs, encoding="utf-8")
    command = ["pdflatex", "-interaction=batchmode", "-halt-on-error", "whole"]
    done = subprocess.run(command, cwd=papers, capture_output=True, text=True, check=False)
    assert done.returncode == 0, (papers / "whole.log").read_text(encoding="latin-1")
    assert (papers / "whole.pdf").stat().st_size > 0


def test_two_tables_of_one_name_are_refused_before_anything_is_written(tmp_path):
    twice = (*two_tasks(), two_tasks()[0])
    with pytest.raises(ValueError, match="share a file name, cross-validation--size--edge"):
        write_exports(Paths(tmp_path), sample_report(), twice, tmp_path / "t")
    assert not (tmp_path / "t").exists()
