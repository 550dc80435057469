"""The opening picture: times of the drawn sound, and the reason if it is not drawn."""

import numpy as np
import pytest
from experiment_samples import small_store

from ajgdata.gripper import Scene
from ajgdata.paths import Paths
from ajgdata.pipeline import opening as adapter
from ajgdata.pipeline.opening import build_opening, sound_field
from ajgdata.store.features import write_store
from ajgdata.store.files import read_json
from ajgdata.store.tables import write_measurements
from ajgdata.types import AudioSettings


def test_sound_is_at_the_object_and_at_the_microphone_when_it_is_said_to_be(monkeypatch):
    monkeypatch.setattr(adapter, "FIELD_MM", 3.0)
    scene = Scene.model_validate({"object": "golf_ball"})
    field = sound_field(scene)
    moments = 1e3 * field.times_s
    assert field.frames.shape[0] == 3 and list(moments) == sorted(moments)
    # 345 m/s: from (-35, 45) mm to the top of the ball, some 22 mm below the rim, and to (34, 45)
    assert moments[1] == pytest.approx(np.hypot(35, 67) / 345, rel=0.05)
    assert moments[2] == pytest.approx((np.hypot(35, 67) + np.hypot(34, 67)) / 345, rel=0.05)

    def loudest(index, x_mm, z_mm):
        near = np.abs(field.across_m - x_mm / 1e3)[None] + np.abs(field.up_m - z_mm / 1e3)[:, None]
        return np.abs(field.frames[index])[near < 8e-3].max() / np.abs(field.frames[0]).max()

    at_object, at_microphone = [[loudest(n, *at) for n in range(3)] for at in ((0, -18), (34, 42))]
    assert at_object[0] < 0.01 < at_object[1]
    assert at_microphone[0] < 0.01 < at_microphone[2]


def test_a_skipped_result_has_no_picture_but_the_reason(tmp_path):
    paths = Paths(tmp_path)
    write_store(paths.features("d"), small_store())
    tables = tmp_path / "tables.json"
    write_measurements(tables, [({"skipped": "one group"}, [])])
    build_opening(paths, store=paths.features("d"), tables=tables, audio=AudioSettings())
    assert read_json(paths.opening) == {"skipped": "one group"}
    assert list(paths.opening.parent.iterdir()) == [paths.opening]
