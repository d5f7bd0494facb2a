from hw.model.urdf.chain import (
    BodyMass as BodyMass,
    SerialChain as SerialChain,
    serial_chain as serial_chain,
)
from hw.model.urdf.frames import (
    Matrix as Matrix,
    inverted as inverted,
    matrix as matrix,
    placement as placement,
)
from hw.model.urdf.urdf import (
    Joint as Joint,
    Urdf as Urdf,
    parse_urdf as parse_urdf,
    read_urdf as read_urdf,
)
