"""What a process of a night begins with, called by its path: `python -P start.py MODULE [ARGUMENT …]`.

`python -m` would look for modules in the current folder first, and run what somebody has put there. The
package is the one that this file is part of, whichever other one could be found.
"""

import importlib
import importlib.util
import sys
from pathlib import Path


def worker_command(module: str, *arguments: str) -> list[str]:
    """The command line of a process that runs `main` of a module of this folder."""
    return [sys.executable, "-P", __file__, module, *arguments]


def import_package_at(folder: Path) -> None:
    """Let the package in this folder be the one that is imported from now on."""
    found = importlib.util.spec_from_file_location(folder.name, folder / "__init__.py")
    assert found is not None
    assert found.loader is not None
    sys.modules[folder.name] = package = importlib.util.module_from_spec(found)
    found.loader.exec_module(package)


if __name__ == "__main__":
    own = Path(__file__).parent
    import_package_at(own.parent)
    module, *arguments = sys.argv[1:]
    importlib.import_module(f"{own.parent.name}.{own.name}.{module}").main(*arguments)
