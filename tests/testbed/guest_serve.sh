#!/bin/bash
# Command loop of the guest: reads `TIMEOUT_S JOB-DIRECTORY` lines from the host and runs JOB-DIRECTORY/run.
# When the host goes away the line hangs up, this ends, and systemd powers the guest off (see bed.service).
set -u
exec </dev/ttyS0 9>/dev/ttyS0
stty raw -echo
ip link add vcan0 type vcan && ip link set vcan0 up
echo ready >&9
while read -r timeout_s job; do
  bash "$job/run" "$timeout_s" </dev/null >"$job/stdout" 2>"$job/stderr"
  # The answer follows the data: closing a file on hostfs writes it out.
  echo "done $? ${job##*/}" >&9
done
