# shellcheck shell=bash
# Common start of every script on the bed; it runs in the job's own directory. `./script` is the test's part.
set -euo pipefail

# `mark NAME` notes an event with the clock that candump's time stamps use. Without a fork: a fork takes 10 to
# 1000 ms in the guest, more than the events that it shall tell apart.
mark() { printf '%s %s\n' "$EPOCHREALTIME" "$1" >>marks; }

# `wait_for SECONDS COMMAND...` repeats a command until it succeeds; fails loudly when the time is over. It pauses
# without a fork, and for longer than a fork takes: what it waits for needs the guest's only CPU.
exec {silence}<> <(:)
wait_for() {
  local deadline=$((SECONDS + $1))
  shift
  until "$@" >/dev/null 2>&1; do
    [ "$SECONDS" -le "$deadline" ] || { echo "timed out waiting for: $*" >&2; return 1; }
    read -r -t 0.5 -u "$silence" || true
  done
}

# `apart NUMBER COMMAND...` is of another machine than the controller: it never waits for it, nor for a lower number.
apart() { exec chrt --fifo "$((50 + $1))" "${@:2}"; }

# `record` writes the bus to bus.log, with room for many frames, since one that is missing there would look as if it had
# not been sent. One that is lost nevertheless leaves a line that no reader takes.
record() {
  apart 2 candump -D -d -L -r 67108864 vcan0 >>bus.log 2>>candump.err & recorder=$!
  [ -e pulse ] || (apart 3 bash -c "$pulse" pulse "$$" 2>/dev/null &)
}

# Looks at the clock twenty times a second and notes in `pulse` from when to when it could not: then all stood still.
# shellcheck disable=SC2016  # expanded where it runs
pulse='exec {silence}<> <(:)
: >pulse
last=${EPOCHREALTIME/./}
while kill -0 "$1"; do
  read -r -t 0.05 -u "$silence"
  now=${EPOCHREALTIME/./}
  [ $((now - last)) -lt 200000 ] || printf "%s %s\n" "$last" "$now" >>pulse
  last=$now
done'

# `end PID...` asks each to end until it has: candump forgets a signal that comes before it waits for a frame.
end() {
  local pid
  for pid; do
    while kill "$pid" 2>/dev/null; do read -r -t 0.2 -u "$silence" || true; done
  done
}

# `controls_after LINE`: whether the last state in bus.log after that line fits the script's pattern ALL_ACTIVE.
controls_after() {
  awk -v from="$1" -v all="$ALL_ACTIVE" 'NR > from && / 200#/ {last = $0} END {exit last !~ all}' bus.log
}

if [ "$1" = bus ]; then
  # A network and process space of its own: a vcan0 that nobody else writes to, nothing left running.
  ip link add vcan0 type vcan
  ip link set vcan0 up
  # What hangs is named before the time is over: what ends it then ends all of its group.
  ( (sleep "$2"; echo "the time is nearly over; still running:"; ps -eo pid,ppid,stat,wchan:24,args) >&2 &)
fi
. ./script
