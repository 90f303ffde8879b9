"""A stream whose rows come with set-points alone is not called slow while nothing is commanded."""

from dataclasses import replace

import pytest

from drivers.protocols import Channel, Sample, Stream
from rig.campaign.limits import GuardedChannel
from rig.control.paces import Paces
from rig.control.readings import Readings
from rig.safety.guard import Vitals


class Bench:
    """As much of a bench as the paces want."""

    def __init__(self, stream):
        self.stream = stream

    def streams(self):
        yield "motor", self.stream


STREAM = Stream("motor", "virtual", (Channel("current", "current", "A"),), 0.02)


@pytest.mark.parametrize(("with_commands", "cause"), [(True, None), (False, "motor came at")])
def test_rows_that_come_with_commands(with_commands, cause):
    stream = replace(STREAM, with_commands=with_commands)
    readings = Readings({"motor": stream}, ())
    paces = Paces(Bench(stream), readings, [GuardedChannel("motor.current", "A", 2.0)], 0.0)
    trips = []
    for tick in range(200):
        now, commanded = tick * 0.02, not 60 <= tick < 130
        samples = [Sample("motor", round(now * 1e9), (1.0 + 0.01 * tick,))] if commanded else []
        readings.update(samples)
        trips.append(paces.advance(Vitals(now, 0.0), samples, commanded=commanded))
    found = next((trip.cause for trip in trips if trip), None)
    assert found is None if cause is None else cause in found
