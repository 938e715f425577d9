#!/usr/bin/python3
"""Measures the socketcand server against stock python-can: no frame lost, every counter in step.

Starts stream_socketcand (frames at 1 kHz, each with the tick as its data) and one or more python-can
clients in processes of their own. The first client also sends commands, 100 a second. Fails if a
counter of any identifier has a gap or a command did not arrive.
"""

from __future__ import annotations

import argparse
import json
import logging
import multiprocessing
import subprocess
import sys
import time

import can

COMMAND_ID = 0x200  # heard by the other clients too, and counted on like the rest


def listen(port: int, seconds: float, commands: bool, results: multiprocessing.Queue) -> None:
    """One client: counts frames and gaps until the time is over."""
    logging.disable(logging.CRITICAL)  # python-can warns of each line that TCP splits
    bus = can.Bus(interface="socketcand", host="127.0.0.1", port=port, channel="vcan0")
    last: dict[int, int] = {}
    frames = gaps = strange = sent = 0
    began = time.monotonic()
    busy = time.process_time()
    while (now := time.monotonic()) < began + seconds:
        message = bus.recv(timeout=0.1)
        if message is not None:
            tick = int.from_bytes(message.data, "little")
            frames += 1
            strange += len(message.data) != 8 or not 0x100 <= message.arbitration_id <= COMMAND_ID
            gaps += tick != last.get(message.arbitration_id, tick - 1) + 1
            last[message.arbitration_id] = tick
        if commands and now > began + sent * 0.01:
            bus.send(can.Message(arbitration_id=COMMAND_ID, data=sent.to_bytes(8, "little"),
                                 is_extended_id=False))
            sent += 1
    busy = time.process_time() - busy
    bus.shutdown()
    results.put({"frames": frames, "gaps": gaps, "strange": strange, "commands": sent,
                 "identifiers": len(last), "cpu_percent": round(100 * busy / seconds, 1)})


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="the built stream_socketcand")
    parser.add_argument("--seconds", type=float, default=5.0, help="default: %(default)g")
    parser.add_argument("--frames", type=int, default=10, help="per ms; default: %(default)d")
    parser.add_argument("--clients", type=int, default=1, help="default: %(default)d")
    options = parser.parse_args()

    server = subprocess.Popen([options.program, str(int(options.seconds) + 30), str(options.frames)],
                              stdout=subprocess.PIPE, text=True)
    try:
        port = int(server.stdout.readline().split()[1])
        results: multiprocessing.Queue = multiprocessing.Queue()
        clients = [multiprocessing.Process(target=listen,
                                           args=(port, options.seconds, number == 0, results))
                   for number in range(options.clients)]
        for client in clients:
            client.start()
        heard = [results.get(timeout=options.seconds + 30) for _ in clients]
        for client in clients:
            client.join()
        time.sleep(0.1)
    finally:
        server.terminate()
        told = json.loads(server.communicate(timeout=10)[0])

    loop = told["loop"]
    sent = sum(one["commands"] for one in heard)
    for one in heard:
        print(f"client: {one}")
    print(f"server: client_lost {told['client_lost']}, send_dropped {told['send_dropped']}, "
          f"commands {told['received']} of {sent}")
    work, wake = loop["execution_us"], loop["wake_up_us"]
    print(f"loop:   execution avg {work['avg']:.1f} max {work['max']:.0f} us, "
          f"wake-up avg {wake['avg']:.1f} max {wake['max']:.0f} us, "
          f"overruns {loop['overruns']} ({loop['overruns'] - loop['system_overruns']} own)")
    enough = 0.95 * options.seconds * 1000 * options.frames
    good = all(one["gaps"] == one["strange"] == 0 and one["frames"] >= enough for one in heard)
    good = good and told["received"] == sent and told["refused"] == 0
    print("passed" if good else "FAILED")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
