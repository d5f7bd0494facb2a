from states.watching.states import (
    silence as silence,
    sustained as sustained,
)
