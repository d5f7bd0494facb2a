from cobodeck.statistics.bounds import (
    bounded_share as bounded_share,
    mean_bounds as mean_bounds,
    proportion_bounds as proportion_bounds,
)
from cobodeck.statistics.ranks import (
    KruskalWallis as KruskalWallis,
    Trend as Trend,
    holm as holm,
    jonckheere_terpstra as jonckheere_terpstra,
    kruskal_wallis as kruskal_wallis,
)
