"""The README's table is that of the run that it names. Rule `verify` runs this."""

import pytest

from ajgdata.paths import Paths
from tools.readme_table import README, ROWS, readme_table, written

pytestmark = pytest.mark.artefact


def test_the_table_was_not_edited():
    table = readme_table(Paths().metrics_table.read_bytes())
    assert table.count("\n|") == len(ROWS) + 2
    current = written(README.read_text(encoding="utf-8"))
    if table.splitlines()[-2] in current:
        assert table == current
