"""numat's client for Sartorius scales, against the simulated balance."""

import asyncio

import pytest

from sim_devices.instruments.serial_lines.sartorius import Sartorius, SartoriusOptions
from tests.drivers.scripted_peer import Peer

pytestmark = pytest.mark.interop


def test_the_client_of_numat_reads_our_balance(third_party):
    """Over a real pty: a reading at rest, who it is, a reading that moves, and a display that is off."""
    sartorius = third_party("sartorius")
    force = [1.5]
    device = Sartorius(SartoriusOptions("sartorius_sbi", "p", unit="kg", decimals=4), lambda: force[0])

    async def asked(port):
        client = sartorius.Scale(port, baudrate=9600, parity="N", timeout=2.0)
        still, info = await client.get(), await client.get_info()
        force[0] = 3.0
        device.tick(0.06)
        moved = await client.get()
        device.fault("display_off", 0.0)
        off = await client.get()
        client.hw.close()
        return still, info, moved, off

    with Peer(lambda peer, data: peer.send(device.feed(data, 0.0)), terminator=None) as peer:
        still, info, moved, off = asyncio.run(asked(peer.port))
    assert still == {"mass": 0.153, "units": "kg", "stable": True, "measurement": "net"}
    assert info == {"model": "LA34001S", "serial": "37454321", "software": "00-37-09"}
    assert moved == {"mass": 0.3059, "units": "kg", "stable": False, "measurement": "net"}
    assert off == {"on": False}
