"""A layout of the Foxglove app for records of runs: room, transitions, separation, log, messages.

Import it in the app and open the record. Foxglove's own library writes it, so its form is theirs.
Topics and fields are those of `FORMAT.md`.
"""

from __future__ import annotations

from collections.abc import Collection

from foxglove.layouts import (
    BasePanel,
    BaseRendererLaserScanTopicSettings,
    BaseRendererSceneSettings,
    BaseRendererSceneUpdateTopicSettings,
    BaseRendererTransforms,
    Layout,
    LogConfig,
    LogPanel,
    PlotConfig,
    PlotPanel,
    PlotSeries,
    RawMessagesConfig,
    RawMessagesPanel,
    SplitContainer,
    SplitItem,
    StateTransitionsConfig,
    StateTransitionsPanel,
    StateTransitionsSeries,
    ThreeDeeConfig,
    ThreeDeePanel,
)

from cobodeck.record.format import TOPIC

TRANSITIONS = {"node": "trace.line[5]", "by the outcome": "trace.line[4]"}
"""A transition is `[ns, "move", container, node, outcome, next node]`; others are shorter."""
SEPARATION = {
    "separation, m": "safety.separation",
    "needed, m": "safety.needed",
    "true gap so far, m": "truth.min_gap",
}


def foxglove_layout(topics: Collection[str]) -> str:
    """The layout for a record with these topics, as JSON."""
    log = LogPanel(title="log", config=LogConfig(topic_to_render="log"))
    side: list[BasePanel] = [_transitions(), _separation(), log, _messages()]
    column = SplitContainer(direction="column", items=[SplitItem(content=one) for one in side])
    room = SplitItem(proportion=1.5, content=_room(topics))
    return Layout(content=SplitContainer(items=[room, SplitItem(content=column)])).to_json()


def _room(topics: Collection[str]) -> ThreeDeePanel:
    scans = sorted(one for one in topics if one.startswith(TOPIC) and one.endswith(".scan"))
    config = ThreeDeeConfig(
        fixed_frame="map",
        follow_tf="map",
        topics={
            "scene": BaseRendererSceneUpdateTopicSettings(visible=True),
            **{one: BaseRendererLaserScanTopicSettings(visible=True) for one in scans},
        },
        scene=BaseRendererSceneSettings(
            transforms=BaseRendererTransforms(visible=True, show_label=True)
        ),
    )
    return ThreeDeePanel(title="room", config=config)


def _transitions() -> StateTransitionsPanel:
    paths = [StateTransitionsSeries(value=v, label=name) for name, v in TRANSITIONS.items()]
    config = StateTransitionsConfig(paths=paths, is_synced=True)
    return StateTransitionsPanel(title="transitions", config=config)


def _separation() -> PlotPanel:
    paths = [PlotSeries(value=v, label=name, enabled=True) for name, v in SEPARATION.items()]
    return PlotPanel(title="separation", config=PlotConfig(paths=paths, is_synced=True))


def _messages() -> RawMessagesPanel:
    return RawMessagesPanel(title="trace", config=RawMessagesConfig(topic_path="trace"))
