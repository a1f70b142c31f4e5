"""Settings of all tests."""

from __future__ import annotations

from hypothesis import settings

# No test looks at a clock: with the first example kernels may be compiled.
settings.register_profile("no clock", deadline=None)
settings.load_profile("no clock")
