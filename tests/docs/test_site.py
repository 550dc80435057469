"""The documentation's site is built without a warning, and needs nothing from elsewhere."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
SETTINGS = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))


def pages(nav: object) -> list[str]:
    if isinstance(nav, str):
        return [nav]
    parts = nav.values() if isinstance(nav, dict) else nav
    return [page for part in parts for page in pages(part)]


def anchors(page: Path) -> set[str]:
    """Return the addresses of the headings of a page."""
    titles = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), flags=re.M)
    return {re.sub(r"[^\w\s-]", "", title.strip().lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("name", ["README.md", "CONTRIBUTING.md", *pages(SETTINGS["nav"])])
def test_links_lead_to_pages_and_headings(name):
    page = ROOT / name if (ROOT / name).is_file() else ROOT / "docs" / name
    links = re.findall(r"\]\((?!https?:)([^)\s]+)\)", page.read_text(encoding="utf-8"))
    for link in links:
        file, _, heading = link.partition("#")
        target = page.parent / file if file else page
        assert target.exists(), link
        assert not heading or heading in anchors(target), link


def test_every_page_is_in_the_menu():
    docs = ROOT / "docs"
    files = [*docs.glob("*.md"), *docs.glob("examples/*.ipynb")]
    assert {path.relative_to(docs).as_posix() for path in files} == set(pages(SETTINGS["nav"]))


def test_the_site_is_built_without_a_warning(tmp_path):
    pytest.importorskip("mkdocs", reason="`make docs` installs it")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", tmp_path],
        cwd=ROOT,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1", "PYTHONPATH": str(ROOT)},
        check=False,
        capture_output=True,
        text=True,
    )
    errors = [line for line in done.stderr.splitlines() if not line.startswith("[IPKernelApp]")]
    assert (done.returncode, done.stdout, errors) == (0, "", [])
    for page in tmp_path.rglob("*.html"):
        content = page.read_text(encoding="utf-8")
        assert not re.search(r"<(script|img|link|source)[^>]+(src|href)=\"https?://", content)
    assert "load_recordings" in (tmp_path / "python.html").read_text(encoding="utf-8")
    assert "groupby" in (tmp_path / "examples.html").read_text(encoding="utf-8")
    for name, media, count in (
        ("explore_sample", "data:image/png", 2),
        ("paper_figure", "data:image/png", 1),
        ("own_recordings", "data:audio/wav", 2),
    ):
        notebook = (tmp_path / f"examples/{name}.html").read_text(encoding="utf-8")
        assert notebook.count(media) >= count, name
