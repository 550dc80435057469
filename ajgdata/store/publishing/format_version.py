"""The version of the format of a published data set, which datapackage.json states."""

from __future__ import annotations

from ajgdata.paths import Tree
from ajgdata.store.files import read_json
from ajgdata.types import DataError
from ajgdata.types.formats import PACKAGE_KEY, PUBLISHED_FORMAT

#: Largest datapackage.json that is read; it has a few lines per column of the labels.
MAX_PACKAGE_BYTES = 8 * 2**20


def check_published_format(tree: Tree) -> None:
    """Raise FormatError if another version of ajgdata published the data set in a folder.

    Raises DataError if datapackage.json is not a JSON object. A folder without this file states no
    version.
    """
    path = tree / Tree.DATAPACKAGE
    if not path.is_file():
        return
    again = "fetch or copy it again"
    try:
        content = read_json(path, MAX_PACKAGE_BYTES)
    except DataError as error:
        raise DataError(error.where, error.problem, again) from None
    if not isinstance(content, dict):
        raise DataError(path, "is not a JSON object", again)
    PUBLISHED_FORMAT.check(path, content.get(PACKAGE_KEY))
