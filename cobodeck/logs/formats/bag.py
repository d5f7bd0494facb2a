"""ROS bags: the messages of ROS 1 bags and of ROS 2 bags, folders or single files.

What they mean, frame by frame, is in `bag_frames`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from cobodeck.logs.formats.bag_frames import BagFrames
from cobodeck.logs.formats.bag_messages import BagMessages
from cobodeck.logs.formats.drive_log import Gathered, SensorLog
from cobodeck.logs.formats.log_content import head, plain_file
from cobodeck.logs.formats.run_record import MAGIC as MCAP
from engine.files import mistake

_ENDINGS: Mapping[bytes, str] = {
    b"#ROSBAG V": ".bag",
    b"SQLite format 3\0": ".db3",
    MCAP: ".mcap",
}
"""Ending that the library needs, by the first bytes of a file."""
_FOLDER = "metadata.yaml"


def is_bag(path: Path) -> bool:
    """True for a ROS 1 bag, a file of a ROS 2 bag, each compressed or not, or the latter's folder.

    Every MCAP file counts; our own records are told apart before.
    """
    if path.is_dir():
        return bool(_parts(path))
    return _ending(path) is not None


def read_bag(path: Path) -> SensorLog:
    """Read a bag.

    Raises:
        FileError: it cannot be read, or holds nothing usable.
    """
    gathered = Gathered(path, "ROS bag")
    messages = BagMessages(gathered.remark)
    for part in _parts(path) if path.is_dir() else [path]:
        _read(part, messages, gathered)
    BagFrames(messages, gathered).put_all()
    return gathered.finished()


def _parts(folder: Path) -> list[Path]:
    """The folder itself if it has its table of contents, else the files of a bag in it, by name."""
    if (folder / _FOLDER).is_file():
        return [folder]
    return sorted(part for part in folder.iterdir() if part.is_file() and _ending(part))


def _ending(path: Path) -> str | None:
    begins = head(path, max(map(len, _ENDINGS)))
    return next((end for first, end in _ENDINGS.items() if begins.startswith(first)), None)


def _read(path: Path, messages: BagMessages, gathered: Gathered) -> None:
    """Take the messages of a folder or file."""
    with _plain(path) as (plain, broken):
        if broken is not None:
            gathered.remark(broken)
        try:
            _read_messages(plain, messages)
        except ImportError:
            raise
        except Exception as error:  # noqa: BLE001  the library may raise anything on a damaged file
            if messages.are_none:
                hint = "`rosbag reindex`, `ros2 bag reindex` and `mcap recover` repair bags"
                raise mistake(path, f"cannot be read as a bag: {error}", hint=hint) from None
            gathered.remark(f"it is cut off: {error}")


@contextmanager
def _plain(path: Path) -> Iterator[tuple[Path, str | None]]:
    if path.is_dir():
        yield path, None
        return
    with plain_file(path, _ending(path) or "") as found:
        yield found


def _read_messages(path: Path, messages: BagMessages) -> None:
    """Take all usable messages."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    taking: Mapping[str, Callable[[str, int, Any], None]] = {
        "sensor_msgs/msg/LaserScan": messages.scan,
        "nav_msgs/msg/Odometry": messages.wheels,
        "sensor_msgs/msg/Imu": messages.inertial,
        "tf2_msgs/msg/TFMessage": messages.edges,
        "tf/msg/tfMessage": messages.edges,
    }
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        worth = [found for found in reader.connections if found.msgtype in taking]
        for connection, at_ns, data in reader.messages(connections=worth):
            message = reader.deserialize(data, connection.msgtype)
            taking[connection.msgtype](connection.topic, at_ns, message)
