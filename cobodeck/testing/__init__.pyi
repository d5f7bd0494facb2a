from cobodeck.testing.edge_coverage import (
    EdgeCoverage as EdgeCoverage,
    edges_of as edges_of,
    taken as taken,
)
from cobodeck.testing.recorded_case import (
    CASE_ENDING as CASE_ENDING,
    CaseStart as CaseStart,
    RecordedCase as RecordedCase,
    decision_lines as decision_lines,
)
from cobodeck.testing.stub_parts import (
    Parts as Parts,
)
from cobodeck.testing.testing import (
    ChartTester as ChartTester,
)
