"""Dates to come."""

import os
import time

from ajgdata.store.clock import latest_s, mend_dates


def test_dates_to_come_are_now_and_others_stay(tmp_path):
    flat = tmp_path / "flat"
    (tmp_path / "a/b").mkdir(parents=True)
    (flat / "tree").mkdir(parents=True)
    soon, old = time.time() + 1000, 1_000_000_000.0
    dates = {"a/b/new": soon, "a/old": old, "flat/beside": soon + 1, "flat/tree/in": soon + 9}
    for name, date in dates.items():
        (tmp_path / name).touch()
        os.utime(tmp_path / name, (date, date))
    assert abs(latest_s(tmp_path, [flat]) - (soon + 1)) < 1e-3
    began = time.time()
    assert mend_dates(tmp_path, [flat]) == 2
    assert began - 1 < latest_s(tmp_path, [flat]) <= time.time()
    assert (tmp_path / "a/old").stat().st_mtime == old
    assert (flat / "tree/in").stat().st_mtime > began  # not looked at
    assert mend_dates(tmp_path, [flat]) == 0
    assert latest_s(tmp_path / "nowhere") == 0
