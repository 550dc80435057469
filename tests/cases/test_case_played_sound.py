"""Sessions with different played sounds are a warning of check."""

import numpy as np
import pytest
import yaml
from sounds import RATE_HZ, resonances, write_wav

from ajgdata.acquire.excitation import excitation_samples
from ajgdata.store.sessions import read_declaration, read_session, write_dataset
from ajgdata.types import DEFAULT_EXCITATION, DatasetSpec, LogSweep, MaximumLengthSequence

SWEEP = LogSweep(length_s=0.25)
OTHER = MaximumLengthSequence(length_s=0.25)
QUIETER = LogSweep(length_s=0.25, amplitude=0.45)


def write_kit(folder, played=None, **options) -> None:
    """Write four recordings of the starter kit, and the played sound."""
    for number in range(4):
        sound = resonances(number % 2, number, seed=len(folder.name))
        write_wav(folder / f"{number + 1}_{('cube', 'ball')[number % 2]}.wav", sound)
    if played is not None:
        write_wav(folder / "0_sweep.wav", excitation_samples(played, RATE_HZ), **options)


def played_warnings(printed) -> int:
    return sum(line.startswith("warning played_sound") for line in printed.out.splitlines())


@pytest.mark.parametrize(("second", "warnings"), [(SWEEP, 0), (OTHER, 1), (QUIETER, 1), (None, 0)])
def test_sessions_of_the_starter_kit_are_compared(ajgdata, src, paths, second, warnings):
    write_kit(src / "monday", SWEEP)
    write_kit(src / "tuesday", second)
    assert ajgdata("import", src, "--dataset", "mine").code == 0
    stored = read_session(paths.session("mine", "monday")).excitation
    content = (paths.session("mine", "monday") / stored.file).read_bytes()
    assert content == (src / "monday" / "0_sweep.wav").read_bytes()
    checked = ajgdata("check", "mine")
    assert played_warnings(checked) == warnings
    assert checked.code == (3 if warnings else 0)
    if warnings:
        assert "tuesday/*: the played sound (imported from 0_sweep.wav, sha256 " in checked.text
        assert "differs from that of session monday" in checked.text
    assert (
        ajgdata("import", src, "--dataset", "mine").code == 0
    )  # the second import changes nothing
    assert read_session(paths.session("mine", "monday")).excitation == stored


def test_another_format_of_the_same_sound_is_the_same_sound(ajgdata, src, paths):
    import soundfile

    write_kit(src / "monday", SWEEP)
    write_kit(src / "tuesday")
    samples = excitation_samples(SWEEP, RATE_HZ)
    soundfile.write(src / "tuesday" / "0_chirp.wav", samples, RATE_HZ, subtype="FLOAT")
    assert ajgdata("import", src, "--dataset", "mine").code == 0
    first, second = (
        read_session(paths.session("mine", n)).excitation for n in ("monday", "tuesday")
    )
    assert first.sha256 != second.sha256
    assert ajgdata("check", "mine").code == 0


def test_a_declared_sound_is_compared_with_the_imported_sound(ajgdata, src, paths):
    write_kit(src, SWEEP)
    assert ajgdata("import", src, "--dataset", "mine").code == 0
    imported = yaml.safe_load(paths.dataset("mine").read_text())
    for declared, warnings in ((SWEEP, 0), (QUIETER, 1), (LogSweep(high_hz=22_050 - 1), 1)):
        content = {**imported, "excitation": declared.model_dump(mode="json")}
        paths.dataset("mine").write_text(yaml.safe_dump(content))
        checked = ajgdata("check", "mine")
        assert played_warnings(checked) == warnings
        assert ("is not `excitation` of dataset.yaml" in checked.text) == bool(warnings)


@pytest.mark.parametrize("excitation", [SWEEP, QUIETER, OTHER, MaximumLengthSequence()])
def test_a_written_data_set_config_with_its_own_sound_can_be_read(paths, excitation):
    """As `publish` and `import` write it, without the defaults: but a sound needs its kind."""
    spec = DatasetSpec(name="mine", excitation=excitation)
    assert read_declaration(write_dataset(paths, spec)) == spec


def test_stored_settings_are_compared_with_the_declared_settings(ajgdata, src, paths):
    """As sessions of a sound card and of the virtual gripper store them."""
    write_kit(src, DEFAULT_EXCITATION)
    assert ajgdata("import", src, "--dataset", "mine").code == 0
    file = paths.session_file("mine", "src")
    content = yaml.safe_load(file.read_text())
    content["excitation"]["settings"] = DEFAULT_EXCITATION.model_dump(mode="json")
    file.write_text(yaml.safe_dump(content))
    assert ajgdata("check", "mine").code == 0
    content["excitation"]["settings"]["amplitude"] = 0.5
    file.write_text(yaml.safe_dump(content))
    checked = ajgdata("check", "mine")
    assert checked.code == 3
    assert "(amplitude 0.5, declared 0.9)" in checked.text


def test_a_played_sound_that_was_replaced_is_a_warning(ajgdata, src, paths):
    write_kit(src, SWEEP)
    assert ajgdata("import", src, "--dataset", "mine").code == 0
    stored = paths.session("mine", "src") / "excitation.wav"
    write_wav(stored, 0.5 * excitation_samples(SWEEP, RATE_HZ))
    checked = ajgdata("check", "mine")
    assert checked.code == 3
    assert "src/*: is not the played sound that session.yaml names" in checked.text
    stored.unlink()
    assert "played_sound src/*: no such file" in ajgdata("check", "mine").text


def test_a_changed_sound_in_the_folder_is_kept_out_until_it_is_requested(ajgdata, src, paths):
    write_kit(src, SWEEP)
    again = ("import", src, "--dataset", "mine")
    assert ajgdata(*again).code == 0
    write_kit(src, OTHER)
    kept = ajgdata(*again)
    assert kept.code == 3
    assert "kept 0_sweep.wav: the played sound is not the stored sound" in kept.text
    before = read_session(paths.session("mine", "src")).excitation
    assert ajgdata(*again, "--on-change", "files").code == 0
    after = read_session(paths.session("mine", "src")).excitation
    assert after.sha256 != before.sha256
    assert ajgdata("check", "mine").code == 0


def test_several_played_sounds_in_one_folder_are_not_guessed(ajgdata, src, paths):
    write_kit(src, SWEEP)
    write_wav(src / "0_other.wav", np.asarray(excitation_samples(OTHER, RATE_HZ)))
    done = ajgdata("import", src, "--dataset", "mine")
    assert done.code == 3
    assert "kept 0_other.wav, 0_sweep.wav: are several played sounds of one session" in done.text
    assert read_session(paths.session("mine", "src")).excitation is None


def test_with_reference_the_played_sound_is_copied(ajgdata, src, paths):
    write_kit(src, SWEEP)
    assert ajgdata("import", src, "--dataset", "mine", "--reference").code == 0
    assert (paths.session("mine", "src") / "excitation.wav").is_file()
    assert ajgdata("check", "mine").code == 0
