from hw.drivers.chain.chain_settings import (
    KEYLESS as KEYLESS,
    observer_address as observer_address,
)
