#!/usr/bin/env bash
# Installs all that the tests need and runs every check; what CI runs is this script and nothing else.
# `tests/run.sh --all` runs the long searches too (`pytest -m long`).
# For a single test: `pytest tests/model -k saturates` in the same environment.
#
# Python packages go into $VIRTUAL_ENV if one is active, else into .venv-test. Debian packages are installed when
# this is root; otherwise it says which ones are missing. PYTHON=python3.12 chooses the interpreter of .venv-test.
set -euo pipefail
cd "$(dirname "$0")/.."
export PATH="$PATH:/usr/sbin:/sbin"

case "${1:-}" in
  "") only=(-m "not long") ;;
  --all) only=() ;;
  *) echo "error: unknown argument '$1'; without one, or --all" >&2; exit 2 ;;
esac

say() { printf '\n== %s\n' "$*"; }

# What the machine must have: a user-mode kernel with CAN, systemd, and a browser that opens the reports.
missing=()
need() { command -v "$1" >/dev/null || missing+=("$2"); }
need linux.uml user-mode-linux
need candump can-utils
need ip iproute2
need insmod kmod
need chrt util-linux
need ps procps
need chromium chromium
if grep -q ' amx_tile' /proc/cpuinfo; then  # whose registers the user-mode kernel does not know by itself
  need cc gcc
  [ -e /usr/include/dlfcn.h ] || missing+=(libc6-dev)
fi
[ -x /lib/systemd/systemd ] || missing+=(systemd)
if [ -z "${VIRTUAL_ENV:-}" ]; then
  need "${PYTHON:=python3}" python3
  "$PYTHON" -c 'import ensurepip, venv' 2>/dev/null || missing+=(python3-venv)
fi
if [ "${#missing[@]}" -gt 0 ]; then
  if [ "$(id -u)" -ne 0 ] || ! command -v apt-get >/dev/null; then
    echo "error: these Debian packages are missing: ${missing[*]}; apt-get install them as root, then try again" >&2
    exit 2
  fi
  say "installing ${missing[*]}"
  export DEBIAN_FRONTEND=noninteractive
  apt-get update -qq
  apt-get install -y -qq --no-install-recommends -o DPkg::Lock::Timeout=300 "${missing[@]}" >/dev/null
fi

if [ -z "${VIRTUAL_ENV:-}" ]; then
  export VIRTUAL_ENV="$PWD/.venv-test"
  [ -x "$VIRTUAL_ENV/bin/python" ] || "$PYTHON" -m venv "$VIRTUAL_ENV"
fi
export PATH="$VIRTUAL_ENV/bin:$PATH"
python -c 'import sys; sys.exit(sys.version_info < (3, 11) and "error: Python 3.11 or newer is needed")'
say "installing mrctl[dev] into $VIRTUAL_ENV"
python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'

logs=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$logs"' EXIT
export OPENBLAS_NUM_THREADS=1  # threads inside small linear algebra only wait for each other
failed=()
check() {
  say "$*"
  "$@" || failed+=("$*")
}
# What searches compile is compiled once and kept: by the battery's small part, beside what only reads the files.
first=(python -m pytest --color=no "${only[@]}" tests/hidden/test_battery.py)
MRCTL_WORKERS=1 "${first[@]}" >"$logs/first" 2>&1 &
battery=$!
check ruff check .
check ruff format --check .
check mypy
check lint-imports
say "${first[*]}"
wait "$battery" || failed+=("${first[*]}")
cat "$logs/first"

# Exit status 5 of pytest (no test at all) is a failure like any other. The test bed mostly waits for real events:
# it runs beside the others, which stand back for it, and its output follows theirs.
python -m pytest --color=no --durations=10 tests/testbed >"$logs/testbed" 2>&1 &
bed=$!
# Each process has a processor to itself: threads within them would only share it. Each begins with a part of its own,
# so that what a folder sets up is mostly set up once, and takes from the others what they have not come to.
bulk=(nice -n 19 python -m pytest -n auto --maxprocesses=8 --dist worksteal --durations=60 \
  "${only[@]}" --ignore=tests/testbed --ignore=tests/hidden/test_battery.py tests)
say "${bulk[*]}"
MRCTL_WORKERS=1 "${bulk[@]}" --color=no 2>&1 | tee "$logs/bulk" || failed+=("${bulk[*]:3}")
say "pytest tests/testbed"
wait "$bed" || failed+=("pytest tests/testbed")
cat "$logs/testbed"

say "summary"
tail -qn 1 "$logs/first" "$logs/bulk" "$logs/testbed"
[ "${#only[@]}" -eq 0 ] || echo "not run: the long searches (tests/run.sh --all, or pytest -m long)"
for what in "${failed[@]}"; do echo "FAILED: $what"; done
count() { cat "$logs/first" "$logs/bulk" "$logs/testbed" | grep -E '^(=|[0-9]+ ).* in [0-9.]+s' | grep -oE "[0-9]+ ($1)" | awk '{n += $1} END {print n + 0}'; }
echo "$(count passed) passed, $(count 'failed|error|errors') failed"
[ "${#failed[@]}" -eq 0 ]
