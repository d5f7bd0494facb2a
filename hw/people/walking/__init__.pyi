from hw.people.walking import (
    route as route,
    wanderer as wanderer,
)
from hw.people.walking.attacker import (
    Attacker as Attacker,
)
from hw.people.walking.interaction import (
    Interaction as Interaction,
)
from hw.people.walking.leaving import (
    Leaving as Leaving,
    turned as turned,
    walked as walked,
)
from hw.people.walking.manner import (
    ATTACKERS as ATTACKERS,
    ATTENTIVE as ATTENTIVE,
    MANNERS as MANNERS,
    Manner as Manner,
    at_speed as at_speed,
    manner_named as manner_named,
)
from hw.people.walking.person import (
    Actor as Actor,
    Person as Person,
    Touch as Touch,
)
from hw.people.walking.script import (
    UserFile as UserFile,
    load_script as load_script,
    script_names as script_names,
)
from hw.people.walking.walker import (
    Walker as Walker,
)
