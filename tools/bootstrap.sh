#!/bin/sh
# Make a virtual environment and install this project with the versions of a file of constraints.
# usage: tools/bootstrap.sh PYTHON VENV GROUP [CONSTRAINTS]
# GROUP is one of the dependency groups of pyproject.toml; CONSTRAINTS is requirements.lock by default.
set -eu
python=$1 venv=$2 group=$3 constraints=${4-requirements.lock}

"$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || {
  echo "ajgdata needs Python 3.11 or newer; $python is $("$python" --version 2>&1)." >&2
  echo "Name another one: make PYTHON=python3.12 ..." >&2
  exit 1
}

# Debian and Ubuntu ship Python without ensurepip; it comes with python3-venv.
if ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
  package=$("$python" -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])')
  [ "$(id -u)" = 0 ] && sudo="" || sudo="sudo -n"
  echo "Installing $package ..." >&2
  { $sudo apt-get update -q && $sudo apt-get install -q -y "$package"; } >/dev/null || {
    echo "Could not install $package. Run: sudo apt-get install $package" >&2
    exit 1
  }
fi

# A set-up that was interrupted may have left an environment without pip.
"$venv/bin/python" -m pip --version >/dev/null 2>&1 || "$python" -m venv --clear "$venv"
pip="$venv/bin/python -m pip install --quiet --disable-pip-version-check --constraint $constraints"
$pip pip setuptools # the pip of a new environment may be too old for groups

# On Linux the default index has torch with CUDA packages (several GB); this index has its CPU build.
# TORCH_INDEX names another index, for example of a CUDA version; if it is empty, pip's default is used.
index=${TORCH_INDEX-https://download.pytorch.org/whl/cpu}
pinned=$(grep '^torch==' "$constraints")
# pip would try an unreachable index for minutes, so this limits the attempt to ten seconds.
probe='import signal, sys, urllib.request
signal.alarm(10)
urllib.request.urlopen(sys.argv[1] + "/torch/")'
if [ -n "$index" ] && [ "$(uname -s)" = Linux ] &&
  ! "$venv/bin/python" -m pip list --format freeze 2>/dev/null | grep -q "^$pinned"; then
  { "$venv/bin/python" -c "$probe" "$index" && $pip --no-deps --index-url "$index" torch; } 2>/dev/null || {
    echo "No torch from $index (unreachable, or no build for this machine)." >&2
    echo "pip's default index is used, which may add CUDA packages (several GB)." >&2
  }
fi
$pip --no-build-isolation --editable ".[all]" --editable ./workflow/logger --group "$group"
