"""The shipped connection of an RB-KAIROS, with fakes at the addresses of its devices."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from hw.connection.connection import FOLDER
from tests.repeats import long_form

pytest.importorskip("roslibpy", reason="the extra 'ros' is not installed")
pytest.importorskip("rtde_control", reason="there is no ur-rtde for this machine")

PEERS = {
    "world": {"driver": "hw.fakes.world_peer:WorldPeer", "port": 7500},
    "controller": {"driver": "hw.fakes.peers:Cb3", "tells": "world"},
    "kairos": {
        "driver": "hw.fakes.kairos.kairos_peer:Kairos",
        "tells": "world",
        "upside_down": True,
    },
    "application": {"driver": "hw.fakes.peers:VrClient", "port": 10000, "tells": "world"},
}


def faked(folder: Path) -> Path:
    """The shipped file with other addresses, and nobody but fakes beside it."""
    given = yaml.safe_load((FOLDER / "kairos_rosbridge.yaml").read_text())
    peers = {name: entry | {"host": "loopback"} for name, entry in PEERS.items()}
    links, parts = given["links"], given["parts"]
    del links["chain"]["observer"], links["unity"]["peer"]
    hosts = (links["chain"], links["chain"]["hardware"], links["unity"], parts["arm"])
    for entry in (*hosts, parts["lidar"]):
        entry["host"] = "loopback"
    file = folder / "kairos_fakes.yaml"
    given |= {"connection": "kairos_fakes", "real": False, "scene": "lab_a", "peers": peers}
    file.write_text(yaml.safe_dump(given, sort_keys=False))
    return file


@long_form
@pytest.mark.slow
def test_one_request_is_served_through_rosbridge(tmp_path):
    words = ["run", "cobodeck", "--robot", str(faked(tmp_path)), "--user", "cornering", "--json"]
    words += ["--requests", "1", "--duration", "120", "--record", str(tmp_path / "run.mcap")]
    told = subprocess.run(
        [sys.executable, "-m", "cobodeck", *words], capture_output=True, text=True, check=False
    )
    assert told.returncode == 0, told.stderr
    found = json.loads(told.stdout)
    assert (found["served"], found["errors"]) == (1, [])
    assert (found["contacts_by_robot"], found["wall_hits"]) == (0, 0)
    assert found["localization"]["rmse_m"] < 0.05  # by scans and odometry through rosbridge
