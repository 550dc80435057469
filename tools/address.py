"""Write the addresses of the project into all files (`make address`).

`[project.urls]` in pyproject.toml is the place to edit: `Source` is the address of the repository,
`Documentation` that of the site. CITATION.cff still has the addresses before the edit. They are
replaced in every text file that git tracks, and so also in CITATION.cff.
"""

import re
import subprocess
import tomllib
from pathlib import Path
from urllib.parse import urlsplit

import yaml

ROOT = Path(__file__).resolve().parents[1]


def project_urls(root: Path) -> dict[str, str]:
    """Return the addresses in pyproject.toml by their names."""
    return tomllib.loads((root / "pyproject.toml").read_text())["project"]["urls"]


def snakemake_reference(source: str) -> str:
    """Return the beginning of a reference to a workflow in a repository, for a Snakefile.

    >>> snakemake_reference("https://github.com/lab/gripper")
    'github("lab/gripper"'
    >>> snakemake_reference("https://gitlab.com/lab/gripper")
    'gitlab("lab/gripper"'
    """
    parts = urlsplit(source)
    return f'{parts.hostname.removesuffix(".com")}("{parts.path.strip("/")}"'


def tracked_files(root: Path) -> list[Path]:
    """Return the files that git tracks, without deleted files."""
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=root, check=True, capture_output=True, text=True
    )
    paths = [root / name for name in listed.stdout.split("\0")]
    return [path for path in paths if path.is_file()]


def tracked_texts(root: Path) -> dict[Path, str]:
    """Return the text files that git tracks, with their contents."""
    texts = {}
    for path in tracked_files(root):
        content = path.read_bytes()
        if b"\0" not in content:
            texts[path] = content.decode()
    return texts


def replaced_addresses(root: Path) -> dict[str, str]:
    """Return the addresses before the edit with their new values, if they differ."""
    citation = yaml.safe_load((root / "CITATION.cff").read_text())
    urls = project_urls(root)
    before = citation["repository-code"]
    new = {
        before: urls["Source"],
        citation["url"]: urls["Documentation"],
        snakemake_reference(before): snakemake_reference(urls["Source"]),
    }
    return {before: after for before, after in new.items() if before != after}


def rewrite(root: Path) -> list[Path]:
    """Replace the addresses before the edit in all files. Return the files that changed."""
    replaced = replaced_addresses(root)
    changed = []
    for path, text in tracked_texts(root).items():
        new = text
        for before, after in replaced.items():
            # The name of the repository ends here: `ajgdata-data` is another repository.
            new = re.sub(re.escape(before) + r"(?![\w-])", after, new)
        if new != text:
            path.write_bytes(new.encode())
            changed.append(path)
    return changed


if __name__ == "__main__":
    for path in rewrite(ROOT):
        print(path.relative_to(ROOT))
