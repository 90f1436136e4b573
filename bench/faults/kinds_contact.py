"""Kinds of contact in each reaction: palms, grips, clamps, second hands, growing presses.

Whatever the arm does, the surface must not go towards a contact by much more than in a bare stop.
"""

from __future__ import annotations

from .kind import FEW, FaultKind
from .motion import AHEAD, BEHIND, Touch
from .setup import COMPLY, PATH, RETREAT, SLOW, Setup
from .trial import Trial

SLOW_MAY_TAKE = 2.0  # s; an arm that goes on slowly stops when it presses, not before
REACTIONS = {"retreat": RETREAT, "path": PATH, "comply": COMPLY, "slow": SLOW}
SEAM = 0.35  # rad on each side
LATER = 0.25  # s; by then an arm that was stopped moves away

#: name -> touches, model of the sheets, sensors
CONTACTS = {
    "palm over the seam": ((Touch(phi=SEAM, force=4.0), Touch(phi=6.28 - SEAM, force=4.0)), "field", 1),
    "wide palm over the seam": ((Touch(phi=1.0, force=3.0), Touch(phi=5.28, force=3.0)), "field", 1),
    "grip": ((Touch(phi=AHEAD), Touch(phi=BEHIND)), "field", 1),
    "second hand behind": ((Touch(), Touch(phi=BEHIND, after=LATER)), "field", 1),
    "second hand beside": ((Touch(), Touch(u=0.22, phi=2.6, after=LATER)), "field", 1),
    "growing press": ((Touch(force=2.0), Touch(after=0.05, force=18.0, rise=0.5)), "ladder", 1),
    "hard growing press": ((Touch(force=2.0), Touch(after=0.05, force=98.0, rise=0.5)), "ladder", 1),
    "clamp of two links": ((Touch(), Touch(sensor="1", phi=BEHIND)), "ladder", 2),
    "second hand on another skin": ((Touch(), Touch(sensor="1", phi=BEHIND, after=LATER)), "ladder", 2),
}
#: contacts that are close to others, and left out of a quick campaign but for a retreat
VARIANTS = ("wide palm over the seam", "second hand beside", "growing press")


def contact(reaction: str, name: str) -> FaultKind:
    """Return the kind of a contact in a reaction."""
    touches, sheets, skins = CONTACTS[name]
    return FaultKind(
        f"{reaction}: {name}",
        lambda t: Trial.press(t, *touches),
        SLOW_MAY_TAKE if reaction == "slow" else FEW,
        touched=True,
        variant=reaction != "retreat" and name in VARIANTS,
        setup=Setup(reaction=REACTIONS[reaction], sheets=sheets, skins=skins),
    )


CONTACT_KINDS = tuple(contact(reaction, name) for name in CONTACTS for reaction in REACTIONS)
