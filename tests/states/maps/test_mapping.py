"""Maps from scans: what beams ended in and passed, told by sampling along them."""

import math

import numpy as np
import pytest

from hw.geometry import Pose2
from states.maps.mapping import FARTHEST, LARGEST, Mapper
from states.maps.occupancy import FREE, OCCUPIED, UNKNOWN, load_map, save_map


def ring(radius, count=720, x=0.0, y=0.0):
    angles = np.linspace(0.0, 2.0 * math.pi, count, endpoint=False)
    return np.stack([x + radius * np.cos(angles), y + radius * np.sin(angles)], axis=1)


def value(map_, x, y):
    cell = map_.cell(x, y)
    return UNKNOWN if cell is None else map_.values[cell]


def test_beams_end_in_walls_and_pass_the_floor():
    mapper = Mapper(0.05)
    mapper.add((0.01, 0.02), ring(2.0))
    map_ = mapper.map()

    for angle in np.arange(0.0, 6.2, 0.1):
        c, s = math.cos(angle), math.sin(angle)
        assert value(map_, 1.8 * c, 1.8 * s) == FREE
        assert value(map_, 2.12 * c, 2.12 * s) == UNKNOWN
    assert all(value(map_, x, y) == OCCUPIED for x, y in ring(2.0))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.few(1)
def test_passed_cells_are_those_that_lie_on_a_beam(seed):
    dice = np.random.default_rng(seed)
    origin, ends = dice.uniform(-1.0, 1.0, 2), dice.uniform(-4.0, 4.0, (30, 2))
    mapper = Mapper(0.1)
    mapper.add(tuple(origin), ends)
    map_ = mapper.map()

    shares = np.linspace(0.0, 1.0, 20_001)[:, None]
    looked_at = {tuple(np.floor(end / 0.1).astype(int)) for end in ends}
    for end in ends:
        places = origin + shares * (end - origin)
        looked_at |= set(map(tuple, np.floor(places / 0.1).astype(int).tolist()))
    corner = map_.map_from_corner
    row, column = np.nonzero(map_.values != UNKNOWN)
    known = set(
        zip(
            (column + round(corner.x / 0.1)).tolist(),
            (row + round(corner.y / 0.1)).tolist(),
            strict=True,
        )
    )
    assert looked_at - known == set()  # cells that a beam but touches may be told differently
    assert len(known - looked_at) <= 3


def test_who_walks_by_is_no_wall():
    mapper = Mapper(0.05)
    for n in range(10):
        ends = ring(3.0)
        at = 90 + 30 * n
        ends[at : at + 20] *= 0.5  # a person, elsewhere each time
        mapper.add((0.0, 0.0), ends)
    map_ = mapper.map()

    assert all(value(map_, x, y) == OCCUPIED for x, y in ring(3.0))
    assert not any(value(map_, x, y) == OCCUPIED for x, y in ring(1.5))


def test_a_wall_that_is_grazed_stays():
    """Beams along a wall pass its cells more often than they end there; none of its own scan."""
    wall = np.stack([np.arange(0.5, 5.0, 0.01), np.full(450, 1.012)], axis=1)
    mapper = Mapper(0.05)
    for x in np.arange(0.0, 2.0, 0.1):
        mapper.add((x, 0.9), wall)

    assert all(value(mapper.map(), x, 1.012) == OCCUPIED for x in np.arange(0.6, 4.9, 0.05))


def test_far_ends_make_no_walls_but_show_floor():
    mapper = Mapper(0.1)
    mapper.add((0.0, 0.0), np.array([[FARTHEST + 20.0, 0.02]]))
    map_ = mapper.map()

    assert not (map_.values == OCCUPIED).any()
    assert value(map_, FARTHEST - 1.0, 0.02) == FREE
    assert value(map_, FARTHEST + 1.0, 0.02) == UNKNOWN


def test_a_map_grows_to_all_sides_and_stays_where_it_is():
    mapper = Mapper(0.05)
    centres = [(0.0, 0.0), (9.0, 1.0), (-8.0, -12.0), (3.0, 20.0)]
    for x, y in centres:
        mapper.add((x, y), ring(1.0, x=x, y=y))
    map_ = mapper.map()

    for x, y in centres:
        assert value(map_, x, y) == FREE
        assert all(value(map_, *end) == OCCUPIED for end in ring(1.0, x=x, y=y))


def test_where_a_map_lies_does_not_matter():
    here, there = Mapper(0.05), Mapper(0.05)
    here.add((0.0, 0.0), ring(2.0))
    there.add((1e6, -1e6), ring(2.0, x=1e6, y=-1e6))
    one, other = here.map(), there.map()

    assert one.values.shape == other.values.shape
    assert np.mean(one.values == other.values) > 0.99  # cells are cut by 1e-10 m elsewhere


def test_a_map_is_written_as_map_server_has_it_and_read_again(tmp_path):
    mapper = Mapper(0.05)
    mapper.add((0.3, 0.2), ring(2.0))
    map_ = mapper.map()
    save_map(map_, tmp_path / "room.yaml")
    again = load_map(tmp_path / "room.yaml")

    assert (again.values == map_.values).all()
    assert again.map_from_corner == map_.map_from_corner == Pose2(-2.0, -2.0)


def test_nothing_gives_no_map_and_the_endless_is_refused():
    mapper = Mapper(0.05)
    mapper.add((0.0, 0.0), np.empty((0, 2)))
    with pytest.raises(ValueError, match="no scan was taken"):
        mapper.map()
    mapper.add((0.0, 0.0), ring(1.0))
    with pytest.raises(ValueError, match=f"more than {LARGEST} cells"):
        mapper.add((1e6, 1e6), ring(1.0, x=1e6, y=1e6))
    assert value(mapper.map(), 0.0, 0.0) == FREE
