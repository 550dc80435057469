"""Pictures of a report for the docs: what a browser shows, small, and the same each time."""

import io

import numpy as np
import pytest
from PIL import Image

from tools import screenshots
from tools.screenshots import COLOURS, SCREEN, write_screenshots

pytestmark = pytest.mark.browser


def test_the_screenshot_is_of_the_first_screen(browser, sample, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(screenshots, "IMAGES", tmp_path)
    write_screenshots(sample.index)
    assert capsys.readouterr().out.count("wrote") == 1
    with Image.open(tmp_path / "report.png") as picture:
        assert picture.size == SCREEN and len(picture.getcolors()) <= COLOURS
        assert np.asarray(picture.convert("L")).mean() > 200
    write_screenshots(sample.index)
    assert capsys.readouterr().out == ""  # the same bytes


def test_rare_colours_are_kept():
    """A hundred shades of grey, and a badge of 40 orange pixels."""
    page = np.repeat(np.linspace(0, 255, 100).astype(np.uint8), 900).reshape(300, 300)
    page = np.stack([page] * 3, axis=-1)
    page[:4, :10] = 179, 71, 0
    stream = io.BytesIO()
    Image.fromarray(page).save(stream, format="PNG")
    with Image.open(io.BytesIO(screenshots.small(stream.getvalue()))) as few:
        kept = np.asarray(few.convert("RGB"))[0, 0].astype(int)
    assert np.abs(kept - [179, 71, 0]).max() <= 8
