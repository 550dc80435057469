"""Ten public bug reports of other projects, tried on this one: what a user would meet here."""

import os
import warnings

import numpy as np
import pytest
import soundfile
import yaml
from sounds import RATE_HZ, resonances, write_wav

import ajgdata as library


def starter_kit(src, grasps=6):
    """Write `grasps` recordings of each of two objects, named as the starter kit does."""
    for number, label in enumerate(("cube", "ball")):
        for grasp in range(1, grasps + 1):
            write_wav(src / f"{grasp + grasps * number}_{label}.wav", resonances(number, grasp))


def edit(path, old, new, *, keep_time=False):
    """Replace a text in a file, once; the file may have its old time again."""
    before = path.stat()
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    if keep_time:
        os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))


def warnings_of(load, name):
    """Return what a loader warns of, as one text."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        load(name).close()
    return " ".join(str(warning.message) for warning in caught)


def test_a_changed_config_makes_features_outdated(ajgdata, src, paths, features):
    """https://github.com/ultralytics/ultralytics/pull/26207: a cache outlives data.yaml."""
    starter_kit(src)
    ajgdata("import", src, "--dataset", "mine")
    features("mine")
    assert warnings_of(library.load_features, "mine") == ""
    path = paths.dataset("mine")
    declared = yaml.safe_load(path.read_text(encoding="utf-8"))
    declared["targets"]["label"]["missing"] = ["cube"]
    path.write_text(yaml.safe_dump(declared), encoding="utf-8")
    assert "ajgdata run mine" in warnings_of(library.load_features, "mine")


def test_rows_removed_from_a_table_make_features_outdated(ajgdata, src, paths, features):
    """https://github.com/lstein/PhotoMapAI/pull/236: removed entries keep the newest time."""
    starter_kit(src)
    ajgdata("import", src, "--dataset", "mine")
    features("mine")
    table = paths.recordings_file("mine", "src")
    last = table.read_text(encoding="utf-8").splitlines(keepends=True)[-1]
    edit(table, last, "", keep_time=True)
    assert "ajgdata run mine" in warnings_of(library.load_features, "mine")


def test_a_version_with_other_content_is_refused(ajgdata, src, paths, features):
    """https://github.com/mozilla/addons-server/issues/1639: another file under one version."""
    starter_kit(src)
    ajgdata("import", src, "--dataset", "mine")
    features("mine")
    assert ajgdata("publish", "mine").code == 0
    first = (paths.published("mine") / "metadata.csv").read_bytes()
    edit(paths.recordings_file("mine", "src"), ",cube", ",ball")
    features("mine")
    refused = ajgdata("publish", "mine")
    assert refused.code != 0
    assert "version" in refused.text
    assert (paths.published("mine") / "metadata.csv").read_bytes() == first


def test_the_same_content_is_published_again_as_the_same_version(ajgdata, src, paths, features):
    """https://github.com/gbif/ipt/issues/1428: equal content needs no new version."""
    starter_kit(src)
    ajgdata("import", src, "--dataset", "mine")
    features("mine")
    assert ajgdata("publish", "mine").code == 0
    sums = (paths.published("mine") / "SHA256SUMS").read_bytes()
    features("mine")
    assert ajgdata("publish", "mine").code == 0
    assert (paths.published("mine") / "SHA256SUMS").read_bytes() == sums


@pytest.mark.parametrize("encoding", ["OGG", "FLAC"])
def test_an_encoded_copy_of_a_recording_is_reported(ajgdata, src, encoding):
    """https://github.com/hkchengrex/MMAudio/issues/50: one sound under two names, encoded again.

    OGG has its best quality: a strongly compressed copy differs as much as another recording.
    """
    starter_kit(src)
    path = src / f"20_ball.{encoding.lower()}"
    best = {"compression_level": 0.0}
    soundfile.write(path, resonances(1, 2), RATE_HZ, format=encoding, **best)
    ajgdata("import", src, "--dataset", "mine")
    checked = ajgdata("check", "mine")
    assert checked.code == 3
    assert "8_ball" in checked.text
    assert "20_ball" in checked.text


