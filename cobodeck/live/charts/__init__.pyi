from cobodeck.live.charts.chart_reader import (
    ChartReader as ChartReader,
)
from cobodeck.live.charts.drawn_chart import (
    chart_message as chart_message,
)
from cobodeck.live.charts.edited import (
    EditedCharts as EditedCharts,
)
