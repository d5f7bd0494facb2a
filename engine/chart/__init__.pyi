from engine.chart.chart import (
    AUTONOMY as AUTONOMY,
    CONTAINERS as CONTAINERS,
    Chart as Chart,
    DataKey as DataKey,
    Node as Node,
    Parameter as Parameter,
    Reference as Reference,
    Rule as Rule,
    key_mark_of as key_mark_of,
    mark_of as mark_of,
)
from engine.chart.load import (
    CHART_KEYS as CHART_KEYS,
    FORMS as FORMS,
    KEYS as KEYS,
    NODE_KEYS as NODE_KEYS,
    Library as Library,
    load_files as load_files,
    load_text as load_text,
)
