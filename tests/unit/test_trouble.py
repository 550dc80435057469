"""What the machine lacks is one line, also in the log of a job."""

import errno

import pytest

from ajgdata.pipeline.jobs import logged
from ajgdata.store.trouble import machine_trouble


@pytest.mark.parametrize(
    ("number", "said"),
    [
        (errno.ENOSPC, "a/b: no space left on device; check free space"),
        (errno.ENOMEM, "memory: there is not enough; close other programs"),
    ],
)
def test_the_system_says_no(number, said):
    assert str(machine_trouble(OSError(number, "whatever", "a/b"))).startswith(said)


def test_what_libraries_wrap_is_seen_and_bugs_are_not():
    with pytest.raises(ValueError, match="library") as caught:
        try:
            raise OSError(errno.ENOSPC, "no room")
        except OSError as error:
            raise ValueError("of a library") from error
    assert "no space left on device" in str(machine_trouble(caught.value))
    assert machine_trouble(ValueError("a bug")) is None
    assert machine_trouble(RuntimeError("a bug")) is None
    assert machine_trouble(FileNotFoundError(errno.ENOENT, "none", "x")) is None


def test_a_job_ends_with_the_line_and_keeps_the_traceback_in_its_log(tmp_path):
    log = tmp_path / "log"
    with pytest.raises(SystemExit) as ended, logged(str(log)):
        raise OSError(errno.ENOSPC, "No space left on device", "store.nc")
    assert ended.value.code.startswith("store.nc: no space left on device; ")
    assert "Traceback" in log.read_text()
