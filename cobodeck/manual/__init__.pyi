from cobodeck.manual.chart_entries import (
    chart_page as chart_page,
)
from cobodeck.manual.example_nodes import (
    example_chart as example_chart,
)
from cobodeck.manual.file_entries import (
    ABOUTS as ABOUTS,
    EXAMPLES as EXAMPLES,
)
from cobodeck.manual.in_markdown import (
    markdown_text as markdown_text,
)
from cobodeck.manual.on_terminal import (
    terminal_text as terminal_text,
)
from cobodeck.manual.page import (
    ManualPage as ManualPage,
    PageEntry as PageEntry,
    PageTable as PageTable,
    YamlCode as YamlCode,
)
from cobodeck.manual.pages import (
    NAMES as NAMES,
    REFERENCE as REFERENCE,
    manual_page as manual_page,
    manual_pages as manual_pages,
)
