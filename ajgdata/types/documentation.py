"""Addresses of pages of the documentation, for messages."""

from importlib.metadata import metadata

from ajgdata.types.extras import PACKAGE


def documentation(page: str) -> str:
    """Return the address of a page, such as `variants`.

    pyproject.toml has the address of the documentation; the installed package repeats it.
    """
    urls = dict(text.split(", ", 1) for text in metadata(PACKAGE).get_all("Project-URL") or [])
    return f"{urls['Documentation']}/{page}.html"
