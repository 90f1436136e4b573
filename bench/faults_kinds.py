"""Kinds of fault of bench/faults.py: all tables, one after the other."""

from __future__ import annotations

from faults_kind import FaultKind
from faults_kinds_contact import CONTACT_KINDS
from faults_kinds_controller import CONTROLLER_KINDS
from faults_kinds_driver import DRIVER_KINDS
from faults_kinds_network import NETWORK_KINDS
from faults_kinds_process import PROCESS_KINDS
from faults_kinds_program import PROGRAM_KINDS
from faults_kinds_reaction import REACTION_KINDS
from faults_kinds_skin import SKIN_KINDS

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
