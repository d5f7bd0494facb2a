from cobodeck.paper.conditions import (
    CONDITIONS as CONDITIONS,
    EvaluationPlan as EvaluationPlan,
)
from cobodeck.paper.evaluation import (
    evaluate as evaluate,
)
from cobodeck.paper.page import (
    paper_block as paper_block,
    paper_in_short as paper_in_short,
)
from cobodeck.paper.report import (
    draw_figures as draw_figures,
    record_conditions as record_conditions,
    write_report as write_report,
)
from cobodeck.paper.tables import (
    claim_table as claim_table,
    route_table as route_table,
    table_2 as table_2,
)
