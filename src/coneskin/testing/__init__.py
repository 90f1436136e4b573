"""What your tests may use, and nothing else: the contracts of a source and of an arm's driver.

for check in SOURCE_CHECKS:                                             # from coneskin.testing.source_contract
    check(open_my_source)
for check in ARM_CHECKS:                                                   # from coneskin.testing.arm_contract
    check(open_my_arm)
"""

from __future__ import annotations

from collections.abc import Callable


def expect_error(error: type[Exception], call: Callable[[], object], otherwise: str) -> None:
    """Raise AssertionError, with what is wrong ``otherwise``, unless a call raises this error."""
    try:
        call()
    except error:
        return
    raise AssertionError(otherwise)
