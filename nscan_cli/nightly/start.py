"""What the process of a log begins with, called by its path: `python -P start.py PLACE`.

`python -m` would look for modules in the current folder first, and run what somebody has put there. The
package is the one that this file is part of, whichever other one could be found.
"""

import importlib.util
import sys
from pathlib import Path


def take_package(folder: Path) -> None:
    """Let the package in this folder be the one that is imported from now on."""
    found = importlib.util.spec_from_file_location(folder.name, folder / "__init__.py")
    assert found is not None
    assert found.loader is not None
    sys.modules[folder.name] = package = importlib.util.module_from_spec(found)
    found.loader.exec_module(package)


if __name__ == "__main__":
    take_package(Path(__file__).parent.parent)
    from nscan_cli.nightly.work import main

    main(sys.argv[1])
