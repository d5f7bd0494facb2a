from cobodeck.live.charts.changed_chart import (
    changed_machine as changed_machine,
)
from cobodeck.live.charts.chart_reader import (
    ChartReader as ChartReader,
)
from cobodeck.live.charts.drawn_chart import (
    chart_message as chart_message,
)
from cobodeck.live.charts.edited import (
    EditedCharts as EditedCharts,
)
