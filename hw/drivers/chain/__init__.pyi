from hw.drivers.chain.chain_settings import (
    KEYLESS as KEYLESS,
)
