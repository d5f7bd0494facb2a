from cobodeck.pictures import (
    render_scene as render_scene,
)
from cobodeck.pictures.benched import (
    draw_bench as draw_bench,
)
from cobodeck.pictures.campaign_picture import (
    draw_parameter as draw_parameter,
)
from cobodeck.pictures.envelope_picture import (
    draw_envelope as draw_envelope,
)
from cobodeck.pictures.knob_picture import (
    draw_knobs as draw_knobs,
)
from cobodeck.pictures.localization_picture import (
    localized_picture as localized_picture,
)
from cobodeck.pictures.reach_plot import (
    reach_picture as reach_picture,
)
from cobodeck.pictures.space_plot import (
    space_picture as space_picture,
)
from cobodeck.pictures.stability_picture import (
    draw_stability as draw_stability,
)
