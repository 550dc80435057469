"""`reports/`: found in a checkout and in an installed package; a project's own files come first."""

from html.parser import HTMLParser
from pathlib import Path

import pytest

from ajgdata.paths import Paths
from ajgdata.report.render import environment, render_markdown
from ajgdata.store.report_files import (
    MACHINE_SPREAD_FILE,
    PACKAGED,
    read_machine_spread,
    report_file,
    report_files_digest,
)

ROOT = Path(__file__).parents[2]


@pytest.fixture
def project(tmp_path):
    (tmp_path / "reports/templates").mkdir(parents=True)
    (tmp_path / "reports/experiments").mkdir()
    return Paths(tmp_path)


def test_a_file_of_the_project_takes_the_place_of_the_packaged_one(project):
    own = project.reports / "templates/style.css"
    packaged = environment(project).get_template("style.css").render()
    assert packaged == environment(Paths(ROOT)).get_template("style.css").render() != ""
    own.write_text("p { color: red }")
    assert environment(project).get_template("style.css").render() == "p { color: red }"
    assert report_file(project, "templates/style.css") == own
    assert report_file(project, "paper.yaml") == PACKAGED / "paper.yaml"


def test_of_a_published_value_the_largest_difference_between_machines_counts(project):
    (project.reports / MACHINE_SPREAD_FILE).write_text(
        "rows:\n- {figure: a, spread: 0.1}\n- {figure: b, spread: 2}\n- {figure: a, spread: 0.3}\n"
        "- {figure: a, spread: 0.2}\n"
    )
    assert read_machine_spread(project) == {"a": 0.3, "b": 2}


@pytest.mark.parametrize(
    "name", ["paper.yaml", MACHINE_SPREAD_FILE, "templates/new.css", "experiments/new.md"]
)
def test_the_digest_sees_every_edit_and_nothing_else(project, name):
    before = report_files_digest(project)
    (project.reports / "README.md").write_text("not part of any page")
    (project.reports / "templates/.base.html.j2").write_text("an editor's swap file")
    assert report_files_digest(project) == before
    (project.reports / name).write_text("edited")
    assert report_files_digest(project) != before


@pytest.mark.parametrize(
    "text",
    [
        "<script>alert(1)</script>",
        "[x](javascript:alert(1))",
        '[x](https://a.b ""><script>alert(1)</script>")',
    ],
)
def test_markdown_cannot_bring_in_what_runs(text):
    tags: list[tuple[str, dict]] = []
    reader = HTMLParser()
    reader.handle_starttag = lambda tag, given: tags.append((tag, dict(given)))
    reader.feed(render_markdown(text))
    assert {tag for tag, _ in tags} <= {"p", "a"}
    assert all(set(given) <= {"href", "title"} for _, given in tags)
    assert all(given.get("href", "https:").startswith("https:") for _, given in tags)
