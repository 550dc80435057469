"""`ajgdata compare`: runs as people name them, what is printed, the page, exit codes."""

import json
import os
import re
import shutil
import subprocess
import sys
import warnings

import pytest
from html_page import Page
from run_samples import ACCURACY, COMMIT_A, COMMIT_B, RMSE, folds, predictions, rows_of

from ajgdata.cli import main
from ajgdata.paths import Paths
from ajgdata.pipeline.collect import COLUMNS
from ajgdata.pipeline.compare import compare_runs
from ajgdata.pipeline.exports import PAPER_KEYS
from ajgdata.report.run_page import render_comparison
from ajgdata.report.run_tables import TOP, changes_table
from ajgdata.store.files import csv_bytes, json_bytes
from ajgdata.store.runs import KEPT, keep_run, kept_runs

TAG = "<script>alert(1)</script>"
HOSTILE = (TAG, "edge", "cnn", "grouped", "rmse")
NO_NUMBER = csv_bytes(COLUMNS, rows_of(RMSE, {"mean": "x"}))
PAPER = dict.fromkeys(PAPER_KEYS, "") | {"figure": "size", "dataset": "size", "task": "edge"}
NEEDS_GIT = pytest.mark.skipif(not shutil.which("git"), reason="Debian: git")
PLACE = ("stones", "kind", "cnn", "grouped")


def write_run(folder, rows, predicted=None, paper=None, document=None):
    """Write the results of a run as `collect` and the report do."""
    folder.mkdir(parents=True)
    (folder / "metrics.csv").write_bytes(csv_bytes(COLUMNS, rows))
    if predicted is not None:
        (folder / "predictions.csv").write_bytes(csv_bytes(list(predicted[0]), predicted))
    if paper is not None:
        tables = folder / "report" / "tables"
        tables.mkdir(parents=True)
        (tables / "beside-paper.csv").write_bytes(csv_bytes(list(paper[0]), paper))
    if document is not None:
        (folder / "metrics.json").write_text(json.dumps(document))
    return folder


def run_a(folder):
    rows = rows_of(RMSE, folds(1, 2, 3), "mm") + rows_of(ACCURACY, folds(0.5, 0.75))
    paper = PAPER | {"agrees": "yes", "result": "2"}
    predicted = predictions(PLACE, {"r1": (0, "x", "x"), "r2": (1, "y", "y")})
    return write_run(folder, rows, predicted, [paper], {"software": {}, "experiments": []})


def run_b(folder):
    rows = rows_of(RMSE, folds(2, 3, 4.1), "mm", COMMIT_B) + rows_of(ACCURACY, folds(0.5, 0.75))
    rows += rows_of(HOSTILE, folds(1, 2), "mm")
    paper = PAPER | {"agrees": "no: higher", "result": TAG}
    predicted = predictions(PLACE, {"r1": (0, "x", "x"), "r2": (1, "y", TAG)})
    document = {"software": {"packages": {"torch": "2"}}, "experiments": []}
    return write_run(folder, rows, predicted, [paper], document)


@pytest.fixture
def runs(tmp_path):
    """The results folders of both runs."""
    return run_a(tmp_path / "a" / "results"), run_b(tmp_path / "b" / "results")


@pytest.fixture
def ajgdata(project, monkeypatch, capsys):
    """Run `ajgdata compare …` in a project; returns exit code, what it printed, complained."""
    monkeypatch.chdir(project.root)
    monkeypatch.delenv("AJGDATA_ROOT", raising=False)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["ajgdata", "compare", *map(str, arguments)])
        with pytest.raises(SystemExit) as stopped:
            main()
        printed = capsys.readouterr()
        return stopped.value.code or 0, printed.out, printed.err

    return run


