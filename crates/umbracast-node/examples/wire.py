"""A bad wire between two network namespaces: IP packets that are lost and late, where the kernel has no `netem`.

wire.py NAMESPACE_A ADDRESS_A NAMESPACE_B ADDRESS_B LOSS JITTER_MS: a device `bad0` in each namespace; of the packets
between them LOSS (0 to 1) are lost, and each is late by 0 to JITTER_MS, drawn evenly, so that packets overtake each other.
"""

import ctypes
import fcntl
import heapq
import os
import random
import select
import struct
import subprocess
import sys
import time

TUNSETIFF, IFF_TUN, IFF_NO_PI, CLONE_NEWNET = 0x400454CA, 0x0001, 0x1000, 0x40000000


def device(namespace, own, other):
    """Opens `bad0` in a namespace; it ends with this program."""
    with open(f"/run/netns/{namespace}") as place:
        if ctypes.CDLL(None, use_errno=True).setns(place.fileno(), CLONE_NEWNET) != 0:
            sys.exit(f"setns {namespace}: {os.strerror(ctypes.get_errno())}")
    tun = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(tun, TUNSETIFF, struct.pack("16sH22x", b"bad0", IFF_TUN | IFF_NO_PI))
    for words in (f"address add {own} peer {other} dev bad0", "link set bad0 up"):
        subprocess.run(["ip", *words.split()], check=True)
    return tun


def main():
    a, address_a, b, address_b, loss, jitter_ms = sys.argv[1:]
    loss, jitter_s = float(loss), float(jitter_ms) / 1e3
    chance = random.Random(1)
    ends = [device(a, address_a, address_b), device(b, address_b, address_a)]
    print("ready", flush=True)
    late, count = [], 0
    while True:
        wait_s = max(0.0, late[0][0] - time.monotonic()) if late else None
        for end in select.select(ends, [], [], wait_s)[0]:
            packet = os.read(end, 65536)
            if chance.random() >= loss:
                count += 1
                to = ends[1 - ends.index(end)]
                heapq.heappush(late, (time.monotonic() + chance.uniform(0, jitter_s), count, to, packet))
        while late and late[0][0] <= time.monotonic():
            _, _, to, packet = heapq.heappop(late)
            os.write(to, packet)


main()
