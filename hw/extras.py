"""Packages that come with an extra of cobodeck, and what to install where one is missing.

Modules import them where they are needed; whoever reports a failed import asks `missing`.
"""

from __future__ import annotations

from collections.abc import Mapping

EXTRAS: Mapping[str, str] = {
    "foxglove": "record",
    "mcap": "record",
    "lz4": "record",
    "zstandard": "record",
    "rosbags": "record",
    "canopen": "robot",
    "cantools": "robot",
    "msgpack": "robot",
    "serial": "robot",
    "roslibpy": "ros",
    "twisted": "ros",
    "websockets": "live",
    "matplotlib": "plots",
    "ompl": "ompl",
    "xacro": "urdf",
    "mujoco": "reference",
    "irsim": "sim-peers",
    "dask": "cluster",
    "distributed": "cluster",
}
"""By module: the smallest extra that brings it."""
PACKAGES: Mapping[str, str] = {
    "can": "python-can",
    "foxglove": "foxglove-sdk",
    "irsim": "ir-sim",
    "serial": "pyserial",
    "rtde_control": "ur-rtde (wheels: Linux on x86-64, Python below 3.13)",
    "rtde_receive": "ur-rtde (wheels: Linux on x86-64, Python below 3.13)",
}
"""Packages that have another name than their module."""


def needs(*modules: str) -> str:
    """`needs the package …`, and the line that installs it if an extra brings it."""
    names = dict.fromkeys(PACKAGES.get(module, module) for module in modules)
    extras = dict.fromkeys(EXTRAS[module] for module in modules if module in EXTRAS)
    told = f"needs the package{'s' * (len(names) > 1)} {', '.join(names)}"
    return f"{told}: pip install 'cobodeck[{','.join(extras)}]'" if extras else told


def missing(error: BaseException) -> str | None:
    """What an import that has failed needs; None if it is of no extra's package."""
    name = error.name if isinstance(error, ModuleNotFoundError) else None
    module = (name or "").partition(".")[0]
    return needs(module) if module in EXTRAS else None
