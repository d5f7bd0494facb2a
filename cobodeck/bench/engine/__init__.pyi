from cobodeck.bench.engine.engine_bench import (
    times as times,
)
