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


def dated(folder, **dates):
    for name, date in dates.items():
        (folder / name).touch()
        os.utime(folder / name, (date, date))
    return lambda name: (folder / name).stat().st_mtime


def test_what_was_newer_stays_newer(tmp_path):
    """A store that was made again after its metrics, a year ahead: they are still out of date."""
    now = time.time()
    year = now + 365 * 86_400
    date = dated(tmp_path, new=year + 9, old=year, older=year - 9, same=year, present=now - 0.1)
    assert mend_dates(tmp_path) == 4
    assert now - 0.1 < date("older") < date("old") < date("new") <= time.time()
    assert date("same") == date("old")
    assert abs(date("present") - (now - 0.1)) < 1e-6


def test_many_dates_lie_after_the_last_of_the_others(tmp_path):
    now = time.time()
    future = {f"f{n}": now + 1000 + n / 100 for n in range(300)}
    date = dated(tmp_path, present=now - 0.2, **future)
    assert mend_dates(tmp_path) == 300
    found = [date(name) for name in future]
    assert all(a < b for a, b in zip([date("present"), *found], found, strict=False))
    assert found[-1] <= time.time()


def test_the_order_stays_where_there_is_no_room(tmp_path):
    now = time.time()
    date = dated(tmp_path, present=now, one=now + 5, two=now + 6)
    assert mend_dates(tmp_path) == 2
    assert date("one") < date("two") <= time.time()


def test_what_a_link_leads_to_keeps_its_date(tmp_path):
    elsewhere, results = tmp_path / "elsewhere", tmp_path / "results"
    elsewhere.mkdir()
    results.mkdir()
    soon = time.time() + 1000
    date = dated(elsewhere, file=soon)
    os.utime(elsewhere, (soon, soon))
    (results / "folder").symlink_to(elsewhere)
    (results / "file").symlink_to(elsewhere / "file")
    (results / "lost").symlink_to(elsewhere / "none")
    os.utime(results / "lost", (soon, soon), follow_symlinks=False)
    assert mend_dates(results) == 1  # the link that bears one itself
    assert (results / "lost").lstat().st_mtime <= time.time()
    assert abs(date("file") - soon) < 1e-3
    assert abs(elsewhere.stat().st_mtime - soon) < 1e-3
