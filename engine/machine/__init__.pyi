from engine.machine.arbitration import (
    Contest as Contest,
)
from engine.machine.deciding import (
    AGAIN as AGAIN,
    GRANTED as GRANTED,
    MATCHED as MATCHED,
    RAISED as RAISED,
    REFUSED as REFUSED,
    Judge as Judge,
)
from engine.machine.exploration import (
    Event as Event,
    Exploration as Exploration,
    Step as Step,
    after_steps as after_steps,
    explore as explore,
    never_taken as never_taken,
)
from engine.machine.machine import Machine as Machine, shared_part as shared_part
from engine.machine.named_values import NamedValues as NamedValues
from engine.machine.node import (
    ASK as ASK,
    AT_ONCE as AT_ONCE,
    CHOSEN as CHOSEN,
    ENDED as ENDED,
    EVERY_TICK as EVERY_TICK,
    IDLE as IDLE,
    KEEP as KEEP,
    NEVER_ENTERED as NEVER_ENTERED,
    PUT_OFF as PUT_OFF,
    REOPEN as REOPEN,
    RETRY as RETRY,
    RETRYING as RETRYING,
    RUNNING as RUNNING,
    WAITING as WAITING,
    BoxNode as BoxNode,
    LeafNode as LeafNode,
    Opening as Opening,
    Route as Route,
    RunNode as RunNode,
    Substitute as Substitute,
    Token as Token,
    Writes as Writes,
    nodes_of as nodes_of,
    opening_of as opening_of,
)
from engine.machine.outputs import (
    checked as checked,
    shown as shown,
)
from engine.machine.scripted_states import (
    LeafScript as LeafScript,
    perhaps as perhaps,
)
from engine.machine.vertices import (
    Box as Box,
    Cell as Cell,
    Leaf as Leaf,
    Vertex as Vertex,
)
