from hw.scene.items import (
    Graspable as Graspable,
    SpacePoint as SpacePoint,
    surface_under as surface_under,
)
from hw.scene.objects import (
    Body as Body,
    Thing as Thing,
    named as named,
)
from hw.scene.room import (
    Disc as Disc,
    Point as Point,
    Ring as Ring,
    Room as Room,
    Segment as Segment,
    contains as contains,
    distance_to_segment as distance_to_segment,
    edges as edges,
    foot as foot,
)
from hw.scene.scene import (
    Scene as Scene,
    SceneFile as SceneFile,
    load_scene as load_scene,
    scene_from as scene_from,
    scene_names as scene_names,
)
from hw.scene.surface import (
    Surface as Surface,
)
from hw.scene.zones import (
    NO_ZONES as NO_ZONES,
    Zones as Zones,
)
