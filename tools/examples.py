"""`python -m tools.examples`: copy the examples into the pages of docs/ that show them.

A page names the file in two comments, and the code between them is replaced:

    <!-- example: docs/examples/first_plot.py -->
    <!-- /example -->

The pages contain the code, so that they show it everywhere. `make docs` runs this tool.
"""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted((ROOT / "docs").glob("*.md"))
BEGIN = "<!-- example: "
#: An example: the first comment, the file that it names, and the last comment.
EXAMPLE = re.compile(rf"({BEGIN}(\S+) -->\n)(?:(?!{BEGIN}).)*?(<!-- /example -->)", flags=re.DOTALL)
#: Language of a code block by the end of the file's name.
LANGUAGES = {".py": "python", ".toml": "toml", ".yaml": "yaml"}


def with_examples(page: str) -> str:
    """Return the text of a page with the present content of its examples.

    Raises ValueError if an example has no last comment, and OSError if a file is missing.
    """
    text, n_examples = EXAMPLE.subn(_with_code, page)
    if n_examples != page.count(BEGIN):
        raise ValueError("an example has no comment <!-- /example -->")
    return text


def _with_code(example: re.Match[str]) -> str:
    """Return an example with the content of its file."""
    first, name, last = example.groups()
    file = ROOT / name
    code = file.read_text(encoding="utf-8")
    return f"{first}\n```{LANGUAGES[file.suffix]}\n{code}```\n\n{last}"


if __name__ == "__main__":
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        page.write_text(with_examples(text), encoding="utf-8")
