"""What tests of processes share."""

import pytest

from hw.ipc.priority import ENGINE, hurrying


@pytest.fixture(autouse=True)
def _as_an_engine(request):
    """A test in real time goes before other programs, but never before the processes it tests.

    Other tests beside it compute for a tenth of a second now and then: no fake may wait for them.
    """
    if request.node.get_closest_marker("realtime") is None:
        yield
        return
    with hurrying(ENGINE):
        yield


def tick(n: int) -> int:
    """The instant of a tick at 30 Hz, ns."""
    return n * 10**9 // 30
