"""A browser, and folders of pages to look at."""

import importlib.util
import os
import signal
import sys
from pathlib import Path

import pytest

from tools import browser as browsers

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))  # recorded
sys.path.insert(0, str(ROOT / "tests/unit"))  # report_samples

from measured import measured_site  # noqa: E402
from sites import Site, sample_site  # noqa: E402

#: Set it to fail, rather than skip, where something is not installed.
REQUIRED = "AJGDATA_REQUIRE_BROWSER"
#: Folder of another report to look at.
REPORT = "AJGDATA_REPORT"
#: Python packages by module.
PACKAGES = {"axe_selenium_python": "axe-selenium-python-nhsuk", "pypdf": "pypdf"}


# Lets fixtures end what they started, as after Ctrl-C.
signal.signal(signal.SIGTERM, signal.default_int_handler)


@pytest.fixture(scope="session")
def browser():
    what = browsers.missing(**PACKAGES)
    if what:
        (pytest.fail if REQUIRED in os.environ else pytest.skip)(f"not installed: {what}")
    with browsers.browser() as instance:
        yield instance


@pytest.fixture(scope="session")
def axe(browser):
    """The script of axe, which needs no page of its own."""
    package = importlib.util.find_spec("axe_selenium_python")
    script = Path(package.origin).parent / "node_modules/axe-core/axe.min.js"
    return script.read_text(encoding="utf-8")


@pytest.fixture(scope="session")
def sample(tmp_path_factory):
    """A small report with hostile names."""
    return sample_site(tmp_path_factory.mktemp("site"))


@pytest.fixture(scope="session")
def measured(tmp_path_factory):
    """The report of AJGDATA_REPORT or of the last run; in a clean clone, a small one is made."""
    folder = Path(os.environ.get(REPORT, ROOT / "results/report")).resolve()
    if (folder / "index.html").is_file():
        return Site(folder)
    if REPORT in os.environ:
        pytest.fail(f"{REPORT}: {folder} has no index.html")
    return measured_site(tmp_path_factory.mktemp("measured"))


@pytest.fixture(scope="session", params=["sample", "measured"])
def site(request):
    """A report with hostile names, and one of measurements."""
    return request.getfixturevalue(request.param)
