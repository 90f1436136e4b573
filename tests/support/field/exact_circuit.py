"""Electrodes and terminals in 60 digits, by Kirchhoff's laws as they stand: no row is combined or scaled."""

from __future__ import annotations

import math

import mpmath as mp

from coneskin.skin.field.fourport import Coupling, DrivePhase
from coneskin.skin.field.model import FieldModel


def exact_volts(coupling: Coupling, model: FieldModel, phase: DrivePhase) -> list[mp.mpf]:
    """Return the potentials of A, B, C, D [V]; unknown are four potentials, four currents and the contact's voltage."""
    with mp.workdps(60):
        sheet = model.sheet
        upper = mp.mpf(sheet.breadth) / (mp.mpf(model.upper_resistance) * mp.mpf(sheet.length))
        lower = mp.mpf(sheet.length) / (mp.mpf(model.lower_resistance) * mp.mpf(sheet.breadth))
        names = ("conductance", "x", "y", "xx", "xy", "yy")
        g, x, y, xx, xy, yy = (mp.mpf(float(getattr(coupling, name)[0])) for name in names)
        m, right = mp.matrix(9, 9), mp.matrix(9, 1)
        for i, t in enumerate(phase.terminals):
            m[i, 4 + i] = 1
            if not math.isinf(t.resistance):
                m[i, i], m[i, 4 + i], right[i] = 1, mp.mpf(t.resistance) + mp.mpf(t.lead), mp.mpf(t.emf)
        for row, entries in (
            (4, {0: upper + xx, 1: -upper - xx, 2: -xy, 3: xy, 4: -1, 8: x * g}),
            (5, {4: 1, 5: 1, 8: -g}),
            (6, {0: xy, 1: -xy, 2: -lower - yy, 3: lower + yy, 6: 1, 8: y * g}),
            (7, {6: 1, 7: 1, 8: g}),
            (8, {0: x, 1: 1 - x, 2: -y, 3: y - 1, 8: -1}),
        ):
            for column, value in entries.items():
                m[row, column] = value
        return list(mp.lu_solve(m, right))[:4]
