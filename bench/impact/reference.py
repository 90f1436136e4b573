"""Reference of a contact with 60 digits, in mpmath: Taylor series of order 44 between events found by halving.

Without damping and servo, two free masses on a spring of two pieces have a closed form, which checks it.
"""

from __future__ import annotations

import math
from typing import Any

import mpmath as mp

from coneskin.impact.permissible_speed.two_mass_contact import TwoMassContact

mp.mp.dps = 64
_TAYLOR_ORDER = 44
_TIME_TOLERANCE = mp.mpf(10) ** -61


def reference(contact: TwoMassContact, horizon: float) -> dict[str, Any]:
    """Return peak force, force and compression at the horizon, as numbers with 60 digits."""
    arm, body, pad = contact.arm, contact.body, contact.padding
    num = mp.mpf
    kt = mp.inf if math.isinf(body.tissue) else num(body.tissue)
    soft = 1 / (1 / num(pad.stiffness) + 1 / kt)
    hard = 1 / (1 / num(pad.hard_stiffness) + 1 / kt)
    end = num(pad.stiffness) * num(pad.thickness) / soft
    loss = num(pad.loss) * soft / num(pad.stiffness)
    m1 = num(0) if math.isinf(arm.mass) else 1 / num(arm.mass)
    m2 = num(0) if math.isinf(body.mass) else 1 / num(body.mass)
    k1, c1, k2, c2 = (num(v) for v in (arm.stiffness, arm.damping, body.support, body.damping))
    s, w, x, v = num(0), num(arm.speed), num(0), num(0)
    way, drive, braking = num(0), num(arm.speed), num(0)
    t, last = num(0), num(horizon)
    mode = "soft"
    closed = None
    braked = stands = mp.inf
    peak = force = num(0)

    def series() -> tuple[list[Any], ...]:
        ss, ww, xx, vv, ff, ee = [s], [w], [x], [v], [], []
        p = (way, drive, -braking / 2)
        d = (drive, -braking)
        for n in range(_TAYLOR_ORDER):
            if mode == "free":
                ff.append(num(0))
            else:
                slope = soft if mode == "soft" else hard
                first = soft * s if mode == "soft" else soft * end + hard * (s - end)
                ee.append(first if n == 0 else slope * ss[n])
                ff.append(ee[n] + loss * mp.fsum(ee[j] * ww[n - j] for j in range(n + 1)))
            if m1:
                pn, dn = (p[n] if n < 3 else 0), (d[n] if n < 2 else 0)
                a1 = m1 * (k1 * (pn - ss[n] - xx[n]) + c1 * (dn - ww[n] - vv[n]) - ff[n])
            else:
                a1 = -braking if n == 0 else num(0)
            a2 = m2 * (ff[n] - k2 * xx[n] - c2 * vv[n])
            ss.append(ww[n] / (n + 1))
            xx.append(vv[n] / (n + 1))
            ww.append((a1 - a2) / (n + 1))
            vv.append(a2 / (n + 1))
        return ss, ww, xx, vv, ff

    def at(poly: list[Any], h: Any) -> Any:
        value = num(0)
        for c in reversed(poly):
            value = value * h + c
        return value

    def crossing(poly: list[Any], level: Any, h: Any, rising: bool) -> Any:
        """First time at which a series crosses a level in a direction, or None."""
        sign = 1 if rising else -1
        grid = [h * i / 16 for i in range(17)]
        values = [sign * (at(poly, g) - level) for g in grid]
        for i in range(16):
            if (values[i] < 0 or i == 0) and values[i + 1] > 0 and (i > 0 or values[0] < -_TIME_TOLERANCE):
                low, high = grid[i], grid[i + 1]
                for _ in range(230):
                    mid = (low + high) / 2
                    low, high = (mid, high) if sign * (at(poly, mid) - level) < 0 else (low, mid)
                return high
        return None

    while t < last:
        ss, ww, xx, vv, ff = series()
        h = min(b for b in (last, braked, stands) if b > t) - t
        for poly in (ss, ww, xx, vv):
            scale = max(abs(poly[0]), num(10) ** -12)
            for power in (_TAYLOR_ORDER, _TAYLOR_ORDER - 1):
                if poly[power]:
                    h = min(h, (_TIME_TOLERANCE * scale / abs(poly[power])) ** (num(1) / power))
        event = ""
        wanted = {
            "soft": [("hard", ss, end, True), ("free", ss, num(0), False)],
            "hard": [("soft", ss, end, False)],
            "free": [("soft", ss, num(0), True)],
        }[mode]
        if closed is None:
            wanted = [*wanted, ("close", ff, num(contact.closing_force), True)]
        for name, poly, level, rising in wanted:
            found = crossing(poly, level, h, rising)
            if found is not None and found <= h:
                h, event = found, name
        slope = [n * c for n, c in enumerate(ff)][1:]
        top = crossing(slope, num(0), h, False)
        peak = max(peak, at(ff, h), at(ff, top) if top is not None else num(0))
        force = at(ff, h)
        s, w, x, v = at(ss, h), at(ww, h), at(xx, h), at(vv, h)
        way, drive, t = way + h * (drive - braking * h / 2), drive - braking * h, t + h
        if event == "close":
            closed = t
            braked = t + num(arm.reaction) if math.isfinite(arm.reaction) else mp.inf
        elif event:
            s = {"hard": end, "free": num(0), "soft": num(0) if mode == "free" else end}[event]
            mode = event
        if mp.isfinite(stands) and abs(t - stands) < _TIME_TOLERANCE:
            drive = braking = num(0)
            stands, t = mp.inf, +t
            w = w if m1 else -v
        elif mp.isfinite(braked) and abs(t - braked) < _TIME_TOLERANCE and not braking:
            braking = num(arm.deceleration)
            stands, braked = t + drive / braking, mp.inf
    return {"peak": peak, "force": force, "s": s, "w": w, "closed": closed}


def closed_form(speed: float, reduced: Any, soft: float, hard: float, end: float) -> Any:
    """Peak force of two free masses on a spring of two pieces: by energy, with 60 digits."""
    v, k, h, e = (mp.mpf(value) for value in (speed, soft, hard, end))
    left = reduced * v**2 / 2 - k * e**2 / 2
    if left <= 0:
        return v * mp.sqrt(reduced * k)
    return mp.sqrt((k * e) ** 2 + 2 * h * left)
