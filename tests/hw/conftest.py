"""What tests of processes share."""

import pytest

from hw.links.priority import DEVICES, hurrying


@pytest.fixture(autouse=True)
def _as_a_device(request):
    """A test in real time plays a device or a peer: it waits no more than the process it tests."""
    if request.node.get_closest_marker("realtime") is None:
        yield
        return
    with hurrying(DEVICES):
        yield
