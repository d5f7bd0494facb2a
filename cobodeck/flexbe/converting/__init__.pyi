from cobodeck.flexbe.converting.conversion import (
    Conversion as Conversion,
    convert as convert,
)
from cobodeck.flexbe.converting.ready_states import (
    code_of as code_of,
)
from cobodeck.flexbe.converting.state_classes import (
    StateClass as StateClass,
)
from cobodeck.flexbe.converting.told import (
    Left as Left,
)
