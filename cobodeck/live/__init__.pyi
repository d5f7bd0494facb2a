from cobodeck.live.chart_message import (
    chart_message as chart_message,
    picture_of as picture_of,
)
