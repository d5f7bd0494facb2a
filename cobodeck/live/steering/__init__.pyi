from cobodeck.live.steering.page_operator import (
    PageOperator as PageOperator,
)
