"""Make Python on Linux similar to Python on Windows, in processes with this folder in PYTHONPATH.

Functions that Windows does not have are deleted. Links, names of devices, names with reserved
characters, and replacing or removing an open file are errors.
"""

import errno
import os
import re
import signal
import sys
from pathlib import Path

MISSING = {signal: ("SIGHUP", "pthread_kill"), os: ("fork", "killpg")}
BAD_NAME = re.compile(r'.*[<>:"\\|?*\x00-\x1f].*|.*[. ]|(?i:con|prn|aux|nul|com\d|lpt\d)(\..*)?')
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT
OWN_FILES = "/proc/self/fd"

list_folder = os.listdir
read_link = os.readlink


def open_files() -> list[str]:
    """Return the paths of the files that this process has open."""
    paths = []
    for number in list_folder(OWN_FILES):
        try:
            paths.append(read_link(f"{OWN_FILES}/{number}"))
        except FileNotFoundError:  # the listing itself
            continue
    return paths


def check_name(path: object) -> None:
    """Raise OSError for a name that Windows does not allow."""
    name = Path(os.fsdecode(path)).name
    if BAD_NAME.fullmatch(name):
        raise OSError(errno.EINVAL, "invalid name", path)


def check_closed(path: object) -> None:
    """Raise PermissionError if the file, or a file of the folder, is open in this process."""
    absolute = str(Path(os.fsdecode(path)).absolute())
    if any(file == absolute or file.startswith(f"{absolute}/") for file in open_files()):
        raise PermissionError(errno.EACCES, "in use", path)


def refuse(event: str, arguments: tuple) -> None:
    """Raise the error of Windows for an action that Python announces."""
    if event == "open":
        path, _, flags = arguments
        if isinstance(path, int) or os.fsdecode(path).startswith(("/dev/", "/proc/")):
            return
        if flags & WRITING:
            check_name(path)
        if os.fsdecode(path).endswith(".lock"):  # the holder of a lock excludes other handles
            check_closed(path)
    elif event == "os.mkdir":
        check_name(arguments[0])
    elif event == "os.rename":
        source, target = arguments[:2]
        check_name(target)
        check_closed(source)
        check_closed(target)
    elif event == "os.remove":
        check_closed(arguments[0])
    elif event == "os.symlink":
        raise OSError(errno.EPERM, "a required privilege is not held", arguments[1])


for module, names in MISSING.items():
    for name in names:
        delattr(module, name)
sys.addaudithook(refuse)
