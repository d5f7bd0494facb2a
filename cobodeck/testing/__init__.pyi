from cobodeck.testing.stub_parts import (
    Parts as Parts,
)
from cobodeck.testing.testing import (
    ChartTester as ChartTester,
)
