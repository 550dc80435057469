"""`python -m tools.start_pictures [--report DIR]`: write the pictures of docs/start.md.

An example program and the virtual gripper give two pictures. The other two are of a report on
recordings of another laboratory: `ajgdata fetch active_rp`, then `ajgdata run active_rp`.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from ajgdata.browse.site import browsing
from ajgdata.browse.view import View
from ajgdata.paths import Paths
from tools.browser import Browser, browser, missing
from tools.screenshots import ROOT, WIDTH, check_size, small, write_picture

PAGE = ROOT / "docs/start.md"
#: Data set of the recordings of another laboratory, and that of the virtual gripper.
RECORDED, TRIAL = "active_rp", "trial"
BROWSE_HEIGHT = 900  #: CSS pixels
BROWSE_COLOURS = 64  #: a spectrogram has more colours than a table
DRAWING_S = 3.0  #: the page of a recording draws its spectrogram last
#: Script that scrolls to an element, and returns the bottom of another element in CSS pixels.
SCROLL = """
const [top, bottom] = arguments
document.querySelector(top).scrollIntoView()
return Math.ceil(document.querySelector(bottom).getBoundingClientRect().bottom) + 16
"""


def first_plot() -> bytes:
    """Return the figure of the example program."""
    with tempfile.TemporaryDirectory() as folder:
        program = ROOT / "docs/examples/first_plot.py"
        subprocess.run([sys.executable, program], cwd=folder, check=True)
        return small((Path(folder) / "first_plot.png").read_bytes())


def part_of_page(window: Browser, page: Path, top: str, bottom: str) -> bytes:
    """Return a page from the top of one element to the bottom of another (CSS selectors)."""
    window.window(WIDTH)
    window.open(page.resolve().as_uri())
    window.window(WIDTH, window.run(SCROLL, top, bottom))
    window.run(SCROLL, top, bottom)
    return small(window.picture())


def trial_page(window: Browser) -> bytes:
    """Record and run the data set of the page, and return the page of its recordings."""
    dataset = re.findall(r"^```yaml\n(.*?)^```", PAGE.read_text("utf-8"), re.M | re.S)[0]
    command = Path(sys.executable).with_name("ajgdata")
    with tempfile.TemporaryDirectory() as folder:
        project = Path(folder) / "lab"
        subprocess.run([command, "new", project], check=True)
        (project / "datasets" / TRIAL).mkdir()
        (project / "datasets" / TRIAL / "dataset.yaml").write_text(dataset, "utf-8")
        for arguments in (["record", TRIAL, "--source", "virtual"], ["run", TRIAL]):
            subprocess.run([command, *arguments], cwd=project, check=True)
        with browsing(View(Paths(project), TRIAL)) as address:
            window.window(WIDTH, BROWSE_HEIGHT)
            window.open(address)
            time.sleep(DRAWING_S)
            return small(window.picture(), BROWSE_COLOURS)


def write_pictures(report: Path) -> None:
    """Write the pictures; `report` is the folder of the report on the recorded data set.

    Without a report or a browser, prints what is missing and leaves the pictures unchanged.
    """
    write_picture("first-plot", first_plot())
    install_commands = missing()
    if install_commands:
        print(f"pictures: unchanged, not installed: {install_commands}")
        return
    with browser() as window:
        window.medium(dark=False, printed=False)
        write_picture("trial", trial_page(window))
        diagnosis = report / "diagnosis.html"
        if diagnosis.is_file():
            write_picture("diagnosis", part_of_page(window, diagnosis, "h1", "main table"))
            task = report / "experiments" / f"{RECORDED}.html"
            first_list = "#predictions + details"
            picture = part_of_page(window, task, "#predictions", first_list)
            write_picture("wrong-predictions", picture)
        else:
            print(f"pictures: unchanged, there is no {diagnosis}; run `ajgdata run {RECORDED}`")
    check_size()


def main() -> None:
    """Write the pictures of the page."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--report", type=Path, default=Paths(run=RECORDED).report.parent)
    write_pictures(options.parse_args().report)


if __name__ == "__main__":
    main()
