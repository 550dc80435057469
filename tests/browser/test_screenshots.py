"""Pictures of a report for the docs: what a browser shows, small, and the same each time."""

import io

import numpy as np
import pytest
from PIL import Image

from tools import screenshots
from tools.screenshots import COLOURS, SHOTS, write_screenshots

pytestmark = pytest.mark.browser


def test_screenshots_are_of_the_first_screen(browser, sample, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(screenshots, "IMAGES", tmp_path)
    write_screenshots(sample.index)
    assert capsys.readouterr().out.count("wrote") == len(SHOTS)
    mean = {}
    for name, shot in SHOTS.items():
        with Image.open(tmp_path / f"{name}.png") as picture:
            size = round(shot.width * shot.scale), round(shot.height * shot.scale)
            assert picture.size == size and len(picture.getcolors()) <= COLOURS
            mean[name] = np.asarray(picture.convert("L")).mean()
    assert mean["report-dark"] < 80 and mean["report"] > 200
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
