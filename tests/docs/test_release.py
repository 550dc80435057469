"""Addresses, version and description of the project are the same in all files."""

import datetime
import json
import re
import subprocess
import tomllib
from pathlib import Path

import pytest
import yaml

from tools.address import project_urls, rewrite, snakemake_reference, tracked_texts

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text())
ZENODO = json.loads((ROOT / ".zenodo.json").read_text())
#: Addresses of the project: what git clones, what pip installs, and what ends in its name.
ADDRESS = re.compile(
    r"git clone (https?://[^\s`\"']+)|git\+(https?://[^\s`\"'\\]+?)(?:@[\w.]+)?(?=[\s`\"'\\])"
    r"|(https?://[\w./~-]+/ajgdata)(?![\w-])"
)
#: Headings of versions in the changelog.
RELEASES = re.compile(r"^## \[(\d+\.\d+\.\d+)\] - (\d{4}-\d\d-\d\d)$", re.M)


#: Hosts of examples: reserved by RFC 2606, and this computer.
EXAMPLE = re.compile(r"//([^/\s]*@)?(example\.org|127\.0\.0\.1)\b")


def addresses(text: str) -> set[str]:
    """Return the addresses of the project in a text; those of examples are not of the project."""
    found = {next(filter(None, match.groups())) for match in ADDRESS.finditer(text)}
    return {address for address in found if not EXAMPLE.search(address)}


@pytest.fixture
def own_files():
    if not (ROOT / ".git").exists():
        pytest.skip("needs a clone")
    return {path: text for path, text in tracked_texts(ROOT).items() if path != Path(__file__)}


def test_all_files_have_the_addresses_of_pyproject(own_files):
    urls = project_urls(ROOT)
    allowed = {urls["Source"], urls["Documentation"]}
    other = {
        (str(path.relative_to(ROOT)), address)
        for path, text in own_files.items()
        for address in addresses(text) - allowed
    }
    assert other == set(), "edit [project.urls] in pyproject.toml, then run `make address`"
    for name in ("README.md", "docs/use-the-data.md", "docs/examples/explore_sample.ipynb"):
        assert urls["Source"] in own_files[ROOT / name]
    references = {
        (reference, tag)
        for text in own_files.values()
        for reference, tag in re.findall(r'\b(git\w+\("[^"]+").*tag="([^"]+)"', text)
    }
    assert references == {(snakemake_reference(urls["Source"]), f"v{PROJECT['version']}")}
    assert urls["Homepage"] == urls["Source"]
    assert urls["Issues"].startswith(urls["Source"] + "/")
    assert urls["Changelog"].startswith(urls["Source"] + "/")


def test_no_file_has_a_word_in_place_of_the_address(own_files):
    word = re.compile(r"\bREPOSITORY\b|clone URL\b")
    pages = {path: text for path, text in own_files.items() if path.suffix in {".md", ".ipynb"}}
    assert [path.name for path, text in pages.items() if word.search(text)] == []


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("git clone https://a.org/x/jam ajgdata", {"https://a.org/x/jam"}),
        ("pip install 'git+https://a.org/x/jam@v1'", {"https://a.org/x/jam"}),
        ("see https://a.org/x/ajgdata/issues", {"https://a.org/x/ajgdata"}),
        ("see https://a.org/x/ajgdata-data", set()),
        ("fetch git+https://anna:secret@example.org/d ", set()),
    ],
)
def test_addresses_are_recognised(text, expected):
    assert addresses(text) == expected


def test_an_edit_of_pyproject_changes_all_files(tmp_path):
    source = "https://github.com/lab/jamming"
    site = "https://lab.github.io/jamming"
    new = "https://github.com/lab/jamming-2"
    (tmp_path / "pyproject.toml").write_text(
        f'[project.urls]\nSource = "{new}"\nIssues = "{source}/issues"\nDocumentation = "{site}"\n'
    )
    (tmp_path / "CITATION.cff").write_text(f"repository-code: {source}\nurl: {site}\n")
    text = 'git clone {0}\n{1}-data\n{2}\nsnakefile: github("{3}", path="a")\n'
    (tmp_path / "README.md").write_text(text.format(source, source, site, "lab/jamming"))
    (tmp_path / "sound.wav").write_bytes(b"RIFF\0" + source.encode())
    subprocess.run(["git", "init", "-q"], cwd=tmp_path, check=True)
    subprocess.run(["git", "add", "."], cwd=tmp_path, check=True)
    changed = {path.name for path in rewrite(tmp_path)}
    assert changed == {"pyproject.toml", "CITATION.cff", "README.md"}
    expected = text.format(new, source, site, "lab/jamming-2")
    assert (tmp_path / "README.md").read_text() == expected
    assert project_urls(tmp_path) == {
        "Source": new,
        "Issues": f"{new}/issues",
        "Documentation": site,
    }
    assert rewrite(tmp_path) == []


def test_the_version_is_the_same_everywhere():
    releases = RELEASES.findall((ROOT / "CHANGELOG.md").read_text())
    assert releases[0] == (PROJECT["version"], str(CITATION["date-released"]))
    assert str(CITATION["version"]) == PROJECT["version"]
    workflow = (ROOT / "workflow/Snakefile").read_text(encoding="utf-8")
    assert f'require_version("{PROJECT["version"]}")' in workflow
    assert isinstance(CITATION["date-released"], datetime.date)


def test_citation_and_zenodo_describe_the_project():
    urls = project_urls(ROOT)
    assert CITATION["repository-code"] == urls["Source"]
    assert CITATION["url"] == urls["Documentation"]
    assert CITATION["license"] == ZENODO["license"] == PROJECT["license"]
    assert CITATION["keywords"] == ZENODO["keywords"] == PROJECT["keywords"]
    assert CITATION["title"] == ZENODO["title"]
    assert CITATION["abstract"] == ZENODO["description"]
    title = CITATION["title"].removeprefix("ajgdata: ")
    assert title == PROJECT["description"][0].lower() + PROJECT["description"][1:]
    names = [author["name"] for author in PROJECT["authors"]]
    assert [author["name"] for author in CITATION["authors"]] == names
    assert [creator["name"] for creator in ZENODO["creators"]] == names
    related = {item["identifier"] for item in ZENODO["related_identifiers"]}
    assert related == {CITATION["references"][0]["doi"], urls["Documentation"]}


def test_python_versions_of_pyproject_are_those_of_the_continuous_tests():
    prefix = "Programming Language :: Python :: 3."
    stated = {f"3.{c.removeprefix(prefix)}" for c in PROJECT["classifiers"] if prefix in c}
    workflow = yaml.safe_load((ROOT / ".github/workflows/test.yml").read_text())
    assert stated == set(workflow["jobs"]["test"]["strategy"]["matrix"]["python"])
    assert PROJECT["requires-python"] == f">={min(stated)}"
