"""A contract of `lint-imports`: a folder is imported by its face."""

from __future__ import annotations

from collections.abc import Iterator

from grimp import ImportGraph
from importlinter import Contract, ContractCheck, output

from engine.faces import homes, offers


class FacesContract(Contract):
    """Modules outside a folder import what its `__init__` offers, not its modules.

    A module that the stub of the folder names may be imported as a whole.
    """

    type_name = "faces"

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        found = sorted(_past_faces(graph))
        return ContractCheck(kept=not found, metadata={"found": found})

    def render_broken_contract(self, check: ContractCheck) -> None:
        for importer, module in check.metadata["found"]:
            folder = module.rpartition(".")[0]
            output.print_error(f"{importer} imports {module}; import from {folder}, or name it in")
            output.print_error(f"{folder.replace('.', '/')}/__init__.pyi")


def _past_faces(graph: ImportGraph) -> Iterator[tuple[str, str]]:
    """Each import of a module from outside its folder, past the folder's face."""
    for module in graph.modules:
        folder, _, name = module.rpartition(".")
        if (
            folder not in graph.modules
            or module == "engine.faces"
            or graph.find_children(module)
            or not offers(folder)
        ):
            continue
        if homes(folder).get(name) == folder:
            continue
        for importer in graph.find_modules_that_directly_import(module):
            if not importer.startswith(f"{folder}."):
                yield importer, module