def git(folder, *arguments):
    command = ["git", "-C", str(folder), "-c", "user.name=n", "-c", "user.email=e", *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


def test_what_changed_is_printed_and_written(ajgdata, runs, project):
    code, out, err = ajgdata(*runs, "--out", "sub/page.html")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[2] == (
        "1 of 2 numbers changed: 1 beyond 2 sd (1 worse). 1 of 2 predicted classes differ. "
        "1 agreements with the paper changed. Numbers: 1 only in B."
    )
    row = next(line for line in lines if line.startswith("size/edge  "))
    # Differences 1, 1 and 1.1: mean 1.033, sample standard deviation 0.0577.
    assert row.split("  ")[0] == "size/edge" and "2.0 ± 1.0 mm" in row and "+1.03 mm" in row
    assert row.endswith("18  worse, beyond")
    assert any("packages.torch" in line and line.split()[1:3] == ["—", "2"] for line in lines)
    assert lines[-1] == "page: sub/page.html"
    page = (project.root / "sub" / "page.html").read_text(encoding="utf-8")
    shown = Page(page)
    assert TAG not in page and "&lt;script&gt;alert(1)" in page
    assert any("worse, beyond" in " ".join(row) for row in shown.rows)
    images = [attributes for tag, attributes in shown.tags if tag == "img"]
    assert len(images) == 2 and all(one["src"].startswith("data:image/svg") for one in images)
    assert "1 of 2 numbers changed" in images[0]["alt"]
    addresses = [a[key] for _, a in shown.tags for key in ("href", "src") if key in a]
    assert not [one for one in addresses if not one.startswith(("data:", "#"))]


def test_the_same_page_for_the_same_runs(runs):
    pages = [render_comparison(compare_runs(*map(str, runs))) for _ in range(2)]
    assert pages[0] == pages[1]


def test_the_same_numbers_are_one_line_and_no_page(ajgdata, runs, project):
    assert ajgdata(runs[0], runs[0].parent) == (0, "Same numbers: all 2 of them.\n", "")
    assert not (project.root / "compare.html").exists()


def test_worse_can_be_an_exit_code(ajgdata, runs):
    a, b = runs
    assert ajgdata(a, b, "--fail-on-worse", "--json")[0] == 3
    assert ajgdata(b, a, "--fail-on-worse", "--json")[0] == 0
    assert ajgdata(a, a, "--fail-on-worse")[0] == 0


def test_json_says_all(ajgdata, runs, project):
    code, out, _ = ajgdata(*runs, "--json")
    told = json.loads(out)
    assert code == 0 and not told["same"] and not (project.root / "compare.html").exists()
    (one,) = told["changed"]
    assert (one["dataset"], one["direction"], one["beyond"], one["paired"]) == (
        "size",
        "worse",
        True,
        True,
    )
    assert one["difference"] == pytest.approx(3.1 / 3, rel=1e-12)
    assert told["only_b"][0]["dataset"] == TAG and told["equal_numbers"] == 1
    assert told["b"]["commits"] == [COMMIT_A, COMMIT_B]


def test_a_run_may_be_a_project_a_file_or_a_table_by_itself(runs, tmp_path):
    a, b = runs
    table = tmp_path / "kept.csv"
    table.write_bytes((b / "metrics.csv").read_bytes())
    ways = (a, a.parent, a / "metrics.csv", a / "metrics.json")
    for way in ways:
        found = compare_runs(str(way), str(b))
        assert len(found.numbers.changed) == len(found.flips) == len(found.verdicts) == 1
        assert found.missing == ()
    alone = compare_runs(str(a), str(table))
    assert len(alone.numbers.changed) == 1 and not alone.flips
    assert [re.match(r"\w+", what)[0] for what in alone.missing] == [
        "predictions",
        "agreement",
        "settings",
    ]


OF_OTHERS = json_bytes({"experiments": [], "sha256": {"metrics.csv": "0" * 64}})


@pytest.mark.parametrize(
    ("break_it", "said"),
    [
        (lambda a: (a / "metrics.csv").unlink(), "metrics.csv: there is no such file; make"),
        (lambda a: (a / "metrics.csv").write_text("a,b\n1,2\n"), "column dataset, task"),
        (lambda a: (a / "metrics.json").write_text("{"), "metrics.json:1: not valid JSON"),
        (lambda a: (a / "metrics.json").write_text("[]"), "metrics.json: holds no keys"),
        (lambda a: (a / "metrics.json").write_bytes(OF_OTHERS), "metrics.csv: is not what metrics"),
        (lambda a: (a / "predictions.csv").write_text("recording\nr\n"), "column dataset"),
        (lambda a: (a / "metrics.csv").write_bytes(NO_NUMBER), "'x' is not a number"),
    ],
)
def test_what_is_wrong_with_a_run_is_one_line(ajgdata, runs, break_it, said):
    break_it(runs[0])
    code, out, err = ajgdata(*runs)
    assert (code, out) == (1, "") and err.startswith("error ") and err.count("\n") == 1
    assert said in err


def keep(project, commit, folder, digest="d" * 12):
    files = [folder / name for name in ("metrics.csv", "metrics.json", "predictions.csv")]
    keep_run(project.paths, commit, digest, files)


def test_runs_are_kept_by_commit_the_newest_alone(project, runs):
    for number in range(KEPT + 2):
        keep(project, f"{number:040x}", runs[0])
        newest = kept_runs(project.paths)[0].folder
        os.utime(newest, (number, number))
    kept = kept_runs(project.paths)
    assert [one.commit for one in kept] == [f"{n:040x}" for n in range(KEPT + 1, 1, -1)]
    assert (kept[0].folder / "metrics.csv").read_bytes() == (runs[0] / "metrics.csv").read_bytes()
    keep(project, "", runs[0])  # no git: nobody could ask for it
    assert len(kept_runs(project.paths)) == KEPT
    for path in kept[0].folder.iterdir():
        assert path.stat().st_nlink == 1  # an edit of the results leaves what is kept


@NEEDS_GIT
def test_commits_are_found_by_name_and_by_beginning(ajgdata, runs, project):
    git(project.root, "init", "--quiet")
    for _ in range(3):
        git(project.root, "commit", "--quiet", "--allow-empty", "--message", "m")
    git(project.root, "tag", "first", "HEAD~2")
    first, head = git(project.root, "rev-parse", "first"), git(project.root, "rev-parse", "HEAD")
    keep(project, first, runs[0])
    keep(project, f"{head}+", runs[1])
    keep(project, "c" * 40, runs[0])  # of a repository that is not here
    for a in ("first", "HEAD~2", first[:8], "cccc"):
        code, out, err = ajgdata(a, "HEAD", "--json")
        assert (code, err) == (0, ""), a
        told = json.loads(out)
        assert len(told["changed"]) == 1
        assert told["b"]["note"] == "made when the files had changes that were not committed"
    keep(project, first, runs[1], "e" * 12)
    os.utime(kept_runs(project.paths)[0].folder)
    assert "(first, commits aaaaaaaaaa" in (said := ajgdata("first", runs[1])[1])
    assert "the newest of 2 runs of this commit" in said and said.count("\n") == 1


@NEEDS_GIT
def test_a_commit_without_a_run_says_what_to_do(ajgdata, runs, project):
    git(project.root, "init", "--quiet")
    git(project.root, "commit", "--quiet", "--allow-empty", "--message", "m")
    short = git(project.root, "rev-parse", "HEAD")[:10]
    code, out, err = ajgdata("HEAD", runs[0])
    assert (code, out) == (1, "") and err.count("\n") == 1
    beside = f"../{project.root.name}-{short}"
    assert f"git worktree add {beside} {short} && (cd {beside} && snakemake)" in err
    assert err.endswith("no run is kept yet\n")
    keep(project, "c" * 40, runs[0])
    for name in ("HEAD", "nothing", "--upload-pack=x", "dddd"):
        code, _, err = ajgdata("--", name, runs[0])
        assert code == 1 and err.endswith("runs are kept of cccccccccc\n")


def test_outside_of_a_project_folders_are_compared_all_the_same(monkeypatch, tmp_path, runs):
    monkeypatch.chdir(tmp_path)
    assert compare_runs("a", "b").numbers.changed
    with pytest.raises(Exception, match="HEAD: there is no such file or folder; no project at"):
        compare_runs("HEAD", "b")


@pytest.mark.parametrize(
    ("key", "before", "after"),
    [
        (RMSE, folds(0, 0, 0), folds(0, 0.5, 1)),  # a logarithm would have no end
        (RMSE, folds(1, 2, 3), folds(2, 3, 4)),  # all alike: infinitely many deviations
        (RMSE, {"mean": 1}, {"mean": 2}),  # no spread
        (("d", "t", "", "distances", "x to y"), folds(1, 2), folds(3, 9)),  # nothing is better
        (ACCURACY, folds(1, 1), folds(0, 0)),
    ],
)
def test_figures_of_odd_numbers_are_drawn(tmp_path, key, before, after):
    a, b = rows_of(key, before, "mm"), rows_of(key, after, "mm")
    found = compare_runs(str(write_run(tmp_path / "a", a)), str(write_run(tmp_path / "b", b)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        page = Page(render_comparison(found))
    drawn = [attributes for tag, attributes in page.tags if tag == "figure"]
    known = "mean" not in before
    shown = key[-1] in ("rmse", "accuracy")
    assert [one["id"] for one in drawn] == ["changes"] * known + ["both-runs"] * shown


def test_most_is_shown_and_all_on_request(ajgdata, tmp_path):
    keys = [("d", f"t{n:02}", "cnn", "grouped", "rmse") for n in range(TOP + 5)]
    a = [row for key in keys for row in rows_of(key, folds(1, 2, 3))]
    b = [row for n, key in enumerate(keys) for row in rows_of(key, folds(2, 3 + n / 10, 4))]
    mae = ("d", "t00", "cnn", "grouped", "mae")  # says again what rmse says
    a, b = a + rows_of(mae, folds(1, 2)), b + rows_of(mae, folds(2, 4))
    folders = write_run(tmp_path / "1", a), write_run(tmp_path / "2", b)
    found = compare_runs(*map(str, folders))
    assert len(found.leading()) == TOP + 5 and len(found.numbers.changed) == TOP + 6
    assert len(changes_table(found.numbers.changed, "").rows) == TOP + 6
    for options, count in (((), TOP), (("--all",), TOP + 6)):
        out = ajgdata(*folders, "--out", "p.html", *options)[1]
        assert sum(line.startswith("d/t") for line in out.splitlines()) == count
    page = Page((Paths().root / "p.html").read_text(encoding="utf-8"))
    assert sum(row[0].startswith("d/t") for row in page.rows if row) == TOP + TOP + 6
