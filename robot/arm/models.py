"""Arms by name: the table of each maker whose arms coneskin drives, and the search in it."""

from __future__ import annotations

import re

from coneskin.core.errors import KinematicsError

from .model import ArmModel
from .ur_models import UR_MODELS

_MODEL_TABLE = {arm.name.lower(): arm for arm in UR_MODELS}
#: names that ``arm_model`` knows
MODEL_NAMES = tuple(arm.name for arm in UR_MODELS)


def arm_model(name: str) -> ArmModel:
    """Return the nominal arm of that name; case, spaces, hyphens and underscores do not matter ("ur-10e", "UR10 e").

    Raises:
        KinematicsError: there is no such arm; the message lists all.
    """
    found = _MODEL_TABLE.get(re.sub(r"[\s_-]", "", name).lower())
    if found is None:
        raise KinematicsError(f"arm must be one of {', '.join(MODEL_NAMES)}, got {name!r}")
    return found
