from cobodeck.live.charts.chart_message import (
    chart_message as chart_message,
)
from cobodeck.live.charts.chart_reader import (
    ChartReader as ChartReader,
)
from cobodeck.live.charts.edited import (
    EditedCharts as EditedCharts,
)
