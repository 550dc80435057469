"""A SLURM for tests is started where there is none, also after one that was killed."""

import os
import shutil

import pytest

from tools import loopback_slurm


@pytest.mark.parametrize("left", ["nothing", "dangling", "file"])
def test_a_link_that_leads_nowhere_is_no_slurm_of_this_machine(tmp_path, monkeypatch, left):
    configuration = tmp_path / "slurm.conf"
    if left == "dangling":
        configuration.symlink_to(tmp_path / "gone" / "slurm.conf")
    elif left == "file":
        configuration.write_text("")
    monkeypatch.setattr(loopback_slurm, "CONFIGURATION", configuration)
    monkeypatch.setattr(shutil, "which", lambda name: f"/usr/sbin/{name}")
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    assert ("has a SLURM of its own" in loopback_slurm.missing()) == (left == "file")


def test_a_link_is_made_over_one_that_leads_nowhere_and_the_folder_goes_with_it(
    tmp_path, monkeypatch
):
    configuration = tmp_path / "etc" / "slurm.conf"
    monkeypatch.setattr(loopback_slurm, "CONFIGURATION", configuration)
    monkeypatch.setattr(loopback_slurm.Slurm, "start", failed)
    monkeypatch.setattr(loopback_slurm.subprocess, "run", lambda *_, **__: None)
    monkeypatch.setattr(loopback_slurm.Slurm, "active", lambda self: [])
    for run, was_there in enumerate((False, True)):
        if was_there:
            configuration.parent.mkdir()
            configuration.symlink_to(tmp_path / "gone")
        with (
            pytest.raises(OSError, match="no munge"),
            loopback_slurm.loopback_slurm(tmp_path / str(run)),
        ):
            pass
        assert configuration.parent.exists() == was_there
        assert not configuration.is_symlink()


def failed(self, name):
    raise OSError("no munge")
