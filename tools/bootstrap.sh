#!/bin/sh
# Make a virtual environment and install this project with the versions of requirements.lock.
# usage: tools/bootstrap.sh PYTHON VENV EXTRA
set -eu
python=$1 venv=$2 extra=$3

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
pip="$venv/bin/python -m pip install --quiet --disable-pip-version-check --constraint requirements.lock"
$pip setuptools
$pip --no-build-isolation --editable ".[$extra]"
