"""Kinds of fault of bench `faults`: all tables, one after the other."""

from __future__ import annotations

from .kind import FaultKind
from .kinds_contact import CONTACT_KINDS
from .kinds_controller import CONTROLLER_KINDS
from .kinds_driver import DRIVER_KINDS
from .kinds_network import NETWORK_KINDS
from .kinds_process import PROCESS_KINDS
from .kinds_program import PROGRAM_KINDS
from .kinds_reaction import REACTION_KINDS
from .kinds_skin import SKIN_KINDS

KINDS: tuple[FaultKind, ...] = (
    *SKIN_KINDS,
    *CONTROLLER_KINDS,
    *NETWORK_KINDS,
    *PROCESS_KINDS,
    *PROGRAM_KINDS,
    *CONTACT_KINDS,
    *REACTION_KINDS,
    *DRIVER_KINDS,
)
