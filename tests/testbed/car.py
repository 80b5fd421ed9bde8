"""Sends frames.txt on vcan0 again and again, whatever becomes of the bus: a car that starts at once.

Python alone: in the guest, one that imports mrctl takes seconds to start. Each line: milliseconds since the
beginning, CAN ID, payload. The last line says when it begins again.
"""

import socket
import struct
import time

lines = [line.split() for line in open("frames.txt", encoding="ascii")]  # noqa: PTH123, SIM115  # pathlib starts late
frames = [
    (int(ms), struct.pack("=IB3x8s", int(can_id, 16), 8, bytes.fromhex(data)))
    for ms, can_id, data in lines[:-1]
]
round_s = int(lines[-1][0]) / 1000.0


def opened() -> socket.socket:
    while True:
        bus = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        bus.setblocking(False)
        try:
            bus.bind(("vcan0",))
        except OSError:
            bus.close()
            time.sleep(0.1)
        else:
            return bus


bus = opened()
begin_s = time.monotonic()
while True:
    for ms, frame in frames:
        wait_s = begin_s + ms / 1000.0 - time.monotonic()
        if wait_s > 0.0:
            time.sleep(wait_s)
        elif wait_s < -0.5:  # it was stopped: what is late is not made up for
            begin_s -= wait_s
        try:
            bus.send(frame)
        except (BlockingIOError, InterruptedError):
            continue
        except OSError as error:
            if error.errno in {6, 19}:  # ENXIO, ENODEV: the interface was removed
                bus.close()
                bus = opened()
    begin_s += round_s
