"""Shortcuts in numba's own work give what numba gives."""

from __future__ import annotations

import re

from tests.kernels.kernels_kept import KERNELS, RESULTS, files, process, report

NUMBER = re.compile(rb"B\d+v\d+")
"""A function's number in its name."""
WITHOUT = """
import contextlib
from nscan_cli.kernels import whole_kernels
whole_kernels.numba_shortcuts = contextlib.nullcontext
"""
LEFT = """
import numba
from numba.core import ir
from numba.core.base import BaseContext
from numba.core.postproc import PostProcessor
from numba.core.runtime.context import NRTContext
from numba.core.types.functions import BaseFunction
from numba.core.typing.context import BaseContext as TypingContext
methods = [
    (ir.Inst, "_rec_list_vars"), (NRTContext, "get_meminfos"), (BaseFunction, "get_call_type"),
    (PostProcessor, "run"), (TypingContext, "refresh"), (BaseContext, "refresh"),
    (BaseContext, "get_abi_sizeof"), (BaseContext, "get_abi_alignment"),
]
before = [vars(owner)[name] for owner, name in methods]
import nscan_cli.kernels.numba_shortcuts as shortcuts
with shortcuts.numba_shortcuts():
    print(sum(vars(owner)[name] is not own for (owner, name), own in zip(methods, before)))
from some_kernels import add, refuse
add(1, 2)
try:
    refuse(2)
except ValueError:
    pass
print(before == [vars(owner)[name] for owner, name in methods])
"""


def test_kernels_have_the_same_machine_code_without_shortcuts(tmp_path):
    """But for the numbers of functions: numba then compiles some of its own twice. With one seed of hashes,
    since sets decide the order of symbols."""
    codes = []
    for before in ("", WITHOUT):
        assert report(tmp_path, before, PYTHONHASHSEED="0")[3] == RESULTS
        kept = files(tmp_path, "code")
        codes.append({path.name: NUMBER.sub(b"", path.read_bytes().split(b"\n", 2)[2]) for path in kept})
        for path in kept:
            path.unlink()
    assert codes[0] == codes[1]


def test_numba_itself_is_left_as_it_is(tmp_path):
    """All shortcuts are taken, and only while a kernel is compiled."""
    (tmp_path / "some_kernels.py").write_text(KERNELS)
    assert process(tmp_path, LEFT).split() == [b"8", b"True"]