def test_names_that_differ_in_replaced_characters_stay_two_sessions(ajgdata, src, paths):
    """https://github.com/CultureBotAI/CultureMech/issues/218: `a b` and `a_b` in one file."""
    rows = ["name,label,day"]
    for number, day in enumerate(("run 1", "run_1", "run/1")):
        for grasp in range(3):
            name = f"r{number}{grasp}"
            write_wav(src / f"{name}.wav", resonances(grasp % 2, 10 * number + grasp))
            rows.append(f"{name},{('cube', 'ball')[grasp % 2]},{day}")
    (src / "labels.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    options = ("--table", "labels.csv", "--file", "{name}.wav", "--target", "label")
    ajgdata("import", src, "--dataset", "mine", *options, "--session", "{day}")
    assert len(list(paths.sessions("mine").iterdir())) == 3


def test_two_folders_of_one_name_do_not_become_one_session(ajgdata, src, paths):
    """https://github.com/NordSecurity/libdrop/pull/223: folders of one name, contents merged."""
    for day, seed in (("monday", 1), ("tuesday", 2)):
        for grasp in range(1, 5):
            sound = resonances(grasp % 2, grasp, seed)
            write_wav(src / day / "wav" / f"{grasp + 4 * seed}_{'ab'[grasp % 2]}x.wav", sound)
    assert ajgdata("import", src / "monday/wav", "--dataset", "mine").code == 0
    second = ajgdata("import", src / "tuesday/wav", "--dataset", "mine")
    assert second.code != 0
    assert "--session" in second.text
    assert "prune" not in second.text


def test_file_names_that_became_floats_are_joined_and_reported(ajgdata, src, rows):
    """https://github.com/adbailey1/daic_woz_process/issues/3: 300 becomes 300.0."""
    lines = ["participant,label"]
    for number in range(300, 306):
        write_wav(src / f"{number}.wav", resonances(number % 2, number))
        lines.append(f"{number}.0,{('cube', 'ball')[number % 2]}")
    (src / "labels.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    options = ("--table", "labels.csv", "--file", "{participant}.wav", "--target", "label")
    imported = ajgdata("import", src, "--dataset", "mine", *options)
    assert len(rows("mine")) == 6
    assert "300.0" in imported.text


def test_decomposed_names_are_joined_and_reported(ajgdata, src, rows):
    """https://github.com/quodlibet/quodlibet/issues/1760: NFC in a list, NFD on the disk."""
    lines = ["file,label"]
    for number in range(6):
        write_wav(src / f"u\u0308bung{number}.wav", resonances(number % 2, number))
        lines.append(f"\u00fcbung{number}.wav,{('cube', 'ball')[number % 2]}")
    (src / "labels.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    options = ("--table", "labels.csv", "--file", "{file}", "--target", "label")
    imported = ajgdata("import", src, "--dataset", "mine", *options)
    assert len(rows("mine")) == 6
    assert "Unicode" in imported.text


def test_a_stereo_file_with_a_silent_channel_is_not_averaged(ajgdata, src, paths):
    """https://github.com/noisetorch/NoiseTorch/issues/86: stereo devices with one valid channel."""
    for number, label in enumerate(("cube", "ball")):
        for grasp in range(1, 4):
            sound = resonances(number, grasp)
            stereo = np.column_stack([sound, np.zeros_like(sound)])
            write_wav(src / f"{grasp + 3 * number}_{label}.wav", stereo)
    stopped = ajgdata("import", src, "--dataset", "mine")
    assert stopped.code != 0
    assert "--microphone" in stopped.text
    assert not paths.dataset("mine").exists()
    assert ajgdata("import", src, "--dataset", "mine", "--microphone", "1").code == 0
