"""The entry of a worker process, called by its path: `python -P bootstrap.py MODULE [ARGUMENT …]`.

`python -m` would search the current folder first and run modules that somebody has put there. This imports
the package that this file is part of, whichever other copies are on the search path.
"""

import importlib
import importlib.util
import sys
from pathlib import Path


def worker_command(module: str, *arguments: str) -> list[str]:
    """The command line of a process that runs `main` of a module of this package, as in `nightly.worker`."""
    return [sys.executable, "-P", __file__, module, *arguments]


def import_package_at(folder: Path) -> None:
    """Import the package in this folder, so that later imports of its name find it."""
    found = importlib.util.spec_from_file_location(folder.name, folder / "__init__.py")
    assert found is not None
    assert found.loader is not None
    sys.modules[folder.name] = package = importlib.util.module_from_spec(found)
    found.loader.exec_module(package)


if __name__ == "__main__":
    own = Path(__file__).parent
    import_package_at(own)
    module, *arguments = sys.argv[1:]
    importlib.import_module(f"{own.name}.{module}").main(*arguments)
