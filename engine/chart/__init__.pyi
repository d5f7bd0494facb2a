from engine.chart.breakpoints import (
    text_without_breaks as text_without_breaks,
)
from engine.chart.chart import (
    AUTONOMY as AUTONOMY,
    CONTAINERS as CONTAINERS,
    LEAVES as LEAVES,
    Chart as Chart,
    DataKey as DataKey,
    Node as Node,
    Parameter as Parameter,
    Reference as Reference,
    Rule as Rule,
    key_mark_of as key_mark_of,
    mark_of as mark_of,
    nodes_by_path as nodes_by_path,
)
from engine.chart.grammar import (
    CHART as CHART,
    DATA as DATA,
    FORMS as FORMS,
    INPUT as INPUT,
    KEYS_OF as KEYS_OF,
    NODE as NODE,
    PARAMETER as PARAMETER,
    RETRY as RETRY,
    RULE as RULE,
    ChartKey as ChartKey,
    Keys as Keys,
    Value as Value,
)
from engine.chart.load import (
    Library as Library,
    chart_value as chart_value,
    load_files as load_files,
    load_text as load_text,
    start_value as start_value,
)
